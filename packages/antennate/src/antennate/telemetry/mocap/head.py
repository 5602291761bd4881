"""The pose of the head in the plane, from two markers or a body; what was wrong is counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from antennate.errors import BadInputError
from antennate.messages import nearest, shortened
from antennate.telemetry.mocap.clock import SPAN
from antennate.telemetry.mocap.tables import Columns
from antennate.types import Floats

Complexes = NDArray[np.complex128]
"""Places in the plane, x + iy [m]."""
_STRAY = 0.1
"""Change of the distance of the markers, over it, that is no noise."""
_MOST_TURN = 7.0
"""Larger headings are no radians [rad]."""


@dataclass(frozen=True)
class Head:
    """The head over a table.

    Attributes:
        places: Where it is, x + iy [m], NaN in gaps, shape (n,).
        headings: Unwrapped headings [rad], NaN in gaps, shape (n,).
        up: Axis of the table that points up; empty in a plane.
        exchanged: Rows whose markers were exchanged; they were put back.
        strays: Rows that were left out, as a marker was elsewhere.
    """

    places: Complexes
    headings: Floats
    up: str
    exchanged: int = 0
    strays: int = 0


def head_of(
    path: Path,
    t: Floats,
    columns: Columns,
    markers: Sequence[str],
    given: str | None,
    mirrored: bool,
) -> Head:
    """The head of a table; arguments as for `poses_of`."""
    names = _names(path, columns, markers)
    solid = all((name, "z") in columns for name in names)
    up = _up(path, columns, names, given) if solid else ""
    first, second = {"x": "yz", "y": "zx"}.get(up, "xy")
    z = np.array([columns[name, first] + 1j * columns[name, second] for name in names])
    z = z.conj() if mirrored else z
    exchanged = strays = 0
    places, ahead = z.mean(axis=0), z[-1] - z[0]
    if len(names) == 1:
        headings = _heading(path, columns, names[0], up) * (-1 if mirrored else 1)
    else:
        stray = abs(abs(ahead) / np.nanmedian(abs(ahead)) - 1) > _STRAY
        strays, headings = int(stray.sum()), np.angle(ahead)
        places[stray], headings[stray] = complex(np.nan, np.nan), np.nan
        exchanged = _turn_back(t, headings)
    known = np.isfinite(headings)
    if known.sum() < 2:
        raise BadInputError(f"{path}: expected rows with {', '.join(names)}, found none")
    headings[known] = np.unwrap(headings[known])
    return Head(places, headings, up, exchanged, strays)


def _names(path: Path, columns: Columns, markers: Sequence[str]) -> Sequence[str]:
    """The markers of the head, or its body."""
    known = [name for name, word in columns if word == "x"]
    bodies = [name for name in known if {(name, "qw"), (name, "heading")} & columns.keys()]
    plain = [name for name in known if name.rpartition(":")[2].lower().startswith("head")]
    names = markers or (bodies if len(bodies) == 1 else plain)
    for name in names:
        if name not in known:
            raise BadInputError(
                f"{path}: expected a marker {name}{nearest(name, known)}, found "
                f"{shortened(', '.join(known))}"
            )
    if len(names) != (1 if names and names[0] in bodies else 2):
        raise BadInputError(
            f"{path}: expected by --markers two markers of the head, rear and front, or one body, "
            f"found {', '.join(names) or 'none'} of {shortened(', '.join(known))}"
        )
    return names


def _up(path: Path, columns: Columns, names: Sequence[str], given: str | None) -> str:
    """The axis that points up: the one along which the head hardly moves."""
    ends = {axis: np.nanpercentile(columns[names[0], axis], (5, 95)) for axis in "xyz"}
    moved = {axis: float(np.ptp(pair)) for axis, pair in ends.items()}
    up = given or min(moved, key=moved.__getitem__)
    if sorted(moved.values())[1] < 2 * moved[up]:
        found = ", ".join(f"{1e3 * length:.0f} mm along {axis}" for axis, length in moved.items())
        raise BadInputError(
            f"{path}: expected a head that hardly moves along --up {given or ''}, found {found}"
        )
    return up


def _heading(path: Path, columns: Columns, name: str, up: str) -> Floats:
    """Heading of a body [rad], by its quaternions the turn about the axis that points up."""
    if (name, "qw") in columns:
        return 2.0 * np.arctan2(columns[name, f"q{up or 'z'}"], columns[name, "qw"])
    heading = columns[name, "heading"]
    if np.nanmax(abs(heading)) > _MOST_TURN:
        raise BadInputError(
            f"{path}: expected a heading in radians, found {np.nanmax(abs(heading)):.0f}; call its "
            "column heading_deg or heading_rad"
        )
    return heading


def _turn_back(t: Floats, headings: Floats) -> int:
    """Turn headings back that exchanged markers have turned about: how many."""
    known = np.flatnonzero(np.isfinite(headings))
    step = abs((np.diff(headings[known]) + np.pi) % (2 * np.pi) - np.pi)
    about = (step > np.pi / 2) & (np.diff(t[known]) < SPAN)
    turned = np.cumsum(np.concatenate([[False], about])) % 2 == 1
    turned = ~turned if turned.mean() > 0.5 else turned
    headings[known[turned]] += np.pi
    return int(turned.sum())
