"""Mass and inertia of each link and leg of a robot, as they are built, in place of plain shapes."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from antennate.params.base import Params, number

_LEAST = 1e-9
"""Least moment of inertia about an axis [kg·m²]."""

_Place = Annotated[float, Field(ge=-10, le=10)]


class BodyParams(Params):
    """Mass and inertia of a link or a leg. Its frame has x forward, y left and z up.

    That of a link lies in its middle at the height of the axles, that of a leg on its axle. Legs
    point as they do at 0.
    """

    name: str = number("", "1", "assumed: has to be named")
    """Name of the link or leg, such as link0 or leg_l0."""
    mass: float = number(0.1, "kg", "assumed: has to be given", gt=0)
    """Its mass."""
    centre: tuple[_Place, _Place, _Place] = number((0.0, 0.0, 0.0), "m", "assumed: has to be given")
    """Its centre of mass."""
    inertia: tuple[float, float, float, float, float, float] = number(
        (1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0), "kg·m²", "assumed: has to be given"
    )
    """Its inertia about that centre: xx, yy, zz, xy, xz, yz."""
    source: str = number("", "1", "assumed: not known")
    """What it is made of."""

    @model_validator(mode="after")
    def _is_a_body(self) -> BodyParams:
        xx, yy, zz, xy, xz, yz = self.inertia
        low, middle, high = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if low < _LEAST or low + middle < high * (1.0 - 1e-6):
            raise ValueError(
                f"inertia: expected moments of a body, each at most the sum of the others, found "
                f"{low:.3g}, {middle:.3g} and {high:.3g} kg·m² about its axes"
            )
        return self
