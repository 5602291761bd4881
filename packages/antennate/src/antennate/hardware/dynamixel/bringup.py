"""Which servos are there, and whether they are fit to get torque; nothing is written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from antennate.hardware.actuators import ActuatorError
from antennate.hardware.safety.deadlines import READ_OUTSIDE
from dynamixel_bus import inquiry
from dynamixel_bus.bus import Bus
from dynamixel_bus.inquiry import Present, State
from dynamixel_bus.model import Register
from dynamixel_bus.models import XC430_W240, model_name

_READS = 10
"""Tries until a servo is given up that is asked: 1 s, so that a computer which stands still for a
while is no silent servo (assumed)."""
_OWN_ID = "leave one of them alone on the bus and give it its own id with `antennate setup`"
CURE: Mapping[State, str] = {
    "ok": "",
    "broken": f"look at its cable and plugs; if there are two, {_OWN_ID}",
    "collides": _OWN_ID,
    "mute": "switch its supply off and on",
}
"""What a person does about it."""


class BringUpError(ActuatorError):
    """The servos are not fit to be moved; says which and why.

    Attributes:
        cure: What a person does about it, empty if that is not known; the text ends with it.
    """

    def __init__(self, text: str, cure: str = "") -> None:
        super().__init__(f"{text}; {cure}" if cure else text)
        self.cure = cure


def require(bus: Bus, expected: Mapping[int, int]) -> None:
    """Whether the servos of these model numbers by id are on the bus, and nothing else."""
    seen = {i: inquiry.look(bus, i) for i in expected}
    doubled = [i for i, servo in seen.items() if servo and servo.state in ("collides", "broken")]
    perhaps = f", perhaps it answers as {', '.join(map(str, doubled))}" if doubled else ""
    faults = {i: _fault(seen[i], model, f"silent{perhaps}") for i, model in expected.items()}
    strangers = {status.id for status in bus.scan()} - faults.keys()
    faults |= dict.fromkeys(sorted(strangers), "not expected")
    wrong: dict[str, list[int]] = {}
    for servo, fault in faults.items():
        if fault:
            wrong.setdefault(fault, []).append(servo)
    if wrong:
        fit = len(faults) - sum(map(len, wrong.values()))
        why = "; ".join(f"{_named(ids, len(expected))}: {fault}" for fault, ids in wrong.items())
        states = {servo.state for servo in seen.values() if servo and servo.state != "ok"}
        raise BringUpError(
            f"expected {len(expected)} servos, found {fit} fit; {why}",
            "; ".join(cure for state, cure in CURE.items() if state in states),
        )


def _named(ids: Sequence[int], count: int) -> str:
    if len(ids) == count > 1:
        return f"all {count}"
    return f"id{'s' if len(ids) > 1 else ''} {', '.join(map(str, ids))}"


def require_models(bus: Bus, models: Mapping[int, int]) -> None:
    """All ids answer with these model numbers: a glance of some ms, unlike `require`."""
    numbers = read_register(bus, list(models), XC430_W240["model_number"])
    if wrong := {i: numbers[i] for i, model in models.items() if numbers[i] != model}:
        wanted = {i: models[i] for i in wrong}
        raise BringUpError(f"expected model numbers {wanted} by id, found {wrong}")


def require_modes(bus: Bus, modes: Mapping[int, int]) -> None:
    """All ids are in these operating modes: another program may have changed one since."""
    present = read_register(bus, list(modes), XC430_W240["operating_mode"])
    if wrong := {i: present[i] for i, mode in modes.items() if present[i] != mode}:
        wanted = {i: modes[i] for i in wrong}
        raise BringUpError(f"expected operating modes {wanted} by id, found {wrong}")


def read_register(bus: Bus, ids: Sequence[int], register: Register) -> dict[int, int]:
    """One register of each servo."""
    values = inquiry.read_some(bus, ids, register, _READS, READ_OUTSIDE)
    if left := [servo for servo in ids if servo not in values]:
        raise BringUpError(f"could not read {register.name} of servos {left}")
    return values


def _fault(present: Present | None, model: int, silent: str) -> str:
    """What is wrong with a servo, empty if nothing is; `silent` of one that does not answer."""
    if present is None:
        return silent
    if present.model not in (None, model):
        return f"expected model {model_name(model)}, found number {present.model}"
    return inquiry.FOUND[present.state]
