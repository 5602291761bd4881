"""The speed that a client has set on a pseudo-terminal, any number of it."""

from __future__ import annotations

import fcntl
import struct
import termios

_LAYOUT = "=4IB19B2I"
"""Linux's `struct termios2`: four flags, line, control characters, input and output speed."""
_GET = 0x802C542A
"""Linux's TCGETS2, which also tells speeds that have no name."""
_NAMED = {
    value: int(name[1:])
    for name, value in vars(termios).items()
    if name[0] == "B" and name[1:].isdigit()
}


def unset(terminal: int) -> None:
    """Mark the speed of a terminal as one that nobody has set: 50 bit/s."""
    mode = termios.tcgetattr(terminal)
    mode[4] = mode[5] = termios.B50
    termios.tcsetattr(terminal, termios.TCSANOW, mode)


def speed(terminal: int) -> int | None:
    """Bits per second, None while nobody has set it."""
    try:
        answer = fcntl.ioctl(terminal, _GET, bytes(struct.calcsize(_LAYOUT)))
        found = struct.unpack(_LAYOUT, answer)[-1]
    except OSError:  # not Linux, or not this kind of it
        found = _NAMED.get(termios.tcgetattr(terminal)[5], 0)
    return None if found == 50 else found
