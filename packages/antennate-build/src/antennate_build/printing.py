"""How parts are printed: material, walls and fits."""

from __future__ import annotations

from typing import Literal

from antennate.params.base import Params, number

DENSITIES = {"pla": 1.24e-3, "petg": 1.27e-3, "pa12": 1.01e-3}
"""Of printed parts without hollows [g/mm³]: makers' data sheets."""


class PrintParams(Params):
    """How parts are printed."""

    material: Literal["pla", "petg", "pa12"] = number(
        "pla", "1", "assumed: stiff, and every printer takes it"
    )
    """Material; pa12 is sintered nylon."""
    wall_mm: float = number(1.2, "mm", "assumed: three lines of a nozzle of 0.4 mm", ge=0.8, le=4)
    """Thinnest wall."""
    play_mm: float = number(
        0.15, "mm", "assumed: what printers of plastic wire hold", ge=0.05, le=0.5
    )
    """Gap between parts that move."""

    @property
    def density(self) -> float:
        """Density of the material [g/mm³]."""
        return DENSITIES[self.material]
