"""Running many trials, and what they say together."""
