"""Geometric mechanics: poses, and bodies that move by changing their shape.

Needs NumPy and SciPy alone, and of this package only errors and types (docs/science/mechanics.md).
"""
