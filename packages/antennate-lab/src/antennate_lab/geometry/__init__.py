"""The gait by a model and the engine: best lead, speed, cost, turns.

A quasi-static model of the robot, from its description alone, walks the same gaits as the engine:
random ones, leads about the best, gaits that are fast or cheap, and turns of the twist map.
"""
