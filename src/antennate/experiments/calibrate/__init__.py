"""The experiment `calibrate`."""
