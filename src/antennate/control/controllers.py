"""The rooms composed: a frame goes in, a command comes out.

Three controllers share the path from counts to contact and the gait, and differ in one decision:

- `open` walks FORWARD whatever it feels;
- `paper` follows the published table with its hold;
- `closed` walks FORWARD until its readings repeat, then escapes.

All work on a batch of B robots at once, row by row independent.
"""

from __future__ import annotations

from typing import Literal, Protocol, get_args

import numpy as np

from antennate.control.conditioning import RunningMean, bending_level, deflection
from antennate.control.contact import ContactState
from antennate.control.escape import Escape
from antennate.control.gait import Gait
from antennate.control.maneuver import Hold, decide
from antennate.control.repetition import RepetitionDetector
from antennate.errors import ConfigError
from antennate.params import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Bools, Contact, Floats, Ints, JointCommand, Maneuver

Arm = Literal["open", "paper", "closed"]
ARMS: tuple[Arm, ...] = get_args(Arm)


class _Rule(Protocol):
    """One way to decide."""

    turn_offset: float

    def reset(self, rows: Ints | Bools) -> None: ...

    def step(self, t: Floats, b: Floats, contact: Ints, bend: Floats) -> Ints: ...


class _OpenRule:
    """FORWARD, unless a sensor cannot be trusted."""

    def __init__(self, params: ControlParams) -> None:
        self.turn_offset = params.gait.turn_offset

    def reset(self, rows: Ints | Bools) -> None:
        pass

    def step(self, t: Floats, b: Floats, contact: Ints, bend: Floats) -> Ints:
        unknown = (contact == Contact.UNKNOWN).any(axis=1)
        return np.where(unknown, int(Maneuver.HOLD), int(Maneuver.FORWARD))


class _PaperRule:
    """The published table, each maneuver held for T_hold."""

    def __init__(self, params: ControlParams, batch: int) -> None:
        self.turn_offset = params.gait.turn_offset
        self._params = params.rule
        self._hold = Hold(batch)

    def reset(self, rows: Ints | Bools) -> None:
        self._hold.reset(rows)

    def step(self, t: Floats, b: Floats, contact: Ints, bend: Floats) -> Ints:
        wanted = decide(self._params, contact, b)
        return self._hold.step(t, wanted, self._params.hold_time)


class _ClosedRule:
    """FORWARD until readings repeat, then escape."""

    def __init__(self, params: ControlParams, batch: int) -> None:
        self.turn_offset = params.escape.turn_offset
        self._params = params
        self._detector = RepetitionDetector(
            params.repetition, batch, params.period, params.gait.frequency
        )
        self._escape = Escape(params.escape, batch, params.period)

    def reset(self, rows: Ints | Bools) -> None:
        self._detector.reset(rows)
        self._escape.reset(rows)

    def step(self, t: Floats, b: Floats, contact: Ints, bend: Floats) -> Ints:
        walking = (self._escape.maneuver == int(Maneuver.FORWARD)) & ~np.isnan(b).any(axis=1)
        stuck = self._detector.step(bend, walking)
        if self._params.escape.trigger == "contact":
            stuck = decide(self._params.rule, contact, b) == Maneuver.REVERSE
        pressed: Bools = np.any(bend > self._params.repetition.pressure, axis=1)
        return self._escape.step(t, b, stuck, pressed)


class Controller:
    """The control of B robots.

    Args:
        params: All its numbers.
        arm: Which decision it takes.
        batch: Number of robots B.

    Attributes:
        b: Bending levels of the last tick, shape (B, 2).
        contact: `Contact` of the last tick, shape (B, 2).
        maneuver: `Maneuver` of the last tick, shape (B,).

    Raises:
        ConfigError: The arm does not exist.
    """

    def __init__(self, params: ControlParams, arm: Arm = "closed", batch: int = 1) -> None:
        if arm not in ARMS:
            raise ConfigError(f"arm must be one of {', '.join(ARMS)}, got {arm!r}")
        self._params = params
        self._mean = RunningMean(params.conditioning, batch, params.period)
        self._contact = ContactState(params.rule, batch)
        self._rule: _Rule
        if arm == "open":
            self._rule = _OpenRule(params)
        elif arm == "paper":
            self._rule = _PaperRule(params, batch)
        else:
            self._rule = _ClosedRule(params, batch)
        self.gait = Gait(params.gait, RobotSpec(), batch, params.period)
        self.b: Floats = np.zeros((batch, 2))
        self.contact: Ints = np.full((batch, 2), int(Contact.FREE))
        self.maneuver: Ints = np.full(batch, int(Maneuver.FORWARD))

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Forget everything about some rows and start their gait at `phase` [rad]."""
        self._mean.reset(rows)
        self._contact.reset(rows)
        self._rule.reset(rows)
        self.gait.reset(rows, phase)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One tick: the command for this frame, both with B rows."""
        counts = self._mean.step(frame.counts)
        self.b = bending_level(self._params.conditioning, counts)
        self.contact = self._contact.step(self.b)
        bend = deflection(self._params.conditioning, counts)
        self.maneuver = self._rule.step(frame.t, self.b, self.contact, bend)
        return self.gait.step(self.maneuver, self._rule.turn_offset)
