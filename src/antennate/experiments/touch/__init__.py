"""The experiment `touch`."""
