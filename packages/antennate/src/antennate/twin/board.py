"""The antenna board of the twin: touches of its antennae, its converter, and its frames over UDP.

Before the physics begins only readings change; `hands` bends the antennae of a robot with torque.
Orders:

- `left@2s` bends the left antenna for a second, 2 s after a client has begun;
- `left:20mm@2s` holds it from then on as a ruler beside it is read: its tip pushed 20 mm aside;
- `left:10mm:60mm@2s` likewise 10 mm aside at 60 mm from its base;
- `left:60deg@2s` likewise by the sum of its hinge angles; 0mm or 0deg lets go;
- while the twin runs, `left`, `left:20mm` and so on, at once.
"""

from __future__ import annotations

import math
import re
import socket
import struct
import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from antennate.antenna.sensor import counts
from antennate.antenna.statics import Chain, equilibrium, shape
from antennate.errors import BadInputError
from antennate.hardware.esp32 import datagram, frame
from antennate.hardware.esp32.frame import FULL_SCALE
from antennate.robots.antenna import AntennaSpec
from antennate.robots.imu import AXES, ImuParams, noise_of
from antennate.types import Floats

SIDES = ("left", "right")
_STICKY_NOISE = 9.35
"""Noise of a converter whose codes stick [counts]: 45 readings of github.com/espressif/esp-idf
issue 164."""
_STICKY_SHARE = 0.8
"""Share of its readings that go to the nearest fourth code; with chance it makes the 38 of 45."""
_STICKY_CODE = 3
"""The remainder of those codes by 4."""


class Converter:
    """Makes codes of both readings.

    Args:
        seed: Of its chance.
        mains: Frequency of what hums [Hz].

    Attributes:
        mains: That frequency.
        wires: What is wrong with the wire of each antenna: "open", "short", "stuck", or nothing.
        held: Readings at which somebody holds the antennae [counts], NaN for none.
        hum: Amplitude of the hum on both readings [counts].
        drift: Change of both readings since it began [counts/s].
        plateau: Highest code; below the full scale as if an attenuation were not set.
        sticky: Noise of 9 counts, and most codes the same modulo 4.
        radio_noise: Standard deviation of the noise while the radio sends [counts].
        radio: Whether the board sends by radio.
    """

    def __init__(self, seed: int, mains: float) -> None:
        self._chance, self.mains = np.random.default_rng(seed), mains
        self.wires = ["", ""]
        self.held = [math.nan, math.nan]
        self.hum = self.radio_noise = self.drift = 0.0
        self.plateau = float(FULL_SCALE)
        self.sticky = self.radio = False
        self._drifted = self._t = 0.0
        self._stuck = [math.nan, math.nan]

    def set(self, what: str, size: float) -> None:
        """Begin a fault by its name, of a size [counts or counts/s]."""
        kind, _, side = what.rpartition("_")
        if what in SIDES:
            self.held[SIDES.index(what)] = size
        elif side in SIDES:
            self.wires[SIDES.index(side)] = kind
        else:
            setattr(self, what, True if what == "sticky" else size)

    def codes(self, t: float, readings: Floats, noise: Floats) -> tuple[int, int]:
        """Codes at the time t [s] of exact readings (2,) and their noise (2,) [counts]."""
        self._drifted += self.drift * (t - self._t)
        self._t = t
        readings = np.where(np.isnan(self.held), readings, self.held) + noise + self._drifted
        readings = readings + self.hum * math.sin(2 * math.pi * self.mains * t + 1.0)
        if self.radio and self.radio_noise:
            readings = readings + self._chance.normal(0.0, self.radio_noise, 2)
        left, right = readings.tolist()
        return self._code(0, left), self._code(1, right)

    def _code(self, place: int, counts: float) -> int:
        wire = self.wires[place]
        if wire == "open":
            return int(self._chance.integers(FULL_SCALE + 1))
        if wire == "short" or math.isnan(counts):
            return 0
        if self.sticky:
            counts = self._stick(counts + self._chance.normal(0.0, _STICKY_NOISE))
        if wire != "stuck":
            return self._clamped(counts)
        if math.isnan(self._stuck[place]):
            self._stuck[place] = self._clamped(counts)
        return self._clamped(self._stuck[place] + self._chance.integers(-1, 2))

    def _clamped(self, counts: float) -> int:
        return min(max(round(counts), 0), int(self.plateau))

    def _stick(self, counts: float) -> float:
        if self._chance.random() >= _STICKY_SHARE:
            return counts
        return 4 * round((counts - _STICKY_CODE) / 4) + _STICKY_CODE


