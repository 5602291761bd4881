"""What a controller is given in place of its own readings, to see whether it lives by them.

- `own`: what its robot reads;
- `none`: two sound antennae that touch nothing;
- `swapped`: left and right exchanged, as two wires in the wrong plugs;
- `delayed:S`: what was read S seconds ago, and until then the first reading;
- `yoked`: what another robot read in the next trial of the same scene, under the same controller
  with its own readings, tick by tick from its first, and from the first again when they end. It has
  all that readings have, except that they belong to where the robot is.

A controller with such readings is a condition of its own, called `closed@yoked`; one with its own
keeps its name.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from antennate.control.loop import Stepper
from antennate.errors import ConfigError
from antennate.messages import nearest, shown
from antennate.params.control import ControlParams, CurveParams
from antennate.types import AntennaFrame, Bools, Floats, Ints, JointCommand

OWN, NONE, SWAPPED, DELAYED, YOKED = "own", "none", "swapped", "delayed", "yoked"
KINDS = (OWN, NONE, SWAPPED, f"{DELAYED}:S", YOKED)
LONGEST_DELAY = 100.0
"""Longest delay [s]: what was read in so long is kept in memory."""
_LONGEST_LABEL = 21
"""Letters of a label: a figure has room for these on a phone."""
ABOUT: Mapping[str, str] = {
    NONE: "given two antennae that touch nothing",
    SWAPPED: "given left and right exchanged",
    DELAYED: "given what was read so many seconds ago",
    YOKED: "given what the robot of the next trial read under the same controller",
}
"""What each gives, for who meets it for the first time."""


def check_readings(text: str) -> str:
    """The readings of a name, a delay written in one way."""
    kind, mark, rest = text.partition(":")
    if kind == DELAYED:
        return f"{DELAYED}:{_delay(text, rest):g}"
    if kind not in KINDS or mark:
        raise ConfigError(
            f"expected one of {', '.join(KINDS)}, found {shown(text)}{nearest(text, KINDS)}"
        )
    return kind


def _delay(text: str, seconds: str) -> float:
    """The delay of `delayed:S` [s]."""
    try:
        delay = float(seconds)
    except ValueError:
        delay = math.nan
    if not 0.0 < delay <= LONGEST_DELAY:
        raise ConfigError(
            f"expected {DELAYED}:S with seconds above 0 and at most {LONGEST_DELAY:g}, as "
            f"{DELAYED}:0.5, found {shown(text)}"
        )
    return delay


def require_whole_delay(name: str, period: float) -> None:
    """Check that a delay, if these readings have one, is of whole control periods [s]."""
    kind, _, seconds = name.partition(":")
    if kind == DELAYED:
        ticks = _delay(name, seconds) / period
        if round(ticks) < 1 or abs(ticks - round(ticks)) > 1e-6:
            raise ConfigError(
                f"readings: expected {DELAYED}:S of whole control periods of {period:g} s, found "
                f"{shown(name)}"
            )


def condition(controller: str, readings: str) -> str:
    """The name of a controller that is given these readings."""
    return controller if readings == OWN else f"{controller}@{readings}"


def parts_of(name: str) -> tuple[str, str]:
    """The controller and the readings of a condition's name.

    A path of a file may hold an @ too: only what follows the last one can be readings.
    """
    controller, mark, readings = name.rpartition("@")
    if mark and controller and readings.partition(":")[0] in ABOUT:
        return controller, readings
    return name, OWN


def short_names(conditions: Iterable[str]) -> dict[str, str]:
    """A label for each condition: of MODULE:NAME or FOLDER/FILE.py:NAME only NAME, or FILE.onnx.

    A file called policy.onnx is known by its folder.

    Where two share it, FILE.py:NAME, then with the folder, and all of it where they share that,
    too. Of a long one the middle is left out. Readings that are not its own, as of
    `closed@delayed:0.5`, stay behind it.
    """
    parts = {name: parts_of(name) for name in conditions}
    paths = {name: each.split("/") for name, (each, _) in parts.items()}
    cuts = [
        {
            name: path[-2]
            if path[1:] and path[-1] == "policy.onnx"
            else path[-1].rpartition(":")[2]
            for name, path in paths.items()
        },
        {name: path[-1] for name, path in paths.items()},
        {name: "/".join(path[-2:]) for name, path in paths.items()},
    ]
    labels = [
        {name: condition(_clipped(cut), parts[name][1]) for name, cut in each.items()}
        for each in cuts
    ]
    return {
        name: next((e[name] for e in labels if list(e.values()).count(e[name]) == 1), name)
        for name in parts
    }


def _clipped(label: str) -> str:
    half = (_LONGEST_LABEL - 1) // 2
    return label if len(label) <= _LONGEST_LABEL else f"{label[:half]}…{label[-half:]}"


def about_readings(names: Iterable[str]) -> list[str]:
    """What the readings of these conditions are, a line for each kind."""
    kinds = dict.fromkeys(parts_of(name)[1].partition(":")[0] for name in names)
    return [f"@{kind}: {ABOUT[kind]}" for kind in kinds if kind in ABOUT]


class Readings(Protocol):
    """Changes the readings of B robots; the rows never influence one another."""

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows anew."""
        ...

    def change(self, frame: AntennaFrame) -> AntennaFrame:
        """What the controller is given for this frame, one a control period; its time stays."""
        ...


