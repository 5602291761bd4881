"""One tick of a loop, as it is logged: what was read, decided and commanded, and the health.

Every float comes back bit by bit, NaN and infinities too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from antennate.control.decision import Decision
from antennate.messages import one_line
from antennate.robots.spec import RobotSpec
from antennate.telemetry.cdr import MessageType
from antennate.telemetry.topics import (
    ANTENNA,
    COUNTERS,
    IMU,
    JOINT_COMMANDS,
    JOINT_STATES,
    JOINTS,
    MANEUVER,
    MOTION,
    SUPERVISOR,
    TICK,
    TICK_TOPICS,
    Topic,
    imu_values,
)
from antennate.types import AntennaFrame, Controller, Ints, JointCommand

if TYPE_CHECKING:  # a log of a simulation loads no hardware
    from antennate.hardware.safety.session import Session

_LONGEST_CAUSE = 160
_ONE = dict(zip(JOINTS[1:], ("position", "velocity", "effort"), strict=True))
_NEITHER = (math.nan, math.nan)

Pair = tuple[float, float]
Columns = Mapping[str, NDArray[Any]]
"""Ticks by the names of the fields of `Tick`, shape (n,), or (n, several) where one has several."""


@dataclass(frozen=True, slots=True)
class Tick:
    """What one tick was. Pairs are left and right.

    Attributes:
        number: Ticks since the controller began, this one included.
        t: Time of the frame, as the controller got it [s].
        now: The loop's time [s].
        counts: Readings that the controller got [counts]; NaN is UNKNOWN.
        reading: Readings before the supervisor withheld them [counts].
        level: Bending levels, NaN if the controller has none.
        contact: One `Contact` a side.
        maneuver: The `Maneuver` decided.
        phase: Gait phase [rad], NaN if the controller has none.
        angles: Joint targets decided [rad] in the order of the robot's joints; NaN if it failed.
        state: The supervisor's state, empty without one.
        causes: Its causes in force, the most severe first.
        asked: Whether the controller was asked; if not, its last command was kept.
        note: What the operator should know or do, in one line.
        age: Age of the newest sample [s], NaN in simulation.
        missed: Ticks left out so far.
        frames: Good frames of the board so far.
        crc: Frames with a wrong CRC so far.
        lost: Samples that never came.
        misses: Answers that servos did not give so far.
        stale: Late answers thrown away so far.
        sent: Commands sent so far.
        refused: Commands refused so far.
        positions: Measured joint angles [rad], NaN for one that has not answered; empty if unknown.
        velocities: Measured joint speeds [rad/s], empty if unknown.
        efforts: Measured joint torques [N·m], empty if unknown.
        angular_velocity: Of the head, as the controller got it [rad/s]; empty without a sensor.
        linear_acceleration: Specific force on it, likewise [m/s²].
        events: What began or ended with this tick, as a step of a protocol.
    """

    number: int
    t: float
    now: float
    counts: Pair
    reading: Pair
    level: Pair
    contact: tuple[int, int]
    maneuver: int
    phase: float
    angles: tuple[float, ...]
    state: str = ""
    causes: tuple[str, ...] = ()
    asked: bool = True
    note: str = ""
    age: float = math.nan
    missed: int = 0
    frames: int = 0
    crc: int = 0
    lost: int = 0
    misses: int = 0
    stale: int = 0
    sent: int = 0
    refused: int = 0
    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    efforts: tuple[float, ...] = ()
    angular_velocity: tuple[float, ...] = ()
    linear_acceleration: tuple[float, ...] = ()
    events: tuple[str, ...] = ()

    @classmethod
    def of(cls, session: Session, t: float) -> Tick:
        """The tick of a session that has just written, at the host's time t [s]."""
        out, clock, bus = session.outputs, session.board.clock, session.actuators.tally
        left, right = session.quality.counts
        bytes_ = session.board.decoder.counters
        return cls(
            **decided(session.control.controller, session.control.decision, session.frame),
            angles=angles_of(session.control.command, len(session.control.robot.ids)),
            number=session.tally.ticks,
            now=t,
            asked=session.control.result.asked,
            reading=(left, right),
            state="" if out is None else out.state.name,
            causes=() if out is None else tuple(_clean(cause.text) for cause in out.causes),
            note=_clean(f"{session.note} {session.quality.status}".lstrip()),
            events=session.events,
            age=clock.age(t),
            missed=0 if session.timing is None else session.timing.report().missed_cycles,
            frames=bytes_.good,
            crc=bytes_.crc_errors,
            lost=session.board.lost,
            misses=bus.misses,
            stale=bus.stale,
            sent=session.tally.sent,
            refused=session.control.refused,
            positions=session.actuators.state.angles,
        )

    @property
    def values(self) -> tuple[float, ...]:
        """All numbers but the measured ones of joints and head, in the order of `fields`."""
        values = (getattr(self, name) for name in _NUMBERS)
        return tuple(n for each in values for n in (each if isinstance(each, tuple) else (each,)))

    def row(self, robot: RobotSpec, measured: Container[str] = ()) -> dict[str, Any]:
        """The tick as a row of a table: numbers as they are, so that they come back exactly.

        Args:
            robot: Gives the names of the joints.
            measured: Which of positions, velocities, efforts and of `MOTION` have columns.
        """
        table = _named(fields(robot), self.values)
        for kind in JOINTS[1:]:
            if kind in measured:
                columns = [f"{name}_{_ONE[kind]}" for name in robot.joint_names]
                table |= _named(columns, getattr(self, kind))
        for kind in MOTION:
            if kind in measured:
                table |= _named([f"{kind}_{axis}" for axis in "xyz"], getattr(self, kind))
        texts = {"state": self.state, "note": self.note, "causes": "; ".join(self.causes)}
        return table | texts

    def frame(self) -> AntennaFrame:
        """What the controller got."""
        parts = np.array([self.t]), np.array([self.counts]), np.zeros((0, 0))
        return AntennaFrame(*parts, *(np.array([getattr(self, name)]) for name in MOTION))

    def pack(self) -> bytes:
        """All of it as bytes, for another process.

        Raises:
            LogError: A number does not fit.
        """
        return TICK.encode(*_ALL(self))

    @classmethod
    def unpack(cls, content: bytes) -> Tick:
        """Tick from the bytes of `pack`.

        Raises:
            LogError: It is no tick.
        """
        return cls(**TICK.decode(content))

    def messages(self, names: tuple[str, ...], stamp: int) -> Iterator[tuple[Topic, bytes]]:
        """Messages of the tick in a log.

        Args:
            names: Names of the joints.
            stamp: Time of the messages [ns].

        Raises:
            LogError: A number does not fit.
        """
        for topic, getter in _OWN:
            numbers = getter(self)
            if topic in TICK_TOPICS or any(numbers):
                yield topic, topic.type.encode(*numbers)
        time = (*divmod(stamp, 10**9), "", names)
        yield JOINT_COMMANDS, JOINT_COMMANDS.type.encode(*time, self.angles, (), ())
        if self.positions:
            measured = (self.positions, self.velocities, self.efforts)
            yield JOINT_STATES, JOINT_STATES.type.encode(*time, *measured)
        if self.angular_velocity:
            motion = self.angular_velocity, self.linear_acceleration
            yield IMU, IMU.type.encode(*imu_values(stamp, *motion))

    @classmethod
    def of_messages(cls, messages: Mapping[Topic, bytes]) -> Tick:
        """Tick from its messages.

        Raises:
            LogError: One is not of its type.
        """
        values: dict[str, Any] = {}
        for topic, _ in _OWN:
            if topic in messages:
                values |= topic.decode(messages[topic])
        values["angles"] = JOINT_COMMANDS.decode(messages[JOINT_COMMANDS])["position"]
        if JOINT_STATES in messages:
            state = JOINT_STATES.decode(messages[JOINT_STATES])
            values |= {kind: state[name] for kind, name in _ONE.items()}
        if IMU in messages:
            felt = IMU.decode(messages[IMU])
            values |= {kind: felt[kind] for kind in MOTION}
        return cls(**values)


