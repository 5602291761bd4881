"""What a robot that drives is judged by, and what follows from it.

Antennae by `signal_quality`, servos by `watch`; `supervisor` decides. Nothing
here writes to a servo but `watch`, which only asks.
"""
