"""Examines a robot at rest: who is there, in which state, and the cure for what is not good.

Nothing here turns torque on, and only `fix` writes.
"""
