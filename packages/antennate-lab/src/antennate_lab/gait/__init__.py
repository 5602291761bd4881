"""Walk on a flat floor: speed, turning and cost of the gait.

Each of the four maneuvers is walked, then the legs without the body wave, and FORWARD once for
every lead of the body wave over the legs.
"""
