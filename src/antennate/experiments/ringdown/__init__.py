"""How fast an antenna swings and how soon it stops.

The antenna is bent and let go in the physics engine. Its first mode is compared with the
eigenvalues of the chain, chains of more and more hinges with the closed form of a cone, and all of
it with what animals do.
"""
