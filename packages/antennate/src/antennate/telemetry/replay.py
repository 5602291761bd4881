"""A log as a robot: a controller decides again on the recorded readings."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import field_validator

from antennate.control.decision import Decision, decision_of, no_command
from antennate.control.knowledge import require_own_senses
from antennate.control.loop import run_loop
from antennate.control.readings import (
    KINDS,
    OWN,
    YOKED,
    Own,
    Readings,
    check_readings,
    make_readings,
)
from antennate.control.registry import BUILT_IN, check_for_robots, make_controller
from antennate.control.registry import KINDS as OURS
from antennate.errors import LogError, raised
from antennate.messages import shortened
from antennate.params.base import Params, number
from antennate.robots.imu import AXES
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import TWIN, Header
from antennate.telemetry.ticks import Tick, angles_of
from antennate.types import AntennaFrame, Controller, Floats, JointCommand


class ReplayConfig(Params):
    """Which controller decides upon the readings of a log."""

    offered: ClassVar[Mapping[str, Collection[str]]] = {"controller": BUILT_IN}

    controller: str | None = number(None, "1", "assumed: the one recorded")
    """{offered}, MODULE:NAME or FILE.py:NAME of your own, or FILE.onnx, in place of the
    recorded."""

    readings: str = number(OWN, "1", "assumed: what was recorded", examples=[*KINDS])
    """What it is given in place of the recorded readings: none, swapped, delayed:S or yoked."""

    @field_validator("readings")
    @classmethod
    def _known_readings(cls, name: str) -> str:
        return check_readings(name)

    @field_validator("controller")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        return None if name is None else check_for_robots(name)


class ReplayRobot:
    """Recorded readings in place of a robot's; also their clock.

    Each sleep goes on to the next tick, however long it is, so that none is left out. The clock
    shows the time slept to; frames carry the recorded time, and the joint angles that servos had
    reported: in simulation those of the tick, less their errors of zero, else of the tick before.

    Args:
        ticks: The log, in order.
        header: Its header.

    Attributes:
        tick: The present tick, None after the last.
        command: What was written last, None before.
    """

    def __init__(self, ticks: Iterable[Tick], header: Header) -> None:
        self._ticks = iter(ticks)
        self._now = 0.0
        joints = len(header.robot.joint_names)
        self._has_imu = header.robot.has_imu
        self._unknown: Floats = np.full(joints, math.nan)
        self._bias = np.array([*header.joint_bias, *[0.0] * joints])[:joints]
        self._simulated, self._before = header.seed is not None, self._unknown
        self.command: JointCommand | None = None
        self.tick: Tick | None = next(self._ticks, None)
        self._next: Tick | None = next(self._ticks, None)

    @property
    def clock(self) -> ReplayRobot:
        """The robot itself keeps the time."""
        return self

    @property
    def more(self) -> bool:
        """Whether a tick follows the present one."""
        return self._next is not None

    def now(self) -> float:
        """Time [s] to which it has been slept."""
        return self._now

    def sleep_until(self, t: float) -> None:
        """Go on to the next tick, unless time t [s] has passed."""
        if t > self._now:
            self._now = t
            now, after = self.tick, self._next
            self._before = self._unknown
            if now is not None and after is not None and after.number == now.number + 1:
                self._before = self._measured(now)
            self.tick, self._next = self._next, next(self._ticks, None)

    def read(self) -> AntennaFrame:
        """The frame of the present tick."""
        if self.tick is None:
            raise LogError("expected a tick to replay, found the end of the log")
        positions = self._measured(self.tick) - self._bias if self._simulated else self._before
        frame = replace(self.tick.frame(), positions=positions[None].copy())
        if not self._has_imu or frame.angular_velocity.size:
            return frame
        unknown = np.full((1, AXES), math.nan)
        return replace(frame, angular_velocity=unknown, linear_acceleration=unknown.copy())

    def _measured(self, tick: Tick) -> Floats:
        """Joint angles of a tick [rad], NaN where they are not known, shape (n,)."""
        return np.array(tick.positions) if tick.positions else self._unknown

    def write(self, command: JointCommand) -> None:
        """Keep a command; nothing moves."""
        self.command = command


class _Guarded:
    """A controller that is asked in the ticks in which it was asked then.

    Its exceptions, and answers of another form, give a command of NaN, as in a session.
    """

    def __init__(
        self, controller: Controller, log: ReplayRobot, robot: RobotSpec, readings: Readings
    ) -> None:
        self._controller, self._log, self._robot = controller, log, robot
        self._readings = readings
        self._kept: JointCommand | None = None
        self._refused = self.failures = 0
        self.failure = ""
        self.decision = Decision()

    def step(self, frame: AntennaFrame) -> JointCommand:
        """The command of this tick."""
        frame = self._readings.change(frame)
        tick = self._log.tick
        if tick is not None and self._kept is not None and not tick.asked:
            return self._kept
        refused, self._refused = self._refused, 0 if tick is None else tick.refused
        try:
            command = self._controller.step(frame)
            self.decision = decision_of(self._controller)
            if wrong := _wrong(command, self._robot):
                self._note(wrong)
            else:
                parts = self._robot.command_shapes()
                command = JointCommand(**{n: np.array(getattr(command, n)) for n in parts})
            if self._refused <= refused:
                self._kept = command
            return command
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001 a plugged-in controller may raise anything
            self._note(raised(error))
            return no_command(self._robot)

    def _note(self, failure: str) -> None:
        self.failures += 1
        self.failure = self.failure or failure


def _wrong(command: JointCommand, robot: RobotSpec) -> str:
    """What is wrong with the angles of a command; empty if nothing is."""
    for name, shape in robot.command_shapes().items():
        size = np.shape(angles := getattr(command, name))
        if size != shape:
            return f"expected {name} of shape {shape}, found {size}"
        if np.iscomplexobj(angles) or not np.isfinite(np.asarray(angles, float)).all():
            return f"expected finite angles in {name}, found {shortened(str(angles))}"
    return ""


class Difference(NamedTuple):
    """A tick that was decided otherwise: its number, its time [s], the maneuver then and now."""

    number: int
    now: float
    recorded: int
    replayed: int


@dataclass(slots=True)
class Replayed:
    """What came of a replay.

    Attributes:
        maneuvers: Decided now, one a tick.
        recorded: Ticks of each maneuver decided then.
        states: Ticks of each state of the supervisor then.
        start: The loop's time at the first tick [s].
        end: The loop's time at the last tick [s].
        different: Ticks whose maneuver differs.
        commands: Ticks whose command differs in any bit of its value.
        failures: Ticks in which the controller raised an exception or gave a wrong answer.
        failure: The first of them.
        first: The first tick whose maneuver differs, None if none does.
    """

    maneuvers: list[int] = field(default_factory=list[int])
    recorded: Counter[int] = field(default_factory=Counter[int])
    states: Counter[str] = field(default_factory=Counter[str])
    start: float = 0.0
    end: float = 0.0
    different: int = 0
    commands: int = 0
    failures: int = 0
    failure: str = ""
    first: Difference | None = None

    def note(self, tick: Tick, maneuver: int, command: JointCommand) -> None:
        """Compare one tick."""
        if not self.maneuvers:
            self.start = tick.now
        self.end = tick.now
        self.maneuvers.append(maneuver)
        self.recorded[tick.maneuver] += 1
        self.states[tick.state] += 1
        self.commands += not np.array_equal(
            angles_of(command, len(tick.angles)), tick.angles, equal_nan=True
        )
        if maneuver != tick.maneuver:
            self.different += 1
            self.first = self.first or Difference(tick.number, tick.now, tick.maneuver, maneuver)


def _unseen(tick: Tick, decision: Decision) -> None:
    """Show nothing."""


def replay(
    ticks: Iterable[Tick],
    controller: Controller,
    header: Header,
    on_tick: Callable[[Tick, Decision], None] = _unseen,
    readings: Readings | None = None,
) -> Replayed:
    """Let a controller that has just begun decide upon all ticks of a log.

    Args:
        ticks: The log, in order.
        controller: The controller.
        header: The header of the log: its period and its robot.
        on_tick: Called with each tick and what was decided now.
        readings: Change what the controller is given; None for what was recorded.
    """
    log, result = ReplayRobot(ticks, header), Replayed()
    control = _Guarded(controller, log, header.robot, readings or Own())

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        if log.tick is not None:
            result.note(log.tick, control.decision.maneuver, command)
            on_tick(log.tick, control.decision)
        return log.more

    if log.tick is not None:
        with np.errstate(over="ignore", invalid="ignore"):  # recorded numbers may be anything
            run_loop(log, control, header.params.period, go_on)
    result.failures, result.failure = control.failures, control.failure
    return result


def changed_readings(
    header: Header, name: str, donor: Iterable[Tick] | None, lent: Header | None = None
) -> Readings:
    """What a controller is given upon a log.

    Args:
        header: The header of the log.
        name: The readings, as `ReplayConfig` has them.
        donor: The ticks of the log that `yoked` gives, None without one.
        lent: The header of that log.
    """
    if lent is not None:
        if lent.readings != OWN:
            raise LogError(f"--donor: expected a log of own readings, found {lent.readings}")
        if _when(lent) == _when(header):
            raise LogError("--donor: expected a log of another trial or drive, found the same")
    if name != OWN and header.readings != OWN:
        raise LogError(
            f"--readings {name}: expected a log of own readings, found one of {header.readings}"
        )
    counts = [tick.frame().counts[0] for tick in donor or ()]
    if name == YOKED and not counts:
        raise LogError(f"--donor: expected a log with ticks for --readings {YOKED}, found none")
    return make_readings(name, header.params, donors=[np.array(counts)] if counts else ())


def _when(header: Header) -> tuple[object, ...]:
    """What tells one trial or drive from another."""
    return header.controller, header.seed, header.trial, header.start


def recorded_controller(header: Header, name: str | None = None) -> Controller:
    """The controller of a log as it began, or one of another name with the same numbers."""
    wanted = header.controller if name is None else name
    if name is None and wanted not in OURS:
        more = "closed, for example" if wanted == TWIN else "with its name if it may run"
        found = shortened(repr(wanted))
        raise LogError(
            f"expected one of {', '.join(BUILT_IN)} in the log, found {found}; give "
            f"--controller {more}"
        )
    if name is None and header.knows:
        raise LogError(
            f"expected a log of readings alone, found one of a controller that a simulation told "
            f"{', '.join(header.knows)}, which is not in the log; give --controller NAME for one "
            "that decides upon the readings"
        )
    made = make_controller(wanted, header.params, header.robot, walks=False)
    require_own_senses(made, wanted, "a replay")
    made.reset(np.array([0]), header.phase)
    return made
