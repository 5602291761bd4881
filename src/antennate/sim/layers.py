"""Which kinds of geoms can touch: MuJoCo's collision bits, named.

Two geoms collide if the `contype` of one meets the `conaffinity` of the other. The robot never
touches itself; only legs touch the floor; everything of the robot touches obstacles. In a scene,
geoms with the engine's default bits (1 and 1) become obstacles, planes the floor.
"""

FLOOR = 1
OBSTACLE = 2
LEG = 4
BODY = 8
ANTENNA = 16
