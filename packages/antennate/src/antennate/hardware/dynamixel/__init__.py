"""The DYNAMIXEL servos of a robot as its actuators: bring-up, torque, turns, what they do wrong."""
