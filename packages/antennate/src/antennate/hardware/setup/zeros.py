"""Zeros and directions of all joints, measured on a robot without torque that is held by hand.

A zero is where a joint stands while the robot is held straight, legs at mid-stance, antennae at
their mounting angle. A direction is the sign by which the ticks change when the joint is moved in
its positive sense. Nothing here moves anything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from antennate.hardware.safety.deadlines import READ_OUTSIDE
from antennate.hardware.setup.person import Person, Quit, SetupError
from antennate.hardware.setup.robot_toml import change
from antennate.params.hardware import SetupParams, ZerosParams
from antennate.robots.joints import QUARTER, STRAIGHT
from antennate.robots.spec import GroupName, RobotSpec
from antennate.types import Ints
from dynamixel_bus.answers import POSITION, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.model import POSITION_UNIT, TICKS_A_TURN
from dynamixel_bus.models import XC430_W240

_ANTENNAE = ("", "the antenna at its mounting angle", "both antennae at their mounting angle")
"""Pose of so many antennae."""
_PERIOD = 0.05
"""Time between two readings [s]."""
_LOST = 20
"""Readings in a row that one servo may miss: a second (assumed)."""
_SENSES: Mapping[GroupName, str] = {
    "yaw": "swing the part behind it to the robot's right",
    "legs": "turn it as a wheel rolls forward",
    "antennae": "turn it towards the tail",
    "pitch": "lift the part behind it",
    "elevation": "lift the antenna",
}
_LIFTING = "lift it"
_QUIT = ("q", "quit")
_KEEP = {"s": 0, "skip": 0, "r": None, "rest": None}
"""Answers that keep a direction, and what they give: 0 for this one, None for the rest too."""
_CHOICE = "s keeps, r keeps the rest, q ends"


class HornNote(NamedTuple):
    """A zero that shows a horn in the wrong place.

    Attributes:
        joint: Name of the joint.
        zero: Its zero [ticks].
        teeth: How many teeth the horn sits off.
    """

    joint: str
    zero: int
    teeth: int

    def __str__(self) -> str:
        away = self.zero - STRAIGHT
        degrees = math.degrees(away * POSITION_UNIT)
        return (
            f"{self.joint}: zero {self.zero} is {away:+d} ticks ({degrees:+.1f} "
            f"deg) from the middle {STRAIGHT}, about {self.teeth} of its horn's teeth; put the "
            "horn on anew with its mark at the mark of the shaft, or keep it and lose that much of "
            "its way"
        )


def _pose(robot: RobotSpec) -> str:
    """How a robot, or a bench, is held while its zeros are measured."""
    antennae = _ANTENNAE[robot.antenna_count]
    if not robot.leg_count:
        return f"hold {antennae}"
    straight = "links in one line, every leg at mid-stance (ring lowest)"
    return f"hold the robot straight: {straight}{antennae and f', {antennae}'}"


class Positions:
    """The positions of all joints, read again and again.

    Args:
        bus: The bus, torque off.
        robot: The robot.
        wait: Lets a time pass [s].
    """

    def __init__(self, bus: Bus, robot: RobotSpec, wait: Callable[[float], None]) -> None:
        self._bus, self._ids, self._wait = bus, robot.ids, wait
        self._missed = dict.fromkeys(robot.ids, 0)
        self._newest: dict[int, int] = {}

    def __iter__(self) -> Iterator[Ints]:
        """Positions [ticks], shape (n,), for ever, one every 50 ms."""
        while True:
            answers = self._bus.read_all(self._ids, POSITION, READ_OUTSIDE)
            for servo, reply in answers.items():
                if isinstance(reply, Value):
                    self._newest[servo] = XC430_W240["present_position"].decode(reply.data)
                    self._missed[servo] = 0
                else:
                    self._missed[servo] += 1
            if lost := [servo for servo, count in self._missed.items() if count >= _LOST]:
                raise SetupError(
                    f"expected positions of all servos, found none of {lost} for a second; check "
                    "cables and supply"
                )
            if len(self._newest) == len(self._ids):
                yield np.array([self._newest[servo] for servo in self._ids], np.int64)
            self._wait(_PERIOD)


class Zeroing:
    """Measures zeros, then directions.

    Args:
        robot: The robot as it is described so far.
        params: How still, how far.
        positions: The positions of its joints.

    Attributes:
        measured: Names of the joints whose direction was measured, not kept.
    """

    def __init__(self, robot: RobotSpec, params: SetupParams, positions: Positions) -> None:
        self._robot, self._params, self._positions = robot, params, positions
        self._names = robot.joint_names
        self.measured: set[str] = set()
        self._limited = np.isfinite(robot.limits)

    def zeros(self, person: Person) -> list[int]:
        """The zero of each joint [ticks], once the robot is held straight and still."""
        while True:
            person.say(f"{_pose(self._robot)}; then Enter [q ends]")
            self._wait_for_enter(person)
            try:
                return self._mean()
            except SetupError as error:
                person.say(f"{error}; once more")

    def _wait_for_enter(self, person: Person) -> None:
        for now in self._positions:
            person.show(self._all(now))
            if (answer := person.answer()) in _QUIT:
                raise Quit
            if answer == "":
                return
            if answer is not None:
                person.say(f"expected Enter or q, found {answer[:20]!r}")

    def _mean(self) -> list[int]:
        """The mean of the positions over a while."""
        count = max(2, round(self._params.hold / _PERIOD))
        readings = np.array([now for _, now in zip(range(count), self._positions, strict=False)])
        moved = np.ptp(readings, axis=0) * POSITION_UNIT
        if moved.max() > self._params.still:
            worst = int(moved.argmax())
            raise SetupError(
                f"expected all joints at rest, found {self._names[worst]} moving by "
                f"{math.degrees(moved[worst]):.1f} deg"
            )
        zeros = np.rint(readings.mean(axis=0)).astype(np.int64)
        zeros[~self._limited] %= TICKS_A_TURN  # legs count turns from wherever they stand
        room = (zeros >= QUARTER) & (zeros <= TICKS_A_TURN - QUARTER) | ~self._limited
        if not room.all():
            at = int(np.argmin(room))
            raise SetupError(
                f"expected {self._names[at]} at {QUARTER} to {TICKS_A_TURN - QUARTER} ticks, found "
                f"it at {zeros[at]}: no room for a quarter turn to both sides; put its horn on anew"
            )
        return zeros.tolist()

    def horns(self, zeros: Sequence[int]) -> list[HornNote]:
        """Joints whose zero is more than half a tooth of the horn off the middle.

        A leg that rolls has no middle.
        """
        tooth = TICKS_A_TURN / self._params.horn_teeth
        away = (np.array(zeros) - STRAIGHT) / tooth
        return [
            HornNote(name, zero, max(1, round(abs(off))))
            for name, zero, off, limited in zip(
                self._names, zeros, away.tolist(), self._limited, strict=True
            )
            if limited and abs(off) > 0.5
        ]

    def directions(self, person: Person) -> list[int]:
        """The direction of each joint, 1 or -1, as each is moved by hand in turn."""
        signs = list(self._robot.directions)
        for at, name in enumerate(self._names):
            before = next(iter(self._positions))  # the person may answer at once
            where = f"{at + 1} of {len(signs)}: {name}"
            person.say(f"{where}: {self._sense(at)} by 10 to 40 deg [{_CHOICE}]")
            sign = self._direction(person, at, before)
            if sign is None:
                break
            signs[at] = sign or signs[at]
        return signs

    def _direction(self, person: Person, at: int, before: Ints) -> int | None:
        """The direction of one joint, 0 to keep it, None to keep the rest as well."""
        name, named = self._names[at], at
        for now in self._positions:
            if (answer := person.answer()) is not None:
                if answer in _QUIT:
                    raise Quit
                if answer in _KEEP:
                    return _KEEP[answer]
                person.say(f"expected s, r or q, found {repr(answer[:20]) if answer else 'Enter'}")
            moved = (now - before) * POSITION_UNIT
            person.show(f"{name}: {now[at]} ticks, moved {math.degrees(moved[at]):+6.1f} deg")
            if abs(moved[at]) >= self._params.turn:
                sign = 1 if moved[at] > 0 else -1
                person.say(f"  {name}: direction {sign:+d}")
                self.measured.add(name)
                return sign
            other = int(abs(moved).argmax())
            if abs(moved[other]) >= 2.0 * self._params.turn and other != named:
                named = other
                person.say(self._exchanged(at, other))
        return None

    def _exchanged(self, at: int, other: int) -> str:
        names, ids = self._names, self._robot.ids
        return (
            f"  expected {names[at]} (id {ids[at]}) to move, found {names[other]} (id "
            f"{ids[other]}); if you did move {names[at]}, their servos are exchanged: end with q, "
            "exchange them, run zero again"
        )

    def _sense(self, at: int) -> str:
        """What to do to move a joint in its positive sense."""
        names: list[GroupName] = [n for n, _, k in self._robot.groups for _ in range(k)]
        lifts = names[at] == "legs" and self._limited[at]
        return _LIFTING if lifts else _SENSES[names[at]]

    def _all(self, now: Ints) -> str:
        """All positions in one line, group by group."""
        return "  ".join(
            f"{name} {' '.join(map(str, now[self._robot.places(name)].tolist()))}"
            for name, _, count in self._robot.groups
            if count
        )


def by_group(
    robot: RobotSpec, what: str, values: Sequence[int]
) -> dict[tuple[str, ...], list[int]]:
    """Values of all joints as keys of a robot's file: `robot.yaw.zeros` and so on."""
    return {
        ("robot", name, what): list(values[robot.places(name)])
        for name, _, count in robot.groups
        if count
    }


def measured(
    robot: RobotSpec,
    zeros: Sequence[int],
    directions: Sequence[int],
    missing: Sequence[str],
    date: str,
) -> dict[tuple[str, ...], Any]:
    """Keys of a robot's file that say where its joints are, since a date."""
    return {
        **by_group(robot, "ids", robot.ids),
        **by_group(robot, "zeros", zeros),
        **by_group(robot, "directions", directions),
        ("zeros", "measured"): date,
        ("zeros", "missing"): missing,
    }


def forgotten(robot: RobotSpec, zeros: ZerosParams, servo: int, file: Path | None) -> ZerosParams:
    """What is known once another servo has this id, kept in the robot's file if there is one."""
    joint = robot.joint_names[robot.ids.index(servo)]
    if joint in (*zeros.missing, *robot.unstated("zeros")):
        return zeros
    missing = (*zeros.missing, joint)
    if file is not None:
        change(file, {("zeros", "missing"): missing})
    return zeros.model_copy(update={"missing": missing})
