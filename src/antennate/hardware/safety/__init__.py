"""What decides whether a robot may move: checks, supervisor, deadlines, and torque itself."""