class Own:
    """The readings as they are."""

    def reset(self, rows: Ints | Bools) -> None:
        """Nothing to forget."""

    def change(self, frame: AntennaFrame) -> AntennaFrame:
        """The frame as it is."""
        return frame


class Untouched(Own):
    """Two antennae that are straight, by the curves of the control, and without noise."""

    def __init__(self, control: ControlParams) -> None:
        right = control.conditioning_right or control.conditioning
        self._straight = np.array([_straight(control.conditioning), _straight(right)])

    def change(self, frame: AntennaFrame) -> AntennaFrame:
        """Straight counts, whatever was read."""
        return replace(frame, counts=np.broadcast_to(self._straight, frame.counts.shape).copy())


def _straight(curve: CurveParams) -> float:
    """Reading of a straight antenna [counts]."""
    return curve.counts_low if curve.polarity > 0 else curve.counts_high


class Swapped(Own):
    """Left and right exchanged."""

    def change(self, frame: AntennaFrame) -> AntennaFrame:
        """Right before left."""
        return replace(frame, counts=np.ascontiguousarray(frame.counts[:, ::-1]))


class Delayed:
    """What was read some ticks ago; until then the first reading."""

    def __init__(self, delay: float, batch: int, period: float) -> None:
        self._past: Floats = np.zeros((round(delay / period), batch, 2))
        self._next = 0
        self._fresh: Bools = np.ones(batch, dtype=bool)

    def reset(self, rows: Ints | Bools) -> None:
        """Forget what rows have read."""
        self._fresh[rows] = True

    def change(self, frame: AntennaFrame) -> AntennaFrame:
        """The frame with the counts of that many ticks ago."""
        if self._fresh.any():
            self._past[:, self._fresh] = frame.counts[self._fresh]
            self._fresh[:] = False
        counts = self._past[self._next].copy()
        self._past[self._next] = frame.counts
        self._next = (self._next + 1) % len(self._past)
        return replace(frame, counts=counts)


class Yoked:
    """Recorded counts in place of the robot's, tick by tick, repeated when they end.

    Args:
        donors: Counts for each row, (ticks, 2), at least a tick; `give` sets them.
    """

    def __init__(self, donors: Sequence[Floats]) -> None:
        self._donors = list(donors)
        self._tick: Ints = np.zeros(len(donors), dtype=np.int64)

    def give(self, row: int, counts: Floats) -> None:
        """A row is given these counts from its next reset on, shape (ticks, 2)."""
        self._donors[row] = counts

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows with the first of their recorded counts."""
        self._tick[rows] = 0

    def change(self, frame: AntennaFrame) -> AntennaFrame:
        """The frame with the recorded counts of this tick."""
        ticks = zip(self._donors, self._tick.tolist(), strict=True)
        counts = np.array([donor[tick % len(donor)] for donor, tick in ticks])
        self._tick += 1
        return replace(frame, counts=counts)


def make_readings(
    name: str, control: ControlParams, batch: int = 1, donors: Sequence[Floats] = ()
) -> Readings:
    """What changes the readings of a batch, by a name that `check_readings` knows.

    Args:
        name: What is given, as `delayed:0.5`.
        control: Numbers of the control: its curves and its period.
        batch: Number of robots B.
        donors: For `yoked` the recorded counts for each row, (ticks, 2).

    Raises:
        ConfigError: There are no readings of that name, of `yoked` no recorded counts, or a delay
            is of no whole periods.
    """
    kind = check_readings(name)
    if kind == NONE:
        return Untouched(control)
    if kind == SWAPPED:
        return Swapped()
    if kind.startswith(DELAYED):
        require_whole_delay(kind, control.period)
        return Delayed(float(kind.partition(":")[2]), batch, control.period)
    if kind == YOKED:
        if len(donors) != batch or not all(len(counts) for counts in donors):
            raise ConfigError(f"expected recorded counts for {YOKED}, found none")
        return Yoked(donors)
    return Own()


class Given:
    """A controller that is given changed readings; it stands between the robot and the controller.

    Args:
        controller: Decides.
        readings: Change what it is given.

    Attributes:
        frame: What it was given last, None before.
    """

    def __init__(self, controller: Stepper, readings: Readings) -> None:
        self._controller, self._readings = controller, readings
        self.frame: AntennaFrame | None = None

    def step(self, frame: AntennaFrame) -> JointCommand:
        """The command for what is given in place of this frame."""
        self.frame = self._readings.change(frame)
        return self._controller.step(self.frame)
