"""Controllers that leave the plane: `climb`, and what it has to beat.

- `climb` feels steps and drops with lowered antennae and climbs steps;
- `lifted` always holds its head up, and feels nothing;
- `rhythm` climbs by the clock, and feels nothing;
- `edges` climbs at edges that a simulation tells it: what knowing them is worth.

All of them walk by the same gait and raise the body by the same line.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from antennate.control.climbing.body import Body, require_pitch
from antennate.control.climbing.rule import ClimbRule
from antennate.control.kind import ControllerKind, all_but
from antennate.control.knowledge import Kind, Knowledge
from antennate.control.rule_controller import Rule, RuleController
from antennate.params.climb import ClimbParams
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import (
    AntennaFrame,
    Bools,
    Contact,
    Floats,
    Ints,
    JointCommand,
    Maneuver,
)


class MakeRule(Protocol):
    """Makes a rule that commands a body."""

    def __call__(self, control: ControlParams, robot: RobotSpec, batch: int, body: Body) -> Rule:
        """The rule of B robots."""
        ...


class ClimbingController(RuleController):
    """A rule that decides maneuvers and commands the vertical part of the command.

    Args:
        make: Makes the rule.
        control: All numbers of the control.
        robot: The robot.
        batch: Number of robots B.
    """

    def __init__(
        self, make: MakeRule, control: ControlParams, robot: RobotSpec, batch: int
    ) -> None:
        require_pitch(robot)
        self.body = Body(control, robot, batch)
        rule = make(control, robot, batch, self.body)
        super().__init__(rule, control, robot, batch, self.body)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """Joint targets for this frame, which the body feels first."""
        self.body.feel(frame)
        return super().step(frame)


class _LiftedRule:
    """FORWARD with the head up."""

    turn_offset = 0.0

    def __init__(self, control: ControlParams, robot: RobotSpec, batch: int, body: Body) -> None:
        self._body, self._lift = body, control.climb.lift

    def reset(self, rows: Ints | Bools) -> None:
        pass

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        self._body.nod[:] = self._lift
        return _forward(contact, self._body)


class _RhythmRule:
    """Walks for a time, backs off, and climbs as `climb` does after a probe, again and again."""

    turn_offset = 0.0

    def __init__(self, control: ControlParams, robot: RobotSpec, batch: int, body: Body) -> None:
        p = control.climb
        self._body, self._period, self._elevation = body, control.period, 0.5 * p.feel.highest
        self._ends = np.cumsum([p.walk_time, p.retreat_time, p.lift_time, p.come_time])
        self._time: Floats = np.zeros(batch)

    def reset(self, rows: Ints | Bools) -> None:
        self._time[rows] = 0.0

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        body = self._body
        known = _forward(contact, body) == int(Maneuver.FORWARD)
        part = np.searchsorted(self._ends, self._time, side="right")
        body.begin(known & (part == 2) & ~body.climbs)
        body.held = body.nose_is_up
        body.advance(known & (part == len(self._ends)))
        over = (part == len(self._ends)) & ~body.climbs
        self._time = np.where(over, 0.0, self._time + np.where(known, self._period, 0.0))
        body.elevation[:] = self._elevation
        return np.where(known, _ROUND[part], int(Maneuver.HOLD))


_ROUND = np.array(
    [
        Maneuver.FORWARD,
        Maneuver.REVERSE,
        Maneuver.HOLD,
        Maneuver.FORWARD,
        Maneuver.FORWARD,
    ]
)
"""Maneuvers of the parts of a round of `rhythm`: walk, back off, lift, come up, climb."""


class _EdgesRule:
    """FORWARD; a simulation tells where the edges are.

    Its plan goes on as slowly as that of `climb`, and goes back with a robot that slips back.
    """

    turn_offset = 0.0
    knows: tuple[Kind, ...] = ("edges",)
    needs: tuple[Kind, ...] = knows

    def __init__(self, control: ControlParams, robot: RobotSpec, batch: int, body: Body) -> None:
        p = control.climb
        self._body, self._elevation = body, 0.5 * p.feel.highest
        self._most, self._ahead = p.pace * control.period, p.ahead

    def reset(self, rows: Ints | Bools) -> None:
        pass

    def know(self, knowledge: Knowledge) -> None:
        if knowledge.edges is not None:
            most = np.fmax(self._body.progress + self._most, -self._ahead)
            self._body.progress = np.minimum(knowledge.edges, most)

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        self._body.elevation[:] = self._elevation
        return _forward(contact, self._body)


def _forward(contact: Ints, body: Body) -> Ints:
    """FORWARD; where a reading cannot be used, HOLD with a body that stands still."""
    body.still = unknown = (contact == int(Contact.UNKNOWN)).any(axis=1)
    return np.where(unknown, int(Maneuver.HOLD), int(Maneuver.FORWARD))


def climb(control: ControlParams, robot: RobotSpec, batch: int) -> ClimbingController:
    """`climb`: feels steps and drops, climbs steps, and steers like `closed` by walls."""
    return ClimbingController(ClimbRule, control, robot, batch)


def lifted(control: ControlParams, robot: RobotSpec, batch: int) -> ClimbingController:
    """`lifted`: walks with its head up."""
    return ClimbingController(_LiftedRule, control, robot, batch)


def rhythm(control: ControlParams, robot: RobotSpec, batch: int) -> ClimbingController:
    """`rhythm`: climbs by the clock."""
    return ClimbingController(_RhythmRule, control, robot, batch)


def edges(control: ControlParams, robot: RobotSpec, batch: int) -> ClimbingController:
    """`edges`: climbs where a simulation says that there are edges."""
    return ClimbingController(_EdgesRule, control, robot, batch)


_CARRY = ("climb.carry_gain", "climb.carry_rate")
"""What holds a raised head in spite of its load."""
_RAISED = tuple(
    f"climb.{name}"
    for name in (
        *("rise", "ramp", "before", "over", "settle", "amplitude", "amplitude_rate", "rate"),
        *("frequency", "ahead", "heading", "feel.highest"),
    )
)
"""What raises a body with its antennae up and keeps its heading, but for `_CARRY`."""
_ROUND_OF_RHYTHM = tuple(
    f"climb.{name}" for name in ("walk_time", "retreat_time", "lift_time", "come_time", "pace")
)


KINDS = (
    ControllerKind(
        name="climb",
        about="feels steps and drops with lowered antennae, climbs steps, steers by walls as "
        "closed",
        make=climb,
        reads=(
            *all_but(ClimbParams, "climb", "lift", "walk_time", "come_time"),
            *("search", "repetition", "escape.turn_offset"),
        ),
        colour="#661100",
        line=(0, (12, 1.5)),
        climbs=True,
    ),
    ControllerKind(
        name="lifted",
        about="blind: walks with its head up, so that it gets on to low steps",
        make=lifted,
        reads=("climb.rate", "climb.lift"),
        colour="#999933",
        line=(0, (1, 3)),
        climbs=True,
    ),
    ControllerKind(
        name="rhythm",
        about="blind: climbs by the clock, as climb does where it feels a step",
        make=rhythm,
        reads=(*_RAISED, *_CARRY, *_ROUND_OF_RHYTHM),
        colour="#44AA99",
        line=(0, (3, 3)),
        climbs=True,
    ),
    ControllerKind(
        name="edges",
        about="climbs at edges that only a simulation can tell it, to show what knowing is worth",
        make=edges,
        reads=(*_RAISED, "climb.pace"),
        needs=_EdgesRule.needs,
        climbs=True,
    ),
)
