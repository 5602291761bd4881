"""The experiment `wall`."""
