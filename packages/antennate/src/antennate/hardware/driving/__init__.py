"""Drives the real robot: one session from the dry run to torque off."""
