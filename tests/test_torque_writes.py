"""Exactly one module writes torque, watchdogs and goals, whatever command runs."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import pytest
from stated import stated
from test_robot_commands_read import RUNS, SHORT, driven
from test_turns import Walk
from torque_writes import GOAL, TORQUE, Written, watch

from antennate.hardware.config import DriveConfig
from antennate.hardware.safety import torque
from dynamixel_bus.bus import Bus

PWM, PROFILE, DOG = 100, 108, 98
EXPECTED = {
    "drive": {TORQUE, DOG, PWM, PROFILE, GOAL},
    "teleop": {TORQUE, DOG, PWM, PROFILE, GOAL},
    "jog": {TORQUE, DOG, PWM, PROFILE, GOAL},
    "setup": {TORQUE},
    "zero": {TORQUE},
    "doctor": {TORQUE},
}
"""What each command writes at least."""


def of(command: str, folder: Path, patch: pytest.MonkeyPatch) -> list[Written]:
    """What a command wrote."""
    patch.chdir(folder)
    with pytest.MonkeyPatch.context() as inner, contextlib.redirect_stdout(io.StringIO()):
        seen = watch(inner)
        if command == "drive":
            driven(inner, DriveConfig(**SHORT, touch_check=False, robot=stated()), folder / "run")
        else:
            model, run, settings = RUNS[command]
            robot = {"robot": stated()} if command == "teleop" else {}
            run(inner, model.model_validate(settings[0] | robot), folder)
    return seen


@pytest.mark.parametrize(
    "command",
    [pytest.param(c, marks=pytest.mark.ci if c in ("drive", "teleop") else ()) for c in EXPECTED],
)
def test_one_module_writes_torque_and_goals(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = of(command, tmp_path, monkeypatch)
    assert {written.caller for written in seen} == {torque.__name__}
    assert {written.address for written in seen} >= EXPECTED[command]
    on = any(written.torque_on for written in seen)
    assert on == (GOAL in EXPECTED[command])


def test_one_module_writes_them_while_legs_forget_their_turns(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = watch(monkeypatch)
    walk = Walk(250, duration=1.5)
    assert walk.rig.session.actuators.turns.forgotten > 0
    assert {written.caller for written in seen} == {torque.__name__}
    assert sum(written.torque_on for written in seen) > 1


def test_a_write_by_another_module_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """As `jog` did: the test itself writes a goal."""
    monkeypatch.setattr(torque, "send_goals", lambda bus, goals: _send(bus, goals))
    seen = watch(monkeypatch)
    Walk(0, duration=0.1)
    assert {written.caller for written in seen} == {torque.__name__, __name__}


def _send(bus: Bus, goals: dict[int, int]) -> None:
    bus.write_all(
        GOAL, {servo: goal.to_bytes(4, "little", signed=True) for servo, goal in goals.items()}
    )
