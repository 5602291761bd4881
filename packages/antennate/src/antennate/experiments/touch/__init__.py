"""Move an antenna along walls: sensed contact against true contact.

The contact that the control senses is compared with the contact of the physics engine, a hundred
times a second. All walls, speeds and profiles meet the same overlaps, springs and noise.
Definitions: docs/science/touch.md.
"""
