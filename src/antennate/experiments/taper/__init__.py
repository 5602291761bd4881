"""Stiffness along a tapering antenna, and the ladder of springs that follows it.

Diameters give the stiffness proxy (d / d_1)^4, beside the robot's ladder of springs, and the ladder
that follows the taper best within limits of coils.
"""
