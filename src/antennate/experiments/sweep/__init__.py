"""The experiment `sweep`."""