class ImuReadings:
    """The readings of the inertial sensor as the board sends them.

    Args:
        params: The sensor.
        period: Time between samples [s].
        seed: Of the noise of a sensor that is not moved, None for none.

    Attributes:
        trouble: What is wrong with it: "silent", "stuck", "railed", or nothing.
        misses: Readings that it has not given.
    """

    def __init__(self, params: ImuParams, period: float, seed: int | None) -> None:
        self.trouble, self.misses = "", 0
        self._params, self._period = params, period
        self._chance = None if seed is None else np.random.default_rng(seed)
        self._last = (0,) * (2 * AXES)

    def sample(self, counts: Floats, standing: bool) -> tuple[int, ...]:
        """What is sent of readings [counts], shape (6,)."""
        if self.trouble == "silent" or np.isnan(counts).any():
            self.misses += 1
            return (frame.IMU_NONE,) * (2 * AXES)
        if standing and self._chance is not None:  # the physics has not begun, and makes none
            noise = noise_of(self._params, self._chance, 1, self._period)[0]
            counts = np.rint(counts + noise / self._params.steps)
        counts = np.clip(counts, -self._params.most, self._params.most)
        if self.trouble == "railed":
            counts = self._params.most
        if self.trouble != "stuck":
            self._last = tuple(map(int, counts.tolist()))
        return self._last


TOUCH_FLEX = 1.0
"""Flex of a touch [rad]: more than twice what the check by touch asks for."""
TOUCH_TIME = 1.0
"""Time for which a touch bends an antenna [s]."""
_SIZE = r"([0-9]+(?:\.[0-9]+)?)"
_TOUCH = re.compile(rf"(left|right)(?::{_SIZE}(deg|mm(?::{_SIZE}mm)?))?(?:@{_SIZE}s)?")
_LOADS = np.linspace(0.0, 0.15, 61)
"""Loads on the tip, normal to it [N]; the default antenna moves its tip farthest at 0.12 N. Nearer
to the base they are larger by the cube of the lengths."""


class Press(NamedTuple):
    """A press on an antenna: flex under its sensor [rad], force normal to it [N], where [m]."""

    flex: float
    force: float
    mark: float


_NONE = Press(0.0, 0.0, 0.0)


class TouchStimulus:
    """Touches of antennae, at given times or as they are ordered.

    Args:
        orders: As above.
        antenna: The left antenna, for its springs and its flex sensor.
        right: The right one, as the left one if not given.
        right_gain: Bend that the right flex sensor feels over what the left one does.
        count: Number of antennae, 1 for the left one alone.
    """

    def __init__(
        self,
        orders: Sequence[str],
        antenna: AntennaSpec,
        right: AntennaSpec | None = None,
        right_gain: float = 1.0,
        count: int = 2,
    ) -> None:
        self._antennae = (antenna, right or antenna)[:count]
        self._gains = np.array([1.0, right_gain])
        for each in self._antennae:  # a first one takes 50 ms, for which a board may not be silent
            _press(each, each.length, flex=TOUCH_FLEX)
        self._timed = sorted(
            (_read_touch(text, self._antennae, timed=True) for text in orders),
            key=lambda order: order[3],
        )
        self._fresh: deque[tuple[int, Press, float]] = deque()
        self._typed = [(_NONE, -math.inf), (_NONE, -math.inf)]
        self._begun = math.inf

    def order(self, text: str) -> None:
        """Take an order, to be carried out at once."""
        side, press, length, _ = _read_touch(text, self._antennae, timed=False)
        self._fresh.append((side, press, length))

    def change(self, t: float, begun: float) -> Floats:
        """Change of both readings [counts] at time t [s], shape (2,).

        Args:
            t: The twin's time.
            begun: When the present client began, inf if none has.
        """
        ordered = self.presses(t, begun)
        flex = np.zeros(2)
        for side, press, length, start in self._timed:
            if start <= t - begun:
                flex[side] = press.flex if t - begun < start + length else 0.0
        for side, press in enumerate(ordered):
            flex[side] = flex[side] if press is None else press.flex
        sensor = self._antennae[0].sensor
        return counts(sensor, self._gains * flex) - counts(sensor, np.zeros(2))

    def presses(self, t: float, begun: float) -> list[Press | None]:
        """What presses the left and the right antenna by an order; arguments as of `change`."""
        if begun != self._begun:  # touches of the last client end
            self._begun, self._typed = begun, [(_NONE, -math.inf), (_NONE, -math.inf)]
        while self._fresh:
            side, press, length = self._fresh.popleft()
            self._typed[side] = (press, t + length)
        return [press if t < end else None for press, end in self._typed]


