"""From a box of servos to a robot: ports, ids, zeros, directions; single joints moved slowly."""
