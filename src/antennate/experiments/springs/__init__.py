"""Torsion springs: stiffness from wire and coils, and back.

Stiffness comes from wire, coil diameter and active coils, beside the paper's table; and back, the
sets of stock wire and mandrel that come nearest to wanted stiffnesses.
"""