def _read_touch(
    text: str, antennae: Sequence[AntennaSpec], timed: bool
) -> tuple[int, Press, float, float]:
    """Side, press, for how long [s] and when [s] of an order."""
    match = _TOUCH.fullmatch(text.strip())
    if match is None or (match[5] is None) is timed:
        when = "@Ts, with T in seconds" if timed else "nothing more"
        raise BadInputError(
            f"--touch: expected left or right, with or without :20mm, :10mm:60mm or :60deg, then "
            f"{when}, found {text!r}"
        )
    if SIDES.index(match[1]) >= len(antennae):
        raise BadInputError(f"--touch: expected left, the only antenna, found {text!r}")
    antenna = antennae[SIDES.index(match[1])]
    mark = 1e-3 * float(match[4]) if match[4] else antenna.length
    if match[2] is None or match[3] == "deg":
        flex = TOUCH_FLEX if match[2] is None else math.radians(float(match[2]))
        press = _press(antenna, mark, flex=flex)
    else:
        press = _press(antenna, mark, way=1e-3 * float(match[2]))
    length = TOUCH_TIME if match[2] is None else math.inf
    return SIDES.index(match[1]), press, length, float(match[5] or 0.0)


def _pressed(
    antenna: AntennaSpec, mark: float, flex: float | None = None, way: float = 0.0
) -> Press:
    """The press at a place [m] that gives a flex [rad] or moves it aside [m], by the statics."""
    chain = Chain.of(antenna)
    if not 0.0 < mark <= chain.length:
        most = f"{1e3 * chain.length:g}mm along the antenna"
        raise BadInputError(f"--touch: expected a place of up to {most}, found {1e3 * mark:g}mm")
    loads = _LOADS * (chain.length / mark) ** 3
    force = np.stack([np.zeros_like(loads), loads], axis=1)
    bent = equilibrium(chain, np.full(len(loads), mark), force, follower=True).angles
    flexes = bent[:, : antenna.sensed_hinges].sum(axis=1)
    if flex is not None:
        return Press(flex, float(np.interp(flex, flexes, loads)), mark)
    ends = np.append(chain.starts, chain.length)
    ways = np.array([np.interp(mark, ends, across) for across in shape(chain, bent)[:, :, 1]])
    most = int(np.argmax(ways))
    if way > ways[most]:
        raise BadInputError(
            f"--touch: expected at most {1e3 * ways[most]:.0f}mm for this antenna, found "
            f"{1e3 * way:g}mm"
        )
    rising = slice(most + 1)
    flex, load = (float(np.interp(way, ways[rising], each[rising])) for each in (flexes, loads))
    return Press(flex, load, mark)


_press: Callable[..., Press] = lru_cache(maxsize=64)(_pressed)
"""Kept, as it takes 50 ms; frozen models have a hash, which type checkers do not see."""


_ALIVE = 0.1
"""A board that has been silent for longer [s], ten samples, does not answer either."""


class UdpEndpoint:
    """Answers requests and sends each frame in a datagram of its own.

    Args:
        host: Address to listen on; only this one.
        port: UDP port, 0 for any that is free.
        key: The board's.
        now: Monotonic time [s].
        size: Of the frames of its samples [byte].
    """

    def __init__(
        self,
        host: str,
        port: int,
        key: bytes,
        now: Callable[[], float] = time.monotonic,
        size: int = frame.SAMPLE_FRAME_SIZE,
    ) -> None:
        self._now, self._size = now, size
        self._signer = datagram.Signer(key)
        self._speaker: datagram.Speaker | None = None
        self._boot = -1
        self._written = 0.0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise BadInputError(
                f"--udp: expected a free port, found {host}:{port}: {error}"
            ) from None
        self.path = f"udp://{host}:{self._socket.getsockname()[1]}"

    def fileno(self) -> int:
        """File of the socket."""
        return self._socket.fileno()

    def baud(self) -> int | None:
        """There is none."""
        return None

    def read(self) -> bytes:
        """Answer a request that has come; a board takes nothing else."""
        try:
            asked, sender = self._socket.recvfrom(datagram.ASK_SIZE + 1)
        except OSError:
            return b""
        now = self._now()
        if self._speaker is not None and now - self._written < _ALIVE:
            answer = self._speaker.answer(asked, sender, round(1e3 * now))
            if answer is not None:
                self._send(answer, sender)
        return b""

    def write(self, data: bytes) -> None:
        """Send whole frames; a greeting is kept for clients that ask."""
        now = self._now()
        self._written = now
        for chunk in data.split(b"\0"):
            body = frame.unstuff(chunk) if chunk else None
            if body is None:
                continue
            whole = b"\0" + chunk + b"\0"
            if body[1] == frame.HELLO:
                self._begin(whole, struct.unpack_from(frame.HELLO_LAYOUT, body)[2])
            elif self._speaker is not None:
                signed = self._speaker.sign(whole, round(1e3 * now))
                if signed is not None:
                    self._send(signed, self._speaker.listener)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

    def _begin(self, hello: bytes, boot: int) -> None:
        if boot != self._boot:
            self._speaker = datagram.Speaker(self._signer, boot, hello, self._size)
            self._boot = boot

    def _send(self, data: bytes | bytearray, receiver: Any) -> None:
        try:
            self._socket.sendto(data, receiver)
        except OSError:
            return
