"""States of the supervisor, causes that ask for them, and the inputs that they follow from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum

from antennate.hardware.safety.diagnosis import Finding


class State(IntEnum):
    """The ladder; each state is safer than the one before.

    DEGRADED walks. HOLD keeps the last command, torque on. FAULT is a HOLD that only an arm event
    ends. OFF has no torque and also needs an arm event.
    """

    OK = 0
    DEGRADED = 1
    HOLD = 2
    FAULT = 3
    OFF = 4


class Cause(Enum):
    """What can be wrong, and the state it asks for."""

    SPIKY = (State.DEGRADED, "many readings are bad")
    OUT_OF_CAL = (State.DEGRADED, "readings lie beyond the calibrated range")
    SATURATED = (State.DEGRADED, "readings are at the rail of a bent flex sensor")
    DRIFT = (State.DEGRADED, "resting readings have drifted from the calibration")
    RATE = (State.DEGRADED, "samples do not come at the expected rate")
    LATE_ANSWERS = (State.DEGRADED, "servos answer late")
    SUPPLY_UNKNOWN = (State.DEGRADED, "the supply cannot be read")
    SUPPLY_WARN = (State.DEGRADED, "the supply is nearly empty")
    STALE = (State.HOLD, "no fresh sample from the antenna board")
    REBOOT = (State.HOLD, "the antenna board has restarted")
    LOST = (State.HOLD, "no good reading for too long")
    STUCK = (State.HOLD, "a channel repeats one reading")
    NOISE = (State.HOLD, "noise hides what a flex sensor reads")
    OPEN = (
        State.HOLD,
        "a channel floats: its wire is open, or its flex sensor bent far beyond its calibration",
    )
    SHORT_LO = (State.HOLD, "a channel is shorted to ground, or its flex sensor torn off")
    SHORT_HI = (State.HOLD, "a channel is shorted to the supply")
    FAILED = (State.HOLD, "the controller raised an exception")
    UNDECIDED = (State.HOLD, "the controller took no decision in this tick")
    BAD_ACTION = (State.HOLD, "the controller asked for what does not exist")
    BAD_COMMAND = (State.HOLD, "a command of the controller was refused")
    UNKNOWN_CONTACT = (State.HOLD, "contact is not known")
    NO_RECORD = (State.HOLD, "no log is kept, and one is required")
    RELEASED = (State.HOLD, "hold a key, such as the space bar, to let it walk")
    SUPPLY_HOLD = (State.HOLD, "the supply is too low to walk")
    REPEATED_HOLDS = (State.FAULT, "too many holds in a short time")
    REPEATED_FAILURES = (State.FAULT, "the controller failed too often in a short time")
    REBOOT_LOOP = (State.FAULT, "the antenna board restarts again and again")
    SILENT_SERVO = (State.FAULT, "servos do not answer")
    SERVO_ERROR = (State.FAULT, "servos report a hardware error")
    BUS_ERROR = (State.FAULT, "the servo bus does not work")
    WATCHDOG = (State.FAULT, "watchdogs of servos have stopped them")
    DISARMED = (State.FAULT, "servos have lost their torque or their watchdog, as by a restart")
    NOT_FOLLOWING = (State.FAULT, "joints do not follow their goals")
    OUT_OF_LIMITS = (State.FAULT, "joints are beyond their limits")
    IMPOSSIBLE_SPEED = (State.FAULT, "joints seem to move faster than their servos can")
    WRONG_MODE = (State.FAULT, "servos are in another operating mode than they were given")
    NOT_READY = (State.FAULT, "something speaks against arming")
    PAUSE = (State.FAULT, "the loop stood still, or its clock did")
    SUPPLY_OFF = (State.OFF, "the supply is empty")
    NOT_ARMED = (State.OFF, "not armed yet")
    STOPPED = (State.OFF, "stopped by the operator")

    @property
    def severity(self) -> State:
        """The state it asks for."""
        return self.value[0]

    @property
    def text(self) -> str:
        """What it means."""
        return self.value[1]


OF_FINDING = {f: Cause[f.name] for f in Finding if f is not Finding.OK}
DATA = frozenset({Cause.STALE, Cause.REBOOT}) | {c for f, c in OF_FINDING.items() if not f.usable}
"""Losses of data: each ends after enough fresh valid samples in a row."""
OF_CONTROLLER = frozenset(
    {Cause.FAILED, Cause.UNDECIDED, Cause.BAD_ACTION, Cause.BAD_COMMAND, Cause.UNKNOWN_CONTACT}
)
"""Causes in the controller: each ends as soon as its decision is valid again."""
OF_JOINTS = frozenset(
    {Cause.NOT_FOLLOWING, Cause.OUT_OF_LIMITS, Cause.IMPOSSIBLE_SPEED, Cause.WRONG_MODE}
)
"""Causes that are looked for while servos have torque, and anew from each arm event on."""
CURED_BY_ARMING = OF_JOINTS | {Cause.UNKNOWN_CONTACT, Cause.WATCHDOG, Cause.DISARMED}
"""Causes that do not prevent an arm event."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """Inputs of the supervisor in one tick, after the controller's step.

    None has a default: one that is forgotten is an error in the first tick, not health.

    Attributes:
        age: Age of the newest valid sample [s]; inf if there is none.
        valid: Valid samples that arrived since the tick before, without those that were too old.
        refused: Samples since then that were not valid.
        findings: Of the left and the right channel.
        noise: Size and frequency of the noise of a channel that is NOISE, left and right.
        decided_at: Time at which the controller finished its newest decision [s].
        maneuver: That decision.
        contact: The contact that it was decided on, left and right.
        bad_command: Why its command must not be sent, empty if it may.
        failure: Text of an exception of the controller in this tick, empty if none.
        resets: Restarts of the antenna board so far.
        reset_reason: Why it last restarted, as far as known.
        board_error: What is wrong with its port, empty if nothing is.
        missed: Answers missed in a row, by servo id; ids without any may be left out.
        servo_errors: Hardware errors in words, by servo id.
        bus_error: What is wrong with the bus as a whole, empty if nothing is.
        watchdogs: Ids of servos stopped by their watchdog.
        disarmed: Ids of servos that have lost their torque or their watchdog while armed.
        supply: Voltage of the supply [V], NaN if unknown.
        behind: Joints that do not follow their goals, in words by servo id.
        outside: Joints beyond their limits, likewise.
        leaps: Joints that have moved faster than they can, likewise.
        modes: Servos in a wrong operating mode, likewise.
        drift: How far resting readings have drifted, empty if not far.
        objections: Reasons not to arm, such as a failed touch check or unknown firmware.
        unrecorded: Whether a record that is required is not kept.
        stop: Whether the operator wants the torque off.
        released: Whether the key that lets the robot walk is not held.
        arm: Whether the operator wants it on; only the change to True in FAULT or OFF counts.
    """

    age: float
    valid: int
    refused: int
    findings: tuple[Finding, Finding]
    noise: tuple[str, str]
    decided_at: float
    maneuver: int
    contact: tuple[int, int]
    bad_command: str
    failure: str
    resets: int
    reset_reason: str
    board_error: str
    missed: Mapping[int, int]
    servo_errors: Mapping[int, str]
    bus_error: str
    watchdogs: tuple[int, ...]
    disarmed: tuple[int, ...]
    supply: float
    behind: Mapping[int, str]
    outside: Mapping[int, str]
    leaps: Mapping[int, str]
    modes: Mapping[int, str]
    drift: str
    objections: tuple[str, ...]
    unrecorded: bool
    stop: bool
    released: bool
    arm: bool


@dataclass(frozen=True, slots=True)
class Active:
    """A cause in force.

    Attributes:
        since: When it began [s].
        detail: Side, ids or reason; may be empty.
        present: Whether it is still there; if not, it is latched or waits for fresh samples.
    """

    cause: Cause
    since: float
    detail: str
    present: bool

    @property
    def text(self) -> str:
        """One line for the status."""
        detail = f" ({self.detail})" if self.detail else ""
        return f"{self.cause.severity.name} {self.cause.name}: {self.cause.text}{detail}"


@dataclass(frozen=True, slots=True)
class Outputs:
    """What the tick may do.

    Attributes:
        move: Whether the command just decided may be sent; if not, the last one sent stays.
        arming: True in the one tick of an accepted arm event: clear the watchdogs, set all goals to
            the present positions, then switch the torque on.
        feed_watchdog: Whether the watchdogs of the servos may be fed: only upon a decision taken in
            this very tick.
        clear: Whether data and actuators are well and the torque on. While it is False the
            controller gets NaN for counts in the next tick, so that its gait stands still.
        causes: All causes in force, the most severe first. Of equal ones those that explain first:
            losses of data, those still there before those that only wait for fresh samples; then
            others; then those of the controller; the oldest of each first.
        refusal: Why an arm event of this tick was not accepted, empty if it was or none came.
    """

    state: State
    move: bool
    torque: bool
    arming: bool
    feed_watchdog: bool
    clear: bool
    causes: tuple[Active, ...]
    refusal: tuple[Cause, ...]
