"""What an antenna is made of: springs, taper, sensor, ring-down.

Springs: stiffness from wire and coils beside the paper's table, and sets of stock wire and mandrel
that come near to wanted stiffnesses. Taper: the stiffness proxy (d / d_1)^4 of an animal's antenna
beside the robot's springs. Sensor: readings over the flex, a slow loop, a held flex, and the fixed
resistor that spreads readings farthest. Ring-down: the antenna is bent and let go in the physics
engine; its first mode beside the eigenvalues of the chain, and in the figure beside animals.

FILE is a robot, an antenna alone (the keys of [antenna]), or parameters of this command.
"""
