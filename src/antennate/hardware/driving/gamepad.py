"""A gamepad of Linux, read from its device file without any library.

Eight bytes an event: time [ms], value, kind and number, as in
https://docs.kernel.org/input/joydev/joystick-api.html. The first stick or the cross gives the
maneuver, any button the oscillation.
"""

from __future__ import annotations

import contextlib
import os
import struct
from pathlib import Path

from antennate.errors import BadInputError

_EVENT = struct.Struct("<IhBB")
_BUTTON, _AXIS, _FIRST = 0x01, 0x02, 0x80
_HALF = 16_384
"""Half of the travel of a stick; beyond it the stick counts as pushed."""
_CROSS = (6, 7)
"""Axes of the cross of most pads; the first stick has 0 and 1."""


class Gamepad:
    """Keys of a gamepad; a stick that is pushed repeats its key with every reading.

    Args:
        path: Its device file, such as /dev/input/js0.

    Raises:
        BadInputError: It cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise BadInputError(f"--gamepad: cannot open {path}: {error.strerror}") from None
        self._axes: dict[int, int] = {}
        self._rest = b""

    def keys(self) -> list[str]:
        """What is pushed now: an arrow's name, and `o` for each button that went down."""
        keys: list[str] = []
        with contextlib.suppress(BlockingIOError):
            while data := self._read():
                whole = len(data) - len(data) % _EVENT.size
                self._rest = data[whole:]
                for _, value, kind, number in _EVENT.iter_unpack(data[:whole]):
                    if kind & ~_FIRST == _AXIS:
                        self._axes[number] = value
                    elif kind == _BUTTON and value:
                        keys.append("o")
        return keys + self._pushed()

    def close(self) -> None:
        """Close it."""
        os.close(self._handle)

    def _read(self) -> bytes:
        """Read the events that have come; a pad that was unplugged has nothing pushed."""
        try:
            data = os.read(self._handle, 64 * _EVENT.size)
        except BlockingIOError:
            raise
        except OSError:
            data = b""
        if not data:
            self._axes.clear()
            return b""
        return self._rest + data

    def _pushed(self) -> list[str]:
        """The arrow into whose direction a stick is pushed most."""
        ways: dict[str, int] = {}
        for across, along in ((0, 1), _CROSS):
            x, y = self._axes.get(across, 0), self._axes.get(along, 0)
            for name, way in (("left", -x), ("right", x), ("up", -y), ("down", y)):
                ways[name] = max(way, ways.get(name, 0))
        name, way = max(ways.items(), key=lambda item: item[1])
        return [name] if way > _HALF else []
