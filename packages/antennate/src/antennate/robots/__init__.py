"""Robots as data: what a robot is made of, and what follows from it."""
