"""DYNAMIXEL servos by Protocol 2.0: a bus master for real ones, and virtual ones on a port.

Imports nothing of the rest of the package but errors, files and ports (docs/dxl.md).
"""
