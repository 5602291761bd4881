"""The antenna as physics: springs, taper, statics, dynamics, sensor, calibration."""
