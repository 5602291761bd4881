"""Readings to flex: fit a recording, or push a simulated antenna.

The recording is a CSV file whose columns and units you declare; without one, a simulated rig pushes
an antenna at several speeds. One sigmoid is fitted and compared with a line and an isotonic curve;
data that cannot be calibrated are refused. `calibration.json` in the run directory is the file to
keep; `conditioning.toml` holds the same curve for `--config` of `tunnel` and for a robot's file.
"""
