"""TOML files that are read with a limit."""

from __future__ import annotations

import errno
import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from dynamixel_bus.errors import ConfigError

_MOST_DOTS = 100
"""Most dots in a key of TOML; keys of thousands of parts keep its reader busy for minutes."""
_QUOTED, _BETWEEN = re.compile(r"\"[^\"]*\"|'[^']*'"), re.compile(r"[][,={}]")
"""Text in quotes, and what stands between keys and values of a line of TOML."""


def read_toml(path: Path, largest: int) -> dict[str, Any]:
    """The tables of a TOML file of at most `largest` bytes."""
    text = _text_of(path, largest)
    for number, line in enumerate(text.splitlines(), 1):
        if max(part.count(".") for part in _BETWEEN.split(_QUOTED.sub("", line))) > _MOST_DOTS:
            raise ConfigError(
                f"{path}: line {number}: expected at most {_MOST_DOTS} dots in a key, found more"
            )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: expected TOML, found: {error}") from None
    except ValueError:  # Python's own limit for whole numbers
        raise ConfigError(f"{path}: expected numbers of at most 4300 digits, found more") from None
    except RecursionError:
        raise ConfigError(f"{path}: expected plain tables, found them nested too deeply") from None


def _text_of(path: Path, largest: int) -> str:
    """The text of a regular file; a pipe, whose writer may never come, is refused at once."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            os.close(handle)
            raise OSError(errno.EINVAL, "it is a folder, a pipe or a device")
        with os.fdopen(handle, "rb") as file:
            data = file.read(largest + 1)
    except (OSError, ValueError) as cause:  # a zero byte in a path is a ValueError
        why = getattr(cause, "strerror", None) or cause
        raise ConfigError(f"{path}: expected a readable file: {why}") from None
    if len(data) > largest:
        raise ConfigError(f"{path}: expected at most {largest} bytes, found more")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        raise ConfigError(
            f"{path}: expected UTF-8 text, found byte {data[cause.start]:#04x} at {cause.start}"
        ) from None
