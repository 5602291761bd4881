"""A robot's numbers from the logs of its protocol of recordings.

The commands of each step go into the simulation, and the numbers of servos, yaw joints, antennae
and legs are sought with which it predicts what was measured. Each comes with its 90 % interval; a
number that the logs do not tell is named, with what to record. Walks at the middle frequency are
left out and judge the fit. Recordings of one servo on a bench set its numbers alone. robot.toml has
the fitted robot, for `--robot` of all commands.
"""
