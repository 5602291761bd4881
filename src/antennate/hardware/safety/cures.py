"""What to do about each cause that makes a robot hold or takes its torque."""

from __future__ import annotations

import re
from collections.abc import Sequence
from types import MappingProxyType

from antennate.hardware.safety.causes import Cause

_ARM = "start `drive --arm` again"
_BUS = "check cables, plugs and supply of the servos (`antennate doctor`)"
_BOARD = "check cable, supply and network of the antenna board (`antennate doctor`)"
_WIRE = "check wires and plugs of that antenna (`antennate doctor`)"
_SUPPLY = "charge or change the battery"
_JOINT = "take the load off, turn that joint by hand without torque"
_CODE = "mend the controller; `tracebacks` in result.json says where it failed"

CURES = MappingProxyType(
    {
        Cause.SPIKY: f"{_WIRE}; keep them away from the cables of the servos",
        Cause.OUT_OF_CAL: "nothing while an antenna bends far; else calibrate again",
        Cause.SATURATED: "free the antenna; if it is free, calibrate again",
        Cause.DRIFT: "let the antenna rest; if it stays, calibrate again",
        Cause.RATE: _BOARD,
        Cause.LATE_ANSWERS: f"close other programs; {_BUS}",
        Cause.SUPPLY_UNKNOWN: f"{_BUS}; the first servo tells the voltage",
        Cause.SUPPLY_WARN: f"{_SUPPLY} soon",
        Cause.STALE: f"{_BOARD}; close other programs",
        Cause.REBOOT: _BOARD,
        Cause.LOST: _WIRE,
        Cause.STUCK: f"{_WIRE}; switch the antenna board off and on; if it is stuck at its highest "
        "reading alone, the attenuation of the converter is not set",
        Cause.NOISE: "keep the wires of that antenna away from mains, motors and servo cables; "
        "join the grounds of board, supply and computer; put 100 nF from the pin to ground; an "
        "open wire hums, too (`antennate doctor`)",
        Cause.OPEN: f"{_WIRE}; if it bends farther than when it was calibrated, calibrate again",
        Cause.SHORT_LO: f"{_WIRE}; is the flex sensor still on them?",
        Cause.SHORT_HI: f"{_WIRE}; where do they touch the supply?",
        Cause.FAILED: _CODE,
        Cause.UNDECIDED: "let the controller decide in every tick, in less than a control period",
        Cause.BAD_ACTION: "let the controller give one of the maneuvers",
        Cause.BAD_COMMAND: "let the controller give commands within the limits of the robot",
        Cause.UNKNOWN_CONTACT: "mend what is named beside it; if nothing is, the controller",
        Cause.NO_RECORD: "free space on the disk; or set `record_required = false`",
        Cause.RELEASED: "hold a key",
        Cause.SUPPLY_HOLD: _SUPPLY,
        Cause.REPEATED_HOLDS: f"mend what made it hold, then {_ARM}",
        Cause.REPEATED_FAILURES: _CODE,
        Cause.REBOOT_LOOP: _BOARD,
        Cause.SILENT_SERVO: f"close other programs; {_BUS}",
        Cause.SERVO_ERROR: "switch the servos off; free them, let them cool; is the supply right?",
        Cause.BUS_ERROR: f"check the adapter of the servo bus and its cable; {_BUS}",
        Cause.WATCHDOG: f"close other programs; then {_ARM}",
        Cause.DISARMED: f"{_BUS}; then {_ARM}",
        Cause.NOT_FOLLOWING: f"{_JOINT}; see if its gear or horn is loose; {_BUS}; then {_ARM}",
        Cause.OUT_OF_LIMITS: f"{_JOINT}; bring it back within its limits; then {_ARM}",
        Cause.IMPOSSIBLE_SPEED: f"change that servo if it happens again; {_BUS}; then {_ARM}",
        Cause.WRONG_MODE: "`antennate doctor --fix` sets it; does another program use the bus?",
        Cause.NOT_READY: "do what stands in its brackets",
        Cause.PAUSE: f"close other programs, let nothing suspend the computer; then {_ARM}",
        Cause.SUPPLY_OFF: _SUPPLY,
        Cause.NOT_ARMED: f"{_ARM}, if nothing else is named",
        Cause.STOPPED: _ARM,
    }
)
"""The likely cure of each cause."""
_NAMED = re.compile(r"\b(?:HOLD|FAULT|OFF) ([A-Z_]+): ")
_FOLLOW = (Cause.NOT_ARMED, Cause.UNKNOWN_CONTACT)
"""What follows from other causes; its cure counts if none is named."""


def what_to_do(why: str) -> list[str]:
    """What a person can do about what kept a robot from walking: one sentence, or none.

    Args:
        why: Causes as `Active.text` names them, in their order.
    """
    found = [Cause[name] for name in _NAMED.findall(why)]
    first = [cause for cause in found if cause not in _FOLLOW]
    cures = " ".join(_each_once([CURES[cause] for cause in dict.fromkeys(first or found)]))
    return [f"What to do: {cures} See docs/causes.md."] if cures else []


def _each_once(cures: Sequence[str]) -> list[str]:
    """Sentences of cures in which no step comes twice; to arm again comes last."""
    every = [step for cure in cures for step in cure.split("; ")]
    said = {step for step in every if any(each.startswith(f"{step}, ") for each in every)}
    told, last = list[str](), list[str]()
    for cure in cures:
        steps = [step for step in cure.split("; ") if step not in said]
        said.update(steps)
        last += [step for step in steps if step.startswith("then ")]
        if steps := [step for step in steps if not step.startswith("then ")]:
            told.append("; ".join(steps))
    if last:
        told[-1] = "; ".join([*told[-1:], *last])
    return [f"{text[0].upper()}{text[1:]}{'' if text[-1] in '?.' else '.'}" for text in told]
