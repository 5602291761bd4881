"""What geometric mechanics makes of the gait: model against simulation, best lead, speed and cost.

A quasi-static model of the robot, from its description alone, walks the same gaits as the engine:
random ones, leads about the best, gaits that are fast or cheap, and turns of the twist map.
"""
