"""A robot by keys, through session, supervisor and bytes, in invented time."""

from __future__ import annotations

import math
import os
import struct
from pathlib import Path

import numpy as np
import pytest
from twin_rig import rig

from antennate.cli.keys import keys_of
from antennate.hardware.driving.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.gamepad import Gamepad
from antennate.hardware.driving.session import Session
from antennate.hardware.driving.teleop import KeyController
from antennate.hardware.safety.causes import State
from antennate.params.control import ControlParams
from antennate.params.setup import TeleopParams
from antennate.twin.config import TwinConfig
from antennate.types import AntennaFrame, Maneuver

FREE = AntennaFrame(t=np.zeros(1), counts=np.full((1, 2), 1872.0))
NOTHING = AntennaFrame(t=np.zeros(1), counts=np.full((1, 2), math.nan))


class Keyboard:
    """Keys at their times [s]."""

    def __init__(self, *keys: tuple[float, str]) -> None:
        self.left, self.t = list(keys), 0.0

    def now(self) -> float:
        return self.t

    def keys(self) -> list[str]:
        came = [key for when, key in self.left if when <= self.t]
        self.left = [pair for pair in self.left if pair[0] > self.t]
        return came


def controller(keyboard: Keyboard) -> KeyController:
    spec = rig(TwinConfig()).session.actuators.robot
    return KeyController(ControlParams(), spec, TeleopParams(), keyboard.keys, keyboard.now)


@pytest.mark.parametrize(
    ("key", "maneuver"),
    [
        ("up", Maneuver.FORWARD),
        ("w", Maneuver.FORWARD),
        ("left", Maneuver.TURN_L),
        ("a", Maneuver.TURN_L),
        ("right", Maneuver.TURN_R),
        ("d", Maneuver.TURN_R),
        ("down", Maneuver.REVERSE),
        ("s", Maneuver.REVERSE),
        ("x", Maneuver.HOLD),
    ],
)
def test_a_key_is_its_maneuver_for_half_a_second(key: str, maneuver: Maneuver) -> None:
    keyboard = Keyboard((0.5, key))
    control = controller(keyboard)
    seen: list[int] = []
    for tick in range(120):
        keyboard.t = 0.01 * tick
        control.step(FREE)
        seen.append(int(control.maneuver[0]))
    walks = [tick for tick, one in enumerate(seen) if one == maneuver != Maneuver.HOLD]
    assert walks == ([] if maneuver is Maneuver.HOLD else list(range(50, 101)))
    assert set(seen) <= {Maneuver.HOLD, maneuver}


def test_a_reading_that_cannot_be_used_never_walks() -> None:
    keyboard = Keyboard((0.0, "w"))
    control = controller(keyboard)
    control.step(NOTHING)
    assert control.maneuver[0] == Maneuver.HOLD


def test_the_antennae_oscillate_until_told_again_and_stay_where_they_are() -> None:
    """Amplitude 0.35 rad at 0.5 Hz: the first top is after half a second."""
    keyboard = Keyboard((0.0, "o"), (0.5, "o"))
    control = controller(keyboard)
    angles: list[float] = []
    for tick in range(100):
        keyboard.t = 0.01 * tick
        angles.append(float(control.step(FREE).antenna[0, 0]))
    assert angles[49] == pytest.approx(0.35, abs=1e-3)
    assert np.ptp(angles[50:]) == 0.0
    assert np.diff(angles[:50]).max() < 0.35 * math.pi * 0.01 * 1.01


def test_keys_walk_the_twin_and_q_ends_it_with_the_torque_off() -> None:
    made = rig(TwinConfig())
    begin = made.clock.now()
    keyboard = Keyboard(*[(t, "w") for t in np.arange(3.0, 9.0, 0.1)], (11.0, "q"))
    keyboard.now = lambda: made.clock.now() - begin  # type: ignore[method-assign]

    def keys() -> list[str]:
        keyboard.t = keyboard.now()
        return Keyboard.keys(keyboard)

    robot = made.session.actuators.robot
    made.session.control.controller = KeyController(
        ControlParams(), robot, TeleopParams(), keys, keyboard.now
    )
    maneuvers: list[int] = []
    legs: list[int] = []

    def note(session: Session, now: float) -> None:
        maneuvers.append(session.control.decision.maneuver)
        legs.append(made.robot.servos[5].get("goal_position"))

    orders = DriveConfig(dry_run=0.5, touch_check=False, stand=0.1)
    report = drive(made.session, orders, arm=True, on_tick=note)
    assert report.on == []
    assert report.ended == "a key"
    assert report.worst <= State.HOLD  # before contact is known
    walked = [tick for tick, one in enumerate(maneuvers) if one == Maneuver.FORWARD]
    assert len(walked) > 300
    after = legs[walked[-1] + 5 :]
    assert len(after) > 100
    assert max(after) == min(after)  # it stands once no key comes
    assert not any(servo.torque for servo in made.robot.servos)


def test_bytes_of_a_terminal_are_keys() -> None:
    """Arrows are ESC [ A to D (ECMA-48), or ESC O A to D in application mode."""
    assert keys_of(b"\x1b[Aw\x1bOD q\n\x1b[C") == ["up", "w", "left", " ", "q", "right"]


def test_a_gamepad_gives_the_same_keys(tmp_path: Path) -> None:
    """Events of the kernel's interface: time, value, kind (1 button, 2 axis, 128 first), number."""
    path = tmp_path / "js0"
    os.mkfifo(path)
    reader = Gamepad(path)
    with path.open("wb", buffering=0) as pad:
        pad.write(struct.pack("<IhBB", 0, 0, 0x82, 1) + struct.pack("<IhBB", 1, 0, 0x81, 0))
        assert reader.keys() == []
        pad.write(struct.pack("<IhBB", 5, -32767, 2, 1))
        assert reader.keys() == ["up"]
        assert reader.keys() == ["up"]  # while it is pushed
        pad.write(struct.pack("<IhBB", 6, 0, 2, 1) + struct.pack("<IhBB", 7, 32767, 2, 6))
        assert reader.keys() == ["right"]
        pad.write(struct.pack("<IhBB", 8, 0, 2, 6) + struct.pack("<IhBB", 9, 1, 1, 0)[:5])
        assert reader.keys() == []
        pad.write(struct.pack("<IhBB", 9, 1, 1, 0)[5:])
        assert reader.keys() == ["o"]
        pad.write(struct.pack("<IhBB", 10, 32767, 2, 0))
        assert reader.keys() == ["right"]
    assert reader.keys() == []  # it is unplugged
    reader.close()
