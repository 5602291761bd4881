"""What a robot that drives is judged by, and what follows from it.

Antennae by `diagnosis`, `drift` and `touch_check`, servos by `watch`; `supervisor` decides. Nothing
here writes to a servo but `watch`, which only asks.
"""
