"""The experiment `sensor`."""
