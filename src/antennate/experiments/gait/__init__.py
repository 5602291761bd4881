"""The experiment `gait`."""
