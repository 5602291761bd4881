"""Simulate, calibrate, drive and study a pair of tactile antennae on a many-legged robot."""

__version__ = "0.1.0"
