"""The experiment `taper`."""
