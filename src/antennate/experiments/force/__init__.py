"""The experiment `force`."""
