"""The antenna as physics: springs, taper, statics, sensor, calibration."""
