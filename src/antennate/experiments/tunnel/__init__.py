"""The experiment `tunnel`."""
