"""Causes that ask for a state of the supervisor, and what to do about each."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from antennate.hardware.safety.channel import Finding
from antennate.types import State

_ARM = "start `drive --arm` again"
_BUS = "check cables, plugs and supply of the servos (`antennate doctor`)"
_BOARD = "check cable, supply and network of the antenna board (`antennate doctor`)"
_WIRE = "check wires and plugs of that antenna (`antennate doctor`)"
_SUPPLY = "charge or change the battery"
_JOINT = "take the load off, turn that joint by hand without torque"
_CODE = "mend the controller; `tracebacks` in result.json says where it failed"


class Cause(Enum):
    """What can be wrong: the state it asks for, what it means, and the likely cure."""

    SPIKY = (
        State.DEGRADED,
        "many readings are bad",
        f"{_WIRE}; keep them away from the cables of the servos",
    )
    OUT_OF_CAL = (
        State.DEGRADED,
        "readings lie beyond the calibrated range",
        "nothing while an antenna bends far; else calibrate again",
    )
    SATURATED = (
        State.DEGRADED,
        "readings are at the rail of a bent flex sensor",
        "free the antenna; if it is free, calibrate again",
    )
    DRIFT = (
        State.DEGRADED,
        "resting readings have drifted from the calibration",
        "let the antenna rest; if it stays, calibrate again",
    )
    IMU = (
        State.DEGRADED,
        "the inertial sensor gives nothing that can be used",
        "walk on without it; check its wires, its supply and the pins in firmware/config.py "
        "(`antennate doctor`)",
    )
    RATE = (State.DEGRADED, "samples do not come at the expected rate", _BOARD)
    LATE_ANSWERS = (State.DEGRADED, "servos answer late", f"close other programs; {_BUS}")
    SUPPLY_UNKNOWN = (
        State.DEGRADED,
        "the supply cannot be read",
        f"{_BUS}; the first servo tells the voltage",
    )
    SUPPLY_WARN = (State.DEGRADED, "the supply is nearly empty", f"{_SUPPLY} soon")
    STALE = (
        State.HOLD,
        "no fresh sample from the antenna board",
        f"{_BOARD}; close other programs",
    )
    REBOOT = (State.HOLD, "the antenna board has restarted", _BOARD)
    LOST = (State.HOLD, "no good reading for too long", _WIRE)
    STUCK = (
        State.HOLD,
        "a channel repeats one reading",
        f"{_WIRE}; switch the antenna board off and on; if it is stuck at its highest reading "
        "alone, the attenuation of the converter is not set",
    )
    NOISE = (
        State.HOLD,
        "noise hides what a flex sensor reads",
        "keep the wires of that antenna away from mains, motors and servo cables; join the grounds "
        "of board, supply and computer; put 100 nF from the pin to ground; an open wire hums, too "
        "(`antennate doctor`)",
    )
    OPEN = (
        State.HOLD,
        "a channel floats: its wire is open, or its flex sensor bent far beyond its calibration",
        f"{_WIRE}; if it bends farther than when it was calibrated, calibrate again",
    )
    SHORT_LO = (
        State.HOLD,
        "a channel is shorted to ground, or its flex sensor torn off",
        f"{_WIRE}; is the flex sensor still on them?",
    )
    SHORT_HI = (
        State.HOLD,
        "a channel is shorted to the supply",
        f"{_WIRE}; where do they touch the supply?",
    )
    FAILED = (State.HOLD, "the controller raised an exception", _CODE)
    UNDECIDED = (
        State.HOLD,
        "the controller took no decision in this tick",
        "let the controller decide in every tick, in less than a control period",
    )
    BAD_ACTION = (
        State.HOLD,
        "the controller asked for what does not exist",
        "let the controller give one of the maneuvers",
    )
    BAD_COMMAND = (
        State.HOLD,
        "a command of the controller was refused",
        "let the controller give commands within the limits of the robot",
    )
    UNKNOWN_CONTACT = (
        State.HOLD,
        "contact is not known",
        "mend what is named beside it; if nothing is, the controller",
    )
    NO_RECORD = (
        State.HOLD,
        "no log is kept, and one is required",
        "free space on the disk; or set `record_required = false`",
    )
    RELEASED = (State.HOLD, "hold a key, such as the space bar, to let it walk", "hold a key")
    SUPPLY_HOLD = (State.HOLD, "the supply is too low to walk", _SUPPLY)
    REPEATED_HOLDS = (
        State.FAULT,
        "too many holds in a short time",
        f"mend what made it hold, then {_ARM}",
    )
    REPEATED_FAILURES = (State.FAULT, "the controller failed too often in a short time", _CODE)
    REBOOT_LOOP = (State.FAULT, "the antenna board restarts again and again", _BOARD)
    SILENT_SERVO = (State.FAULT, "servos do not answer", f"close other programs; {_BUS}")
    SERVO_ERROR = (
        State.FAULT,
        "servos report a hardware error",
        "switch the servos off; free them, let them cool; is the supply right?",
    )
    BUS_ERROR = (
        State.FAULT,
        "the servo bus does not work",
        f"check the adapter of the servo bus and its cable; {_BUS}",
    )
    WATCHDOG = (
        State.FAULT,
        "watchdogs of servos have stopped them",
        f"close other programs; then {_ARM}",
    )
    DISARMED = (
        State.FAULT,
        "servos have lost their torque or their watchdog, as by a restart",
        f"{_BUS}; then {_ARM}",
    )
    NOT_FOLLOWING = (
        State.FAULT,
        "joints do not follow their goals",
        f"{_JOINT}; see if its gear or horn is loose; {_BUS}; then {_ARM}",
    )
    OUT_OF_LIMITS = (
        State.FAULT,
        "joints are beyond their limits",
        f"{_JOINT}; bring it back within its limits; then {_ARM}",
    )
    IMPOSSIBLE_SPEED = (
        State.FAULT,
        "joints seem to move faster than their servos can",
        f"change that servo if it happens again; {_BUS}; then {_ARM}",
    )
    WRONG_MODE = (
        State.FAULT,
        "servos are in another operating mode than they were given",
        "`antennate doctor --fix` sets it; does another program use the bus?",
    )
    NOT_READY = (State.FAULT, "something speaks against arming", "do what stands in its brackets")
    PAUSE = (
        State.FAULT,
        "the loop stood still, or its clock did",
        f"close other programs, let nothing suspend the computer; then {_ARM}",
    )
    SUPPLY_OFF = (State.OFF, "the supply is empty", _SUPPLY)
    NOT_ARMED = (State.OFF, "not armed yet", f"{_ARM}, if nothing else is named")
    STOPPED = (State.OFF, "stopped by the operator", _ARM)

    @property
    def severity(self) -> State:
        """The state it asks for."""
        return self.value[0]

    @property
    def text(self) -> str:
        """What it means."""
        return self.value[1]

    @property
    def cure(self) -> str:
        """What a person can do about it: steps, separated by semicolons."""
        return self.value[2]


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


_NAMED = re.compile(r"\b(?:HOLD|FAULT|OFF) ([A-Z_]+): ")
_FOLLOW = (Cause.NOT_ARMED, Cause.UNKNOWN_CONTACT)
"""What follows from other causes; its cure counts if none is named."""


def what_to_do(why: str) -> list[str]:
    """What a person can do about what kept a robot from walking: one sentence, or none.

    Args:
        why: Causes as `Active.text` names them, in their order.
    """
    named = [Cause[name] for name in _NAMED.findall(why)]
    first = [cause for cause in named if cause not in _FOLLOW]
    cures = " ".join(_sentences([cause.cure for cause in dict.fromkeys(first or named)]))
    return [f"What to do: {cures} See docs/causes.md."] if cures else []


def _sentences(cures: Sequence[str]) -> list[str]:
    """Sentences of cures in which no step comes twice; to arm again comes last."""
    steps = [step for cure in cures for step in cure.split("; ")]
    known = {step for step in steps if any(other.startswith(f"{step}, ") for other in steps)}
    texts, last = list[str](), list[str]()
    for cure in cures:
        new = [step for step in cure.split("; ") if step not in known]
        known.update(new)
        last += [step for step in new if step.startswith("then ")]
        if new := [step for step in new if not step.startswith("then ")]:
            texts.append("; ".join(new))
    if last:
        texts[-1] = "; ".join([*texts[-1:], *last])
    return [f"{text[0].upper()}{text[1:]}{'' if text[-1] in '?.' else '.'}" for text in texts]