def ticks_of(columns: Columns, first: int) -> Iterator[Tick]:
    """Ticks one by one, from this number on; what is missing has its default in all of them."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    for number, row in enumerate(rows, first):
        values: dict[str, Any] = dict(zip(columns, row, strict=True))
        values["number"] = number
        yield Tick(**values)


def uniform(columns: Columns) -> bool:
    """Whether there are ticks, all have messages of the same topics, and their numbers fit."""
    sizes = [len(column) for column in columns.values()]
    return any(sizes) and columns.keys().isdisjoint(_OF_SOME) and TICK.holds(columns)


def messages_of(columns: Columns, names: tuple[str, ...], stamps: Ints) -> dict[Topic, list[bytes]]:
    """Messages of many ticks by topic, those that `Tick.messages` gives of each.

    Args:
        columns: The ticks, `uniform`; what is missing has its default in all of them.
        names: Names of the joints.
        stamps: Time of the messages of each tick [ns], shape (n,).
    """
    first = next(ticks_of({name: column[:1] for name, column in columns.items()}, 0))
    more = {
        JOINT_COMMANDS: {"position": columns["angles"]},
        JOINT_STATES: {name: columns[kind] for kind, name in _ONE.items() if kind in columns},
    }
    varying = {**columns, "sec": stamps // 10**9, "nanosec": stamps % 10**9}
    return {
        topic: topic.type.vary(data, varying | more.get(topic, {}))
        for topic, data in first.messages(names, 0)
    }


def _named(columns: Sequence[str], values: Sequence[Any]) -> dict[str, Any]:
    """Values by their columns, NaN for those that are not there."""
    return dict.fromkeys(columns, math.nan) | dict(zip(columns, values, strict=False))


def _getter(kind: MessageType) -> Callable[[Tick], tuple[Any, ...]]:
    return attrgetter(*(field.name for field in kind.fields))


_ALL = _getter(TICK)
_OWN = tuple((topic, _getter(topic.type)) for topic in (ANTENNA, MANEUVER, COUNTERS, SUPERVISOR))
"""Topics whose messages are fields of a tick."""
_OF_SOME = {field.name for topic in (COUNTERS, SUPERVISOR) for field in topic.type.fields}
"""Fields with messages of the ticks alone that have something to say there."""
_NUMBERS = tuple(f.name for f in TICK.fields if f.code and f.name not in (*JOINTS[1:], *MOTION))


def fields(robot: RobotSpec) -> tuple[str, ...]:
    """Names of the numbers of a tick that are in its `values`."""
    parts: dict[str, tuple[str, ...]] = {"angles": robot.joint_names}
    pairs = [field.name for field in TICK.fields if field.number == 2]
    parts |= {name: (f"{name}_left", f"{name}_right") for name in pairs}
    return tuple(field for name in _NUMBERS for field in parts.get(name, (name,)))


def angles_of(command: JointCommand, joints: int | None = None) -> tuple[float, ...]:
    """Joint targets of one robot [rad] in the order of its joints.

    Args:
        command: The command; it may be anything.
        joints: Number of joints; all angles are NaN if the command has others.
    """
    parts = (numbers_of(command, name) for name in ("yaw", "leg", "antenna", "pitch", "elevation"))
    angles = tuple(angle for part in parts for angle in part)
    return angles if joints in (None, len(angles)) else (math.nan,) * joints


def decided(controller: Controller, decision: Decision, frame: AntennaFrame) -> dict[str, Any]:
    """The fields that every world has; NaN for a level or a phase that the controller lacks."""
    phase, level = numbers_of(controller, "phase"), numbers_of(controller, "level")
    return {
        "t": float(frame.t[0]),
        "counts": tuple(frame.counts[0].tolist()),
        "level": level if len(level) == 2 else _NEITHER,
        "contact": decision.contact,
        "maneuver": decision.maneuver,
        "phase": phase[0] if len(phase) == 1 else math.nan,
        **felt(frame),
    }


def felt(frame: AntennaFrame | None) -> dict[str, Any]:
    """What an inertial sensor gives, if the frame of one robot holds any."""
    if frame is None or not frame.angular_velocity.size:
        return {}
    return {name: tuple(getattr(frame, name)[0].tolist()) for name in MOTION}


def numbers_of(owner: Any, name: str) -> tuple[float, ...]:
    """Numbers in an attribute of any object; empty if there are none."""
    try:
        return tuple(np.asarray(getattr(owner, name), float).ravel().tolist())
    except KeyboardInterrupt:
        raise
    except BaseException:  # noqa: BLE001 a property of anybody may raise anything
        return ()


def _clean(cause: str) -> str:
    """A cause in one line of bounded length; it may quote an exception of anybody."""
    return one_line(cause)[:_LONGEST_CAUSE]
