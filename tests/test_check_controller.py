"""check_controller accepts what keeps the protocol, and names what is broken in the rest."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import antennate
from antennate.errors import AntennateError
from antennate.robots.spec import RobotSpec
from antennate.testing import check_controller
from antennate.types import AntennaFrame, Contact, JointCommand, Maneuver


class Plain:
    """Walks forward, feels with each antenna, and holds while one of them reads no number."""

    def __init__(self, control: Any, robot: Any, batch: int) -> None:
        self.shapes, self.period = robot.command_shapes(batch), control.period
        self.phase = np.zeros(batch)
        self.maneuver = np.zeros(batch, np.int64)
        self.contact = np.zeros((batch, 2), np.int64)
        self.level = np.zeros((batch, 2))

    def reset(self, rows: Any, phase: Any = 0.0) -> None:
        self.phase[rows] = phase

    def step(self, frame: AntennaFrame) -> JointCommand:
        known = np.isfinite(frame.counts)
        bend = (1872.0 - np.where(known, frame.counts, np.nan)) / 473.0
        self.level = np.minimum(np.maximum(bend, 0.0), 1.0)
        self.contact = np.where(known, self.level > 0.5, Contact.UNKNOWN)
        walks = known[:, 0] & known[:, 1]
        self.maneuver = np.where(walks, Maneuver.FORWARD, Maneuver.HOLD)
        self.phase = self.phase + walks * self.period
        return JointCommand(
            np.broadcast_to(0.1 * np.sin(self.phase)[:, None], self.shapes["yaw"]).copy(),
            np.broadcast_to(self.phase[:, None, None], self.shapes["leg"]).copy(),
            np.zeros(self.shapes["antenna"]),
        )


EXAMPLE = f"{Path(__file__).parents[1] / 'examples/own_controller.py'}:OwnController"
LATER = [
    "open",
    "paper",
    "random",
    "schedule",
    "zigzag",
    "centre",
    "geometric",
    "climb",
    "lifted",
    "rhythm",
]


@pytest.mark.parametrize(
    "factory",
    [
        "closed",
        "timed",
        "follow",
        Plain,
        *(pytest.param(name, marks=pytest.mark.slow) for name in (*LATER, EXAMPLE)),
    ],
)
def test_sound_controllers_keep_the_protocol(factory: Any) -> None:
    robot = "scuttle3d" if factory in ("climb", "lifted", "rhythm") else "scuttle"
    check_controller(factory, robot=RobotSpec.named(robot))


class Around:
    """`Plain`, to be broken in one place by those below."""

    def __init__(self, control: Any, robot: Any, batch: int) -> None:
        self.inner, self.batch, self.ticks = Plain(control, robot, batch), batch, 0
        self.noise = np.random.default_rng()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def reset(self, rows: Any, phase: Any = 0.0) -> None:
        self.inner.reset(rows, phase)

    def step(self, frame: AntennaFrame) -> JointCommand:
        self.ticks += 1
        return self.inner.step(frame)


def saying(name: str, part: str, change: Callable[[Any], Any]) -> Any:
    """`Plain`, which tells its level, maneuver or contact otherwise."""

    def step(self: Around, frame: AntennaFrame) -> JointCommand:
        command = Around.step(self, frame)
        setattr(self, part, change(getattr(self.inner, part)))
        return command

    return type(name, (Around,), {"step": step})


def adding(name: str, joints: str, what: Callable[[Around, AntennaFrame], Any]) -> Any:
    """`Plain`, to whose angles something is added."""

    def step(self: Around, frame: AntennaFrame) -> JointCommand:
        command = Around.step(self, frame)
        getattr(command, joints)[:] += what(self, frame)
        return command

    return type(name, (Around,), {"step": step})


def writing(name: str, write: Callable[[Around, AntennaFrame], Any]) -> Any:
    """`Plain`, which changes the frame that it was given."""

    def step(self: Around, frame: AntennaFrame) -> JointCommand:
        command = Around.step(self, frame)
        write(self, frame)
        return command

    return type(name, (Around,), {"step": step})


InfiniteLevel = saying(
    "InfiniteLevel", "level", lambda level: np.where(np.arange(2) == 0, -np.inf, level)
)
UnknownLevel = saying("UnknownLevel", "level", lambda level: np.full_like(level, math.nan))


class ForOneOnly(Around):
    def __init__(self, control: Any, robot: Any, batch: int) -> None:
        super().__init__(control, robot, 1)


class FewJoints(Around):
    def step(self, frame: AntennaFrame) -> JointCommand:
        command = super().step(frame)
        return JointCommand(command.yaw[:, :2], command.leg, command.antenna)


class NoLevel(Plain):
    def __init__(self, control: Any, robot: Any, batch: int) -> None:
        super().__init__(control, robot, batch)
        del self.level

    def step(self, frame: AntennaFrame) -> JointCommand:
        command = super().step(frame)
        del self.level
        return command


class Raises(Around):
    def step(self, frame: AntennaFrame) -> JointCommand:
        raise ZeroDivisionError("of my own")


class ResetsAll(Around):
    def reset(self, rows: Any, phase: Any = 0.0) -> None:
        self.inner.reset(np.arange(self.batch), np.broadcast_to(phase, self.batch))


class ResetsNothing(Around):
    def reset(self, rows: Any, phase: Any = 0.0) -> None:
        if not self.ticks:
            self.inner.reset(rows, phase)


class WalksBlind(Around):
    def step(self, frame: AntennaFrame) -> JointCommand:
        counts = np.where(np.isfinite(frame.counts), frame.counts, 1872.0)
        return super().step(AntennaFrame(t=frame.t, counts=counts))


class CountsFromItsStart(Around):
    start = 0.37

    def step(self, frame: AntennaFrame) -> JointCommand:
        t = frame.t
        t -= self.start
        return super().step(frame)


class KeepsBuffer(Around):
    def step(self, frame: AntennaFrame) -> JointCommand:
        command = super().step(frame)
        self.buffer = getattr(self, "buffer", command.leg)
        self.buffer[...] = command.leg
        return JointCommand(command.yaw, self.buffer, command.antenna)


class TrustsItsCommand(Around):
    last = None

    def step(self, frame: AntennaFrame) -> JointCommand:
        command = super().step(frame)
        if self.last is not None and not np.isfinite(self.last.yaw).all():
            command.yaw[:] = 0.0
        self.last = command
        return command


BROKEN = {
    ForOneOnly: "IndexError.*with 5 rows",
    FewJoints: r"expected yaw of shape \(5, 5\), found \(5, 2\)",
    saying(
        "NoArray", "level", lambda level: level.tolist()
    ): "expected an array as level, found list",
    NoLevel: "expected an array as level, found none",
    saying(
        "ObjectLevel", "level", lambda level: level.astype(object)
    ): "expected real numbers as level, found an array of object",
    saying(
        "NoManeuver", "maneuver", lambda maneuver: maneuver + 7
    ): "expected a maneuver of 0 to 4, found 7",
    saying(
        "FloatManeuver", "maneuver", lambda maneuver: maneuver.astype(float)
    ): "expected whole numbers as maneuver, found an array of float64",
    saying("NoContact", "contact", lambda contact: contact + 5): "expected contacts of 0 to 2",
    saying("LevelInPercent", "level", lambda level: 100.0 * level): "expected levels of 0 to 1",
    InfiniteLevel: "expected levels of 0 to 1, or NaN",
    adding(
        "NotFinite", "leg", lambda self, frame: [math.nan, 0.0]
    ): "expected finite angles in leg",
    Raises: "step raised ZeroDivisionError: of my own",
    adding(
        "ByChance", "antenna", lambda self, frame: self.noise.normal(0.0, 0.01)
    ): "expected the same answers to the same readings, found another antenna",
    adding(
        "RowsTogether", "yaw", lambda self, frame: np.nanmean(frame.counts) * 1e-6
    ): "alone to answer as in a batch, found another yaw",
    adding(
        "FirstRow", "yaw", lambda self, frame: 0.01 * (np.arange(len(frame.t)) < 1)[:, None]
    ): "from rows in another order, found another yaw",
    adding(
        "BatchCounts", "yaw", lambda self, frame: 0.01 * self.batch
    ): "alone to answer as in a batch, found another yaw",
    ResetsAll: "the other rows to go on when one is reset",
    ResetsNothing: "a row that is reset to answer as a new one",
    WalksBlind: "expected HOLD while an antenna reads nan, found FORWARD",
    adding(
        "CreepsBlind", "leg", lambda self, frame: 1e-4 * frame.t[:, None, None]
    ): "expected joint targets that stand still in HOLD, found leg moves",
    saying(
        "KnowsBlind", "contact", lambda contact: np.where(contact == 2, 1, contact)
    ): "expected UNKNOWN for a reading of nan",
    writing(
        "Scribbles", lambda self, frame: frame.counts.fill(0.0)
    ): "expected a frame that is left as it is, found another counts .*; change a copy",
    writing(
        "ScribblesLate", lambda self, frame: np.copyto(frame.t, 0.0, where=frame.t > 90.0)
    ): "a frame that is left as it is, found another t after a step at 120.00 s",
    writing(
        "AtLast", lambda self, frame: frame.positions.__imul__(float(self.ticks < 2000))
    ): "that is left as it is, found another positions after a step at 360[0-9]",
    writing(
        "Rebinds", lambda self, frame: object.__setattr__(frame, "t", frame.t + 1.0)
    ): "expected a frame that is left as it is, found another t after",
    CountsFromItsStart: "expected a frame that is left as it is, found another t after",
    KeepsBuffer: "expected a command that stays as it was returned",
    TrustsItsCommand: "when a command that was returned is changed",
}


@pytest.mark.ci
@pytest.mark.parametrize("kind", BROKEN, ids=lambda kind: kind.__name__)
def test_a_broken_controller_is_told_what_is_broken(kind: Any) -> None:
    with pytest.raises(AssertionError, match=BROKEN[kind]):
        check_controller(kind)


@pytest.mark.parametrize("name", ["nobody", "no_such_module:Nobody"])
def test_a_controller_that_is_not_there_fails_the_check(name: str) -> None:
    with pytest.raises(AssertionError, match=name):
        check_controller(name)


def test_an_infinite_level_makes_a_trial_invalid_and_an_unknown_one_does_not() -> None:
    kinds: list[Any] = [InfiniteLevel, UnknownLevel]
    found = antennate.run("tunnel", trials=2, time_limit=0.3, controllers=kinds).rows
    told = {(row.controller, row.outcome, row.reason[:47]) for row in found}
    assert told == {
        ("InfiniteLevel", "invalid", "controller: expected levels of 0 to 1, or NaN, "),
        ("UnknownLevel", "timeout", ""),
    }
    with pytest.raises(AntennateError, match="tick 1: expected levels of 0 to 1, or NaN, found"):
        antennate.simulate(kinds[0], time_limit=0.1)
