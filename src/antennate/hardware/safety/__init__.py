"""Checks of signals and servos in a drive, and the supervisor. Nothing writes to a servo."""
