"""The experiment `springs`."""
