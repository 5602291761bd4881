"""Which servo of a layout is of which model, and in which operating mode it has to be."""

from __future__ import annotations

from antennate.hardware.dynamixel.tables import EXTENDED_MODE, XC430_W240, XL330_M288
from antennate.robots.anatomy import LEGS, YAW_COUNT
from antennate.robots.layout import LayoutParams

POSITION_MODE = 3
"""Operating mode: position within one turn."""


def legs(layout: LayoutParams) -> tuple[int, ...]:
    """Ids of the servos that turn without end."""
    return layout.ids[YAW_COUNT : YAW_COUNT + len(LEGS)]


def models(layout: LayoutParams) -> dict[int, int]:
    """Model number by id."""
    found = dict.fromkeys(layout.ids, XC430_W240.model)
    return found | dict.fromkeys(layout.antennae.ids, XL330_M288.model)


def modes(layout: LayoutParams) -> dict[int, int]:
    """Operating mode by id."""
    found = dict.fromkeys(layout.ids, POSITION_MODE)
    return found | dict.fromkeys(legs(layout), EXTENDED_MODE)
