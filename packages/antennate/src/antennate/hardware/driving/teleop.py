"""A controller whose maneuvers come from keys or a gamepad, under the same supervisor.

It holds while a reading cannot be used, as other controllers do, and when no key has come for a
while.

A gamepad of Linux is read from its device file without any library: eight bytes an event, time
[ms], value, kind and number, as in https://docs.kernel.org/input/joydev/joystick-api.html. The
first stick or the cross gives the maneuver while a shoulder button is held, any other button the
oscillation. The kernel sends changes only, so a radio pad that lost its radio looks like one that
is held still. The shoulder button is a dead man's switch for the hand; for the radio there is a
longest time without any event.
"""

from __future__ import annotations

import math
import os
import select
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from antennate.control.rule_controller import RuleController
from antennate.errors import BadInputError
from antennate.params.control import ControlParams
from antennate.params.hardware import TeleopParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Bools, Contact, Floats, Ints, JointCommand, Maneuver

_EVENT = struct.Struct("<IhBB")
_BUTTON, _AXIS, _FIRST = 0x01, 0x02, 0x80
_HALF = 16_384
"""Half of the travel of a stick; beyond it the stick counts as pushed."""
_CROSS = (6, 7)
"""Axes of the cross of most pads; the first stick has 0 and 1."""
SHOULDERS = (4, 5)
"""Buttons, one of which has to be held, L1 and R1 of most pads (assumed; `jstest` shows yours)."""
_CHUNKS = 16
"""Reads of 64 events in one call: more than a pad sends in a period (assumed)."""
_GREETING = 0.5
"""Time for the states that the kernel sends at once [s] (assumed)."""
STAND, GONE = " ", "end"


class Gamepad:
    """Keys of a gamepad; a stick that is pushed repeats its key with every reading.

    Args:
        path: Its device file, such as /dev/input/js0.
        clock: Monotonic time [s].
        silence: Time without an event after which nothing counts as held [s].
    """

    def __init__(self, path: Path, clock: Callable[[], float], silence: float) -> None:
        self._axes: dict[int, int] = {}
        self._held: set[int] = set()
        self._rest, self._clock, self._silence = b"", clock, silence
        self._newest = clock()
        self._handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        if not self._greeted():
            os.close(self._handle)
            raise BadInputError(
                f"--gamepad: expected a joystick device, such as /dev/input/js0, found {path}, "
                "which does not begin with the state of its buttons and sticks"
            )

    def keys(self) -> list[str]:
        """What is asked for now.

        An arrow's name while a stick is pushed and a shoulder button is held, else a space (stand);
        `o` for each other button that went down; `end` alone if the pad is gone.
        """
        keys: list[str] = []
        for _ in range(_CHUNKS):
            data = self._read()
            if data is None:
                return [GONE]
            if not data:
                break
            whole = len(data) - len(data) % _EVENT.size
            self._rest = data[whole:]
            for _, value, kind, number in _EVENT.iter_unpack(data[:whole]):
                if not self._take(value, kind, number, keys):
                    return [GONE]
        return [*keys, self._wanted()]

    def close(self) -> None:
        """Close it."""
        os.close(self._handle)

    def _greeted(self) -> bool:
        """Whether the first event is a state, as every joystick sends it when it is opened."""
        if not select.select([self._handle], [], [], _GREETING)[0]:
            return False
        data = self._read() or b""
        if len(data) < _EVENT.size or len(data) % _EVENT.size:
            return False
        events = list(_EVENT.iter_unpack(data))
        if events[0][2] not in (_FIRST | _BUTTON, _FIRST | _AXIS):
            return False
        return all(self._take(value, kind, number, []) for _, value, kind, number in events)

    def _take(self, value: int, kind: int, number: int, keys: list[str]) -> bool:
        """Take an event; False if it is none of a joystick.

        A button counts as held only if it went down while the pad was open.
        """
        if kind & ~_FIRST == _AXIS:
            self._axes[number] = value
        elif kind & ~_FIRST != _BUTTON:
            return False
        elif number in SHOULDERS:
            if not value:
                self._held.discard(number)
            elif kind == _BUTTON:
                self._held.add(number)
        elif value and kind == _BUTTON:
            keys.append("o")
        return True

    def _read(self) -> bytes | None:
        """Bytes that have come, with those of a broken event before; None if the pad is gone."""
        try:
            data = os.read(self._handle, 64 * _EVENT.size)
        except BlockingIOError:
            return b""
        except OSError:
            return None
        if not data:
            return None
        self._newest = self._clock()
        return self._rest + data

    def _wanted(self) -> str:
        """The arrow into whose direction a stick is pushed most, if a hand is there."""
        if not self._held or self._clock() - self._newest > self._silence:
            return STAND
        ways: dict[str, int] = {}
        for across, along in ((0, 1), _CROSS):
            x, y = self._axes.get(across, 0), self._axes.get(along, 0)
            for name, way in (("left", -x), ("right", x), ("up", -y), ("down", y)):
                ways[name] = max(way, ways.get(name, 0))
        name, way = max(ways.items(), key=lambda item: item[1])
        return name if way > _HALF else STAND


