"""Scenes: what a robot walks in, from a file or from code, drawn anew for each trial."""
