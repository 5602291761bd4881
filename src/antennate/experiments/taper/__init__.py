"""Stiffness along a tapering antenna, and springs that follow it.

Diameters give the stiffness proxy (d / d_1)^4, beside the robot's ladder of springs, and the ladder
that follows the taper best within limits of coils.
"""
