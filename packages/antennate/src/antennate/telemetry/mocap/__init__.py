"""Motion capture, or a camera, beside a log: where the head was, in the time of the log."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from antennate.errors import BadInputError
from antennate.telemetry.mocap.clock import Clock, align, with_gaps
from antennate.telemetry.mocap.head import Complexes, Head, head_of
from antennate.telemetry.mocap.recorded import ERRORS, WEAKEST, Recorded, recorded
from antennate.telemetry.mocap.tables import read
from antennate.types import Floats

_SLOWEST, _FASTEST = 1e-3, 3.0
"""Speeds between which a robot walks [robot lengths a second]."""
_MIRRORED = 0.3
"""Share of a path by which it goes rather along mirrored headings."""
_FEWEST = 20
"""True places that make a comparison."""
_MOST_DRIFT, _MOST_SCALE, _LEAST_KNOWN = 200e-6, 0.02, 0.95
"""Drift of a clock, error of scale and share of rows with a pose that are named: quartz drifts by
less than 100 ppm."""


@dataclass(frozen=True)
class Beside:
    """The true path of a simulation, moved rigidly onto the measured one.

    Attributes:
        places: The true path in the frame of the table, x + iy [m], shape (m,).
        path_error: Root mean square distance of the measured path from it [m].
        heading_error: Root mean square error of the heading [rad].
        scale: Size of the measured path over that of the true one.
    """

    places: Complexes
    path_error: float
    heading_error: float
    scale: float


@dataclass(frozen=True)
class Poses:
    """The head by motion capture, in the time of the log; NaN in gaps.

    Attributes:
        t: Times [s], shape (n,).
        x, y: Place in the frame of the table [m], shape (n,).
        heading: Unwrapped heading [rad], shape (n,).
        clock: The clock of the table.
        head: What was read of the table.
        log: What the log says of the head.
    """

    t: Floats
    x: Floats
    y: Floats
    heading: Floats
    clock: Clock
    head: Head
    log: Recorded

    def at(self, t: Floats) -> Floats:
        """Pose x, y [m] and heading [rad] at times of the log [s], NaN in gaps, shape (n, 3)."""
        each = (self.x, self.y, self.heading)
        return np.stack([np.interp(t, self.t, values, np.nan, np.nan) for values in each], axis=1)

    def beside(self) -> Beside | None:
        """The true path of a simulation beside the measured one, None without one.

        The point that markers show may lie anywhere on the head: z = a p + b + s exp(i heading).
        """
        t, x, y, heading = self.log.truth.T
        measured = self.at(t)
        sound = np.isfinite(measured).all(axis=1)
        if sound.sum() < _FEWEST:
            return None
        z, p, way = measured[:, 0] + 1j * measured[:, 1], x + 1j * y, np.exp(1j * heading)
        columns = np.stack([p, np.ones(len(p)), way], axis=1)
        scale = abs(np.linalg.lstsq(columns[sound], z[sound])[0][0])
        turned = np.exp(1j * measured[sound, 2]) / way[sound]
        turn = turned.mean() / abs(turned.mean())
        rest = np.linalg.lstsq(columns[sound, 1:], (z - turn * p)[sound])[0]
        places = turn * p + columns[:, 1:] @ rest
        error = np.sqrt(np.mean(abs(z - places)[sound] ** 2))
        heading_error = np.sqrt(np.mean(np.angle(turned / turn) ** 2))
        return Beside(places, float(error), float(heading_error), float(scale))

    def sentence(self) -> str:
        """How well the clocks are aligned, and how far the path is from the true one."""
        clock, true = self.clock, self.beside()
        text = (
            f"By the {self.log.source}, the clock of the log is {clock.at - clock.centre:.4f} s "
            f"ahead, ± {1e3 * clock.at_error:.1f} ms, and drifts by {1e6 * clock.drift:.0f} ± "
            f"{1e6 * clock.drift_error:.0f} ppm (95 %); yaw rates correlate by "
            f"{clock.correlation:.3f}."
        )
        if true is not None:
            text += (
                f" The path is {1e3 * true.path_error:.1f} mm off the true one, the heading "
                f"{math.degrees(true.heading_error):.2f}° (RMS)."
            )
        return text

    def warnings(self) -> list[str]:
        """What is unusual about the table."""
        clock, head, true = self.clock, self.head, self.beside()
        known, scale = np.isfinite(head.headings).mean(), 1.0 if true is None else true.scale
        found = {
            f"its clock drifts by {100 * clock.drift:.2f} %; times are corrected": (
                abs(clock.drift) > _MOST_DRIFT + clock.drift_error
            ),
            f"{head.up} points up, not z": head.up in ("x", "y"),
            f"markers were exchanged in {head.exchanged} rows, and put back": head.exchanged > 0,
            f"a marker was elsewhere in {head.strays} rows, left out": head.strays > 0,
            f"{100 * (1 - known):.0f} % of its rows have no pose": known < _LEAST_KNOWN,
            f"its path is {scale:.3f} times the true one": abs(scale - 1) > _MOST_SCALE,
        }
        return [text for text, holds in found.items() if holds]


def poses_of(
    log: Path,
    table: Path,
    markers: tuple[str, ...] = (),
    unit: float | None = None,
    up: Literal["x", "y", "z"] | None = None,
    mirrored: bool = False,
) -> Poses:
    """The poses of a table in the time of a log.

    Args:
        log: The log of a drive or a simulation.
        table: The table: CSV of poses or markers, of OptiTrack Motive or Vicon Nexus, or TRC.
        markers: The marker at the rear of the head and that in front of it, or one body; by
            default those whose names begin with head.
        unit: Length of the table's unit [m]; by default as it says, else 1.
        up: Its axis that points up; by default the one along which the head hardly moves.
        mirrored: Whether it is left-handed, as with y down or with x and y exchanged.

    Raises:
        BadInputError: The table cannot be read, is in another unit, or not of this log.
        LogError: The log cannot be read.
    """
    said = recorded(log)
    t, columns = read(table, unit)
    head = head_of(table, t, columns, markers, up, mirrored)
    t, x, y, headings = with_gaps(t, head.places.real, head.places.imag, head.headings)
    _require_walk(table, t, x + 1j * y, headings, said.reader.header.robot.length)
    clock = align(table, (t, headings), (said.t, said.turned), WEAKEST[said.source])
    clock = replace(clock, at_error=math.hypot(clock.at_error, ERRORS[said.source]))
    return Poses(clock.in_log(t), x, y, headings, clock, head, said)


def _require_walk(path: Path, t: Floats, places: Complexes, headings: Floats, size: float) -> None:
    """Refuse a path that no robot of this size [m] can have walked, or that is mirrored."""
    grid = np.arange(t[0], t[-1], 1.0)
    steps = np.diff(np.interp(grid, t, places))
    ways = np.exp(2j * np.interp(grid[1:] - 0.5, t, headings))
    known = np.isfinite(steps) & np.isfinite(ways)
    steps, ways = steps[known], ways[known]
    speed = float(np.median(np.sort(abs(steps))[-10:]))
    if not _SLOWEST * size < speed < _FASTEST * size:
        raise BadInputError(
            f"{path}: expected metres, found a robot of {size:.2g} m that walks {speed:.2g} m/s: "
            "say by --unit how long the unit is"
        )
    along, across = (abs((steps**2 * way).sum()) for way in (ways.conj(), ways))
    if across - along > _MIRRORED * (abs(steps) ** 2).sum():
        raise BadInputError(
            f"{path}: expected a path along its headings, found one that turns against them: are "
            "its columns x and y exchanged?"
        )
