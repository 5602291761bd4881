"""From a box of servos to a robot: ports, ids, zeros and directions, and single joints by hand."""
