"""Files that are read with a limit and written whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import re
import secrets
import shutil
import stat
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from antennate.errors import FAILURES, BadInputError, ConfigError, OutputError

_RANDOM = 8
"""Random bytes in the name of a file that is not whole yet."""
_BLOCK = 1 << 20
"""Bytes that are read at a time."""
_MOST_DOTS = 100
"""Most dots in a key of TOML; keys of thousands of parts keep its reader busy for minutes."""
_QUOTED, _BETWEEN = re.compile(r"\"[^\"]*\"|'[^']*'"), re.compile(r"[][,={}]")
"""Text in quotes, and what stands between keys and values of a line of TOML."""
TOO_LONG = "expected numbers of at most 4300 digits, found more"
"""Python's own limit for whole numbers."""
_UNITS = (("GB", 1e9), ("MB", 1e6), ("kB", 1e3), ("bytes", 1.0))


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file to read; a pipe, whose writer may never come, is refused at once."""
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.EINVAL, "it is a folder, a pipe or a device", str(path))
    return os.fdopen(handle, "rb")


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Tell of what the system refuses while a file or folder is written."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"expected to write {path}, found: {error.strerror or error}") from None


def require_room(path: Path, least: float, error: type[BadInputError] = OutputError) -> None:
    """Check that a disk has room for a file that is to be written.

    Args:
        path: The file.
        least: What it needs [byte].
        error: What is raised.
    """
    try:
        free = shutil.disk_usage(path.parent).free
    except OSError as cause:
        raise error(f"expected a folder to write {path}, found: {cause.strerror}") from None
    if free < least:
        raise error(f"expected {in_units(least)} free for {path}, found {in_units(free)}")


def in_units(size: float) -> str:
    """A number of bytes for people, as 12.3 MB."""
    unit, scale = next((step for step in _UNITS if size >= step[1]), _UNITS[-1])
    return f"{size / scale:.4g} {unit}"


def read_limited(path: Path, largest: int, error: type[BadInputError] = BadInputError) -> bytes:
    """The content of a file of at most `largest` bytes."""
    try:
        with open_regular(path) as file:
            data = _first(file, largest + 1)
    except (OSError, ValueError) as cause:  # a zero byte in a path is a ValueError
        why = getattr(cause, "strerror", None) or cause
        raise error(f"{path}: expected a readable file: {why}") from None
    if len(data) > largest:
        raise error(f"{path}: expected at most {largest} bytes, found more")
    return data


def _first(file: BinaryIO, most: int) -> bytes:
    """At most so many bytes of a file, read in blocks: a small file needs little memory."""
    blocks: list[bytes] = []
    while most > 0 and (block := file.read(min(_BLOCK, most))):
        blocks.append(block)
        most -= len(block)
    return b"".join(blocks)


def decoded(path: Path, data: bytes, error: type[BadInputError] = BadInputError) -> str:
    """The text of a file, with or without a byte order mark."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        raise error(
            f"{path}: expected UTF-8 text, found byte {data[cause.start]:#04x} at {cause.start}"
        ) from None


def read_toml(path: Path, largest: int) -> dict[str, Any]:
    """The tables of a TOML file of at most `largest` bytes."""
    text = decoded(path, read_limited(path, largest, ConfigError), ConfigError)
    for number, line in enumerate(text.splitlines(), 1):
        if max(part.count(".") for part in _BETWEEN.split(_QUOTED.sub("", line))) > _MOST_DOTS:
            raise ConfigError(
                f"{path}: line {number}: expected at most {_MOST_DOTS} dots in a key, found more"
            )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: expected TOML, found: {error}") from None
    except ValueError:
        raise ConfigError(f"{path}: {TOO_LONG}") from None
    except RecursionError:
        raise ConfigError(f"{path}: expected plain tables, found them nested too deeply") from None


def write_whole(path: Path, data: bytes, overwrite: bool = False) -> None:
    """Write a file so that a crash at any moment leaves either all of it or nothing."""
    with writing_whole(path, overwrite) as file:
        file.write(data)


@contextlib.contextmanager
def writing_whole(path: Path, overwrite: bool = False) -> Iterator[BinaryIO]:
    """A file written piece by piece, there once the block has ended without an error."""
    with replacing(path, overwrite) as fresh, fresh.open("xb") as file:
        lock(file)
        yield file
        file.flush()
        os.fsync(file.fileno())


@contextlib.contextmanager
def replacing(path: Path, overwrite: bool = False) -> Iterator[Path]:
    """The name of a file to be made beside another, which it becomes at the end of the block.

    No file has that name before. After an error nothing of it is left.
    """
    try:
        place = _place(path) if overwrite else path
        fresh = place.with_name(f".{place.name}.{secrets.token_hex(_RANDOM)}")
        try:
            yield fresh
            if overwrite:
                fresh.replace(place)
            else:
                os.link(fresh, place)  # unlike replace it fails if the file exists by now
        finally:
            fresh.unlink(missing_ok=True)
    except FAILURES:
        raise
    except FileExistsError:
        raise OutputError(
            f"{path}: expected no such file, found one; choose another name or give overwrite=True"
        ) from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise OutputError(f"{path}: expected to write it, found: {why}") from None


def _place(path: Path) -> Path:
    """Where a file is replaced: a link stays one, and so do /dev/stdout and the like."""
    place = Path(os.path.realpath(path))
    if place.exists() and not place.is_file():
        raise OutputError(
            f"{path}: expected a file or a new name, found a folder, a pipe or a device"
        )
    return place


def lock(file: BinaryIO | int) -> bool | None:
    """Say that a process works on a file, until it is closed; whether nobody else does.

    The system frees the lock when that process ends, however it ends. None on a file system that
    has no locks.
    """
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def remove_abandoned(folder: Path, is_ours: Callable[[str], bool]) -> None:
    """Remove what killed processes left in a folder; one that lives holds its lock.

    Args:
        folder: The folder.
        is_ours: Whether the file of a name, which they wrote, is one of those that are meant.
    """
    form = re.compile(rf"\.(.+)\.[0-9a-f]{{{2 * _RANDOM}}}", re.DOTALL)
    with contextlib.suppress(OSError):
        for left in list(folder.iterdir()):
            match = form.fullmatch(left.name)
            if match is None or not is_ours(match[1]):
                continue
            with contextlib.suppress(OSError), open_regular(left) as file:
                if lock(file):
                    left.unlink()
