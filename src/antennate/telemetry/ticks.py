"""One tick of a drive, as it is logged: what was read, decided and commanded, and the health.

Packed it is bytes, whose layout follows from the number of joints, and a text after them. Every
float comes back bit by bit, NaN and infinities too.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from antennate.errors import LogError
from antennate.hardware.driving.decision import Decision
from antennate.hardware.driving.session import Session
from antennate.messages import one_line
from antennate.robots.spec import RobotSpec
from antennate.telemetry.framing import SCHEMA, Kind
from antennate.types import AntennaFrame, Controller, JointCommand

_HEAD = struct.Struct("<BBH")
"""Schema, kind and number of joints."""
_CODES = {"number": "Q", "asked": "?", "t": "d", "now": "d"}
_CODES |= {"counts": "dd", "reading": "dd", "level": "dd"}
_CODES |= {"contact": "qq", "maneuver": "q", "phase": "d", "angles": "", "age": "d"}
_CODES |= dict.fromkeys(
    ("missed", "frames", "crc", "lost", "misses", "stale", "sent", "refused"), "Q"
)
"""The numbers of a tick in the order of its record, with their codes for `struct`: two for a pair,
left and right; `angles` has a `d` for each joint."""
_LONGEST_CAUSE = 160
_NEITHER = (math.nan, math.nan)

Pair = tuple[float, float]


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
            note=_clean(session.quality.status),
            age=clock.age(t),
            missed=0 if session.timing is None else session.timing.report().missed_cycles,
            frames=bytes_.good,
            crc=bytes_.crc_errors,
            lost=session.board.lost,
            misses=bus.misses,
            stale=bus.stale,
            sent=session.tally.sent,
            refused=session.control.refused,
        )

    @property
    def values(self) -> tuple[float, ...]:
        """All numbers, in the order of `fields`."""
        held = (getattr(self, name) for name in _CODES)
        return tuple(n for each in held for n in (each if isinstance(each, tuple) else (each,)))

    def frame(self) -> AntennaFrame:
        """What the controller got."""
        return AntennaFrame(t=np.array([self.t]), counts=np.array([self.counts]))

    def pack(self) -> bytes:
        """The content of its record.

        Raises:
            LogError: A number does not fit.
        """
        text = "\n".join((self.state, self.note, *self.causes)).encode("utf-8", "backslashreplace")
        try:
            joints = len(self.angles)
            fixed = struct.pack(layout(joints), SCHEMA, Kind.TICK, joints, *self.values, len(text))
        except struct.error as error:
            raise LogError(f"expected a tick of numbers that fit, found: {error}") from None
        return fixed + text

    @classmethod
    def unpack(cls, content: bytes) -> Tick:
        """Back from `pack`.

        Raises:
            LogError: It is no tick of this schema.
        """
        if len(content) < _HEAD.size or content[:2] != bytes((SCHEMA, Kind.TICK)):
            raise LogError(f"expected a tick of schema {SCHEMA}, found {len(content)} other bytes")
        joints = _HEAD.unpack_from(content)[2]
        fixed = struct.Struct(layout(joints))
        if len(content) < fixed.size:
            raise LogError(f"expected a tick of {joints} joints, found {len(content)} bytes")
        *numbers, length = fixed.unpack_from(content)
        if len(content) != fixed.size + length:
            raise LogError(f"expected a text of {length} bytes, found another length")
        try:
            state, note, *causes = content[fixed.size :].decode().split("\n")
        except ValueError:
            raise LogError("expected lines in UTF-8 as text of a tick, found others") from None
        rest = iter(numbers[3:])
        found: dict[str, Any] = {}
        for name, code in _codes(joints).items():
            values = tuple(islice(rest, len(code)))
            found[name] = values if name == "angles" or len(code) > 1 else values[0]
        return cls(**found, state=state, note=note, causes=tuple(causes))


def _codes(joints: int) -> dict[str, str]:
    return _CODES | {"angles": "d" * joints}


def layout(joints: int) -> str:
    """For `struct`: a tick of a robot with so many joints; the length of its text comes last."""
    return "<BBH" + "".join(_codes(joints).values()) + "I"


def fields(robot: RobotSpec) -> tuple[str, ...]:
    """Names of all numbers of a tick, without schema, kind, number of joints and text."""
    pairs = {name: (f"{name}_l", f"{name}_r") for name, code in _CODES.items() if len(code) > 1}
    parts = pairs | {"angles": robot.joint_names}
    return tuple(field for name in _CODES for field in parts.get(name, (name,)))


def angles_of(command: JointCommand, joints: int | None = None) -> tuple[float, ...]:
    """Joint targets of one robot [rad] in the order of its joints.

    Args:
        command: The command; it may be anything.
        joints: Number of joints; all angles are NaN if the command has others.
    """
    parts = (_flat(command, name) for name in ("yaw", "leg", "antenna", "pitch"))
    angles = tuple(angle for part in parts for angle in part)
    return angles if joints in (None, len(angles)) else (math.nan,) * joints


def decided(controller: Controller, decision: Decision, frame: AntennaFrame) -> dict[str, Any]:
    """The fields that every world has; NaN for a level or a phase that the controller lacks."""
    phase, level = _flat(controller, "phase"), _flat(controller, "level")
    return {
        "t": float(frame.t[0]),
        "counts": tuple(frame.counts[0].tolist()),
        "level": level if len(level) == 2 else _NEITHER,
        "contact": decision.contact,
        "maneuver": decision.maneuver,
        "phase": phase[0] if len(phase) == 1 else math.nan,
    }


def _flat(owner: Any, name: str) -> tuple[float, ...]:
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
