"""Parts of an antennate robot from its numbers: `antennate build`."""

__version__ = "0.1.0"
