"""Running many trials and saying what came out."""
