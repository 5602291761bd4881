"""Geometric mechanics: poses, and bodies that move by changing their shape."""

__version__ = "0.1.0"
