"""Studies with antennate: each folder is an experiment, a command of `antennate`."""

__version__ = "0.1.0"
