"""A robot by keys, through session, supervisor and bytes, in invented time."""

from __future__ import annotations

import math
import os
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from twin_rig import rig

from antennate.cli.keys import keys_of
from antennate.errors import BadInputError
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.teleop import Gamepad, KeyController
from antennate.hardware.safety.session import Session
from antennate.params.control import ControlParams
from antennate.params.hardware import TeleopParams
from antennate.twin.config import TwinConfig
from antennate.types import AntennaFrame, Maneuver, State

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


@pytest.mark.ci
def test_keys_walk_the_twin_and_q_ends_it_with_the_torque_off() -> None:
    made = rig(TwinConfig())
    begin = made.clock.now()
    keyboard = Keyboard(*[(t, "w") for t in np.arange(1.0, 4.0, 0.1)], (6.0, "q"))
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


class Pad:
    """A pad's device file in a folder, with the clock of its reader; one axis at rest at first."""

    def __init__(self, folder: Path) -> None:
        self.path, self.t = folder / "js0", 0.0
        os.mkfifo(self.path)
        self.ends = [os.open(self.path, os.O_RDWR)]
        self.event(0x82, 0, 0)
        self.reader = Gamepad(self.path, lambda: self.t, 2.0)

    def event(self, kind: int, number: int, value: int) -> None:
        """One event of the kernel: time, value, kind (1 button, 2 axis, 128 state), number."""
        os.write(self.ends[0], struct.pack("<IhBB", 0, value, kind, number))

    def write(self, data: bytes) -> None:
        os.write(self.ends[0], data)

    def unplug(self) -> None:
        os.close(self.ends.pop())


@pytest.fixture
def pad(tmp_path: Path) -> Iterator[Pad]:
    made = Pad(tmp_path)
    yield made
    made.reader.close()
    while made.ends:
        made.unplug()


def test_a_gamepad_gives_the_same_keys(pad: Pad) -> None:
    assert pad.reader.keys() == [" "]
    pad.event(1, 5, 1)
    pad.event(2, 1, -32767)
    assert pad.reader.keys() == ["up"]
    assert pad.reader.keys() == ["up"]  # while it is pushed
    pad.event(2, 1, 0)
    pad.event(2, 6, 32767)
    assert pad.reader.keys() == ["right"]
    pad.event(2, 6, 0)
    button = struct.pack("<IhBB", 9, 1, 1, 0)
    pad.write(button[:5])
    assert pad.reader.keys() == [" "]
    pad.write(button[5:])
    assert pad.reader.keys() == ["o", " "]


@pytest.mark.parametrize("button", [4, 5])
def test_a_stick_without_its_dead_mans_button_stands(button: int, pad: Pad) -> None:
    pad.event(0x81, button, 1)  # held before: it has to be pressed anew
    pad.event(2, 1, -32767)
    assert pad.reader.keys() == [" "]
    pad.event(1, button, 1)
    assert pad.reader.keys() == ["up"]
    pad.event(1, button, 0)
    assert pad.reader.keys() == [" "]


def test_a_pad_that_freezes_walks_for_two_seconds_at_most(pad: Pad) -> None:
    pad.event(1, 4, 1)
    pad.event(2, 1, -32767)
    assert pad.reader.keys() == ["up"]
    pad.t = 1.9
    assert pad.reader.keys() == ["up"]
    pad.t = 2.1
    assert pad.reader.keys() == [" "]
    pad.event(2, 1, -32000)
    assert pad.reader.keys() == ["up"]


def test_a_pad_that_is_unplugged_or_sends_nonsense_ends_the_drive(pad: Pad) -> None:
    pad.event(1, 4, 1)
    pad.event(2, 1, -32767)
    assert pad.reader.keys() == ["up"]
    pad.event(7, 1, -32767)
    assert pad.reader.keys() == ["end"]
    pad.unplug()
    assert pad.reader.keys() == ["end"]


def test_what_is_no_joystick_is_refused_at_once(tmp_path: Path) -> None:
    text = tmp_path / "notes"
    text.write_text("no joystick at all")
    silent = tmp_path / "silent"
    os.mkfifo(silent)
    for path in (Path("/dev/zero"), Path("/dev/null"), text, silent, tmp_path):
        with pytest.raises(BadInputError, match=f"--gamepad: expected a joystick .* found {path}"):
            Gamepad(path, lambda: 0.0, 2.0)
    with pytest.raises(FileNotFoundError):
        Gamepad(tmp_path / "none", lambda: 0.0, 2.0)
