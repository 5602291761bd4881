"""Colours and names that figures, films and the live view share."""

from __future__ import annotations

from antennate.types import Maneuver

MANEUVER_COLOURS = {
    Maneuver.FORWARD: "#0072B2",
    Maneuver.TURN_L: "#009E73",
    Maneuver.TURN_R: "#E69F00",
    Maneuver.REVERSE: "#D55E00",
    Maneuver.HOLD: "#000000",
}
"""After Okabe and Ito: apart for every kind of colour vision."""

MANEUVER_NAMES = {
    Maneuver.FORWARD: "forward",
    Maneuver.TURN_L: "turn left",
    Maneuver.TURN_R: "turn right",
    Maneuver.REVERSE: "reverse",
    Maneuver.HOLD: "hold",
}


def called(maneuver: int) -> str:
    """A maneuver in words; a number that is none of ours, as a controller may say, stays one."""
    return MANEUVER_NAMES[Maneuver(maneuver)] if maneuver in set(Maneuver) else str(maneuver)


SERIES = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9", "#332288")
"""For whatever has no colour of its own; after Okabe and Ito."""


def rgba(colour: str) -> tuple[float, float, float, float]:
    """Red, green, blue and opacity of `#RRGGBB`, 0 to 1."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue, 1.0
