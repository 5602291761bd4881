"""Leaving the plane: what antennae feel of the ground, and how the body is raised over it."""