KEYS = {
    "up": Maneuver.FORWARD,
    "w": Maneuver.FORWARD,
    "left": Maneuver.TURN_L,
    "a": Maneuver.TURN_L,
    "right": Maneuver.TURN_R,
    "d": Maneuver.TURN_R,
    "down": Maneuver.REVERSE,
    "s": Maneuver.REVERSE,
    " ": Maneuver.HOLD,
}
"""Maneuvers by key."""
OSCILLATE = "o"
"""The key that starts the oscillation of the antennae, and stops it."""


QUIT = ("q", "end")
"""Keys that end the drive; `end` stands for the end of the input."""


class KeyRule:
    """The rule of a controller: the maneuver of the keys.

    Attributes:
        wanted: That maneuver, of the newest key if it came a short time ago.
    """

    def __init__(self, control: ControlParams) -> None:
        self.turn_offset = control.gait.turn_offset
        self.wanted = Maneuver.HOLD

    def reset(self, rows: Ints | Bools) -> None:
        """Do nothing: there is no memory."""

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """The maneuver of the keys; HOLD where a reading cannot be used."""
        unknown = (contact == int(Contact.UNKNOWN)).any(axis=1)
        return np.where(unknown, int(Maneuver.HOLD), int(self.wanted))


class KeyController(RuleController):
    """The controller of one robot by keys.

    Args:
        control: Numbers of the control.
        robot: The robot.
        params: How long a key lasts, how the antennae oscillate.
        keys: Keys that have come since the last call.
        clock: The host's time [s].
    """

    def __init__(
        self,
        control: ControlParams,
        robot: RobotSpec,
        params: TeleopParams,
        keys: Callable[[], list[str]],
        clock: Callable[[], float],
    ) -> None:
        self._by_keys = KeyRule(control)
        super().__init__(self._by_keys, control, robot, 1)
        self._params, self._keys, self._clock = params, keys, clock
        self._asked, self._pressed_at = Maneuver.HOLD, -math.inf
        self._oscillating = False
        self._middle = control.gait.antenna_mean
        self._swing = 2.0 * math.pi * params.oscillation_frequency * control.period
        self._phase = 0.0

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Forget everything and start the gait at a phase [rad]."""
        super().reset(rows, phase)
        self._phase = 0.0

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the command for this frame."""
        for key in self._keys():
            self._press(key)
        recent = self._clock() - self._pressed_at <= self._params.release
        self._by_keys.wanted = self._asked if recent else Maneuver.HOLD
        command = super().step(frame)
        if self._oscillating:
            self._phase += self._swing
        angle = self._middle + self._params.oscillation_amplitude * math.sin(self._phase)
        return replace(command, antenna=np.full((1, 2), angle))

    def _press(self, key: str) -> None:
        """Take a key; one without a meaning is ignored."""
        if key in QUIT:
            raise KeyboardInterrupt("a key" if key == "q" else "the end of the keys")
        if key in KEYS:
            self._asked, self._pressed_at = KEYS[key], self._clock()
        elif key == OSCILLATE:
            self._oscillating = not self._oscillating
