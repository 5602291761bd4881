"""DYNAMIXEL servos by Protocol 2.0: a bus master for real ones, and virtual ones on a port."""

__version__ = "0.1.0"
