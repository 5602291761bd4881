"""Antennae that move to and fro beside walls: shapes and distances.

Which shapes appear at which distance, centre and amplitude of the base oscillation, with the base
fixed and moving along; and how well flex and base angle together tell the distance of a wall and
the width of a gap, beside what each tells alone.
"""
