"""The robot as files for other programs: MJCF and URDF."""
