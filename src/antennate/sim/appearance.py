"""Colours of what a model shows: links, legs, both antennae and obstacles apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from antennate.robots.spec import ANTENNA_PREFIXES
from antennate.sim import layers
from antennate.sim.engine import mujoco

Colour = tuple[float, float, float, float]

_UNPAINTED = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)
"""The engine's colour of a geom that has none of its own."""
FLOOR: Colour = (0.97, 0.97, 0.97, 1.0)
_OBSTACLE: Colour = (0.88, 0.80, 0.66, 0.6)
_BODY: Colour = (0.34, 0.34, 0.38, 1.0)
_LEG: Colour = (0.53, 0.55, 0.60, 1.0)


def colours(model: mujoco.MjModel, sides: tuple[Colour, Colour]) -> NDArray[np.float32]:
    """Colour of each geom, red, green, blue and opacity, 0 to 1, shape (ngeom, 4).

    Args:
        model: The compiled model; geoms that it paints itself keep their colours.
        sides: Colours of the left and the right antenna.
    """
    found = model.geom_rgba.copy()
    bare = (found == _UNPAINTED).all(axis=1) & (model.geom_matid < 0)
    kind = model.geom_contype
    for bit, colour in (
        (layers.FLOOR, FLOOR),
        (layers.OBSTACLE, _OBSTACLE),
        (layers.BODY, _BODY),
        (layers.LEG, _LEG),
        (layers.ANTENNA, sides[0]),
    ):
        found[bare & (kind == bit)] = colour
    right = [ANTENNA_PREFIXES[1] in model.geom(i).name for i in range(model.ngeom)]
    found[bare & (kind == layers.ANTENNA) & np.array(right)] = sides[1]
    return found
