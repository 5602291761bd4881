"""The time series of one trial: what was read, decided and commanded at each control tick.

`columns` and `to_dataframe` make a table for other programs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from antennate.errors import BadInputError
from antennate.messages import shortened
from antennate.notebook import html
from antennate.telemetry.topics import MOTION
from antennate.types import AntennaFrame, Contact, Floats, Ints, JointCommand, Maneuver

_ENDS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(
        ("counts", "level", "contact", "leg", "antenna", "elevation"), ("left", "right")
    ),
    "head": ("x", "y"),
    **dict.fromkeys(MOTION, ("x", "y", "z")),
}
"""What the columns of the last axis are called; those of others are numbered, head first."""
_SHOWN_COLUMNS = (
    *("ticks [%]", "level left", "level right", "contact left [%]", "contact right [%]"),
)


@dataclass(frozen=True, slots=True, repr=False)
class TimeSeries:
    """One robot over n control ticks.

    Attributes:
        t: Time of the frame [s], shape (n,).
        counts: Readings of the antennae, left before right [counts], shape (n, 2); NaN is missing.
        level: Flex levels as the controller saw them, 0 to 1, shape (n, 2).
        contact: `Contact` of each antenna, shape (n, 2).
        maneuver: `Maneuver`, shape (n,).
        yaw: Commanded yaw angles, head first [rad], shape (n, Y).
        leg: Commanded leg angles [rad], shape (n, L, 2), left before right.
        antenna: Commanded angles of the antenna bases [rad], shape (n, 2), or (n, 0) without.
        pitch: Commanded pitch angles [rad], shape (n, P); P is 0 unless pitch is actuated.
        elevation: Commanded elevations of the antennae [rad], shape (n, 2), (n, 0) without them.
        head: Position of the head in the world [m], shape (n, 2).
        angular_velocity: Of the head, by its inertial sensor, along x forward, y left, z up
            [rad/s], shape (n, 3), or (n, 0) without one.
        linear_acceleration: Specific force, likewise [m/s²].
        meta: What the series is of, such as controller, robot and seed.
    """

    t: Floats
    counts: Floats
    level: Floats
    contact: Ints
    maneuver: Ints
    yaw: Floats
    leg: Floats
    antenna: Floats
    pitch: Floats
    elevation: Floats
    head: Floats
    angular_velocity: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    linear_acceleration: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    meta: Mapping[str, str | int | float | None] = field(default_factory=dict)

    def __len__(self) -> int:
        """Number of ticks."""
        return len(self.t)

    def __repr__(self) -> str:
        """The series in one line."""
        return f"<{self._sentence}>"

    def _repr_html_(self) -> str:
        """A sentence, a table and a figure, for a notebook."""
        from antennate.telemetry.figure import of_arrays  # slow to import

        theta = self.meta.get("threshold")
        theta = theta if isinstance(theta, float) else np.nan
        signals = (self.t, self.counts, self.level, self.contact, self.maneuver)
        figure = of_arrays(*signals, theta) if len(self) else None
        return html(self._sentence, _SHOWN_COLUMNS, self._by_maneuver(), figure)

    @property
    def _sentence(self) -> str:
        facts = ", ".join(
            f"{name} {shortened(str(value))}"
            for name, value in self.meta.items()
            if value is not None
        )
        span = self.t[-1] - self.t[0] if len(self) else 0.0
        return f"TimeSeries of {len(self)} ticks, {span:.2f} s{facts and f': {facts}'}"

    def _by_maneuver(self) -> Iterator[tuple[str, list[str]]]:
        """Rows of each maneuver, and of all: share of the ticks, mean levels, shares of contact."""
        parts = {m.name: self.maneuver == m for m in Maneuver} | {
            "all": self.maneuver == self.maneuver
        }
        for name, ticks in parts.items():
            if not ticks.any():
                continue
            sides = (self.level[ticks, side] for side in (0, 1))
            levels = [float(np.nanmean(b)) if np.isfinite(b).any() else np.nan for b in sides]
            touched = 100.0 * (self.contact[ticks] == Contact.CONTACT).mean(axis=0)
            cells = [f"{100.0 * ticks.mean():.1f}", *(f"{level:.2f}" for level in levels)]
            yield name, [*cells, *(f"{share:.1f}" for share in touched)]

    def columns(self) -> dict[str, Floats | Ints]:
        """Every number of a tick as a column of shape (n,).

        The names are `t`, `counts_left`, `counts_right`, …, `head_x`, `head_y`; joints along the
        body are numbered, head first: `yaw_0`, `leg_5_right`.
        """
        columns: dict[str, Floats | Ints] = {}
        for name in _NAMES:
            values = getattr(self, name)
            for index in np.ndindex(values.shape[1:]):
                words = [name, *map(str, index)]
                if index and index[-1] < len(_ENDS.get(name, ())):
                    words[-1] = _ENDS[name][index[-1]]
                columns["_".join(words)] = values[(slice(None), *index)]
        return columns

    def to_dataframe(self) -> Any:
        """A pandas DataFrame with one row for each tick and the columns of `columns`."""
        from pandas import DataFrame  # slow to import

        return DataFrame(self.columns())


_NAMES = tuple(each.name for each in fields(TimeSeries) if each.name != "meta")


class TimeSeriesRecorder:
    """Collects the ticks of one robot.

    Args:
        controller: What decides: its `level`, `contact` and `maneuver` are read after each step.
        head: Gives the position of the robot's head [m], shape (2,).
    """

    def __init__(self, controller: Any, head: Callable[[], Floats]) -> None:
        self._controller, self._head = controller, head
        self._ticks: dict[str, list[Any]] = {name: [] for name in _NAMES}

    def take(self, frame: AntennaFrame, command: JointCommand) -> None:
        """Keep one tick."""
        for source, names in (
            (frame, ("t", "counts", *MOTION)),
            (self._controller, ("level", "contact", "maneuver")),
            (command, ("yaw", "leg", "antenna", "pitch", "elevation")),
        ):
            for name in names:
                batch = getattr(source, name)
                values = batch[0] if batch.size else ()  # there may be no pitch joints, no sensor
                self._ticks[name].append(np.array(values))
        self._ticks["head"].append(np.array(self._head()))

    def series(self, meta: Mapping[str, str | int | float | None]) -> TimeSeries:
        """What was collected."""
        if not self._ticks["t"]:
            raise BadInputError("time series: expected at least one tick, found none")
        arrays: dict[str, Any] = {name: np.array(values) for name, values in self._ticks.items()}
        return TimeSeries(**arrays, meta=dict(meta))
