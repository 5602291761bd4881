"""Files that are read with a limit and written whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

from antennate.errors import BadInputError, OutputError


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file to read; a pipe, whose writer may never come, is refused at once.

    Raises:
        OSError: It cannot be opened, or is a pipe, a device or a folder.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.EINVAL, "it is a folder, a pipe or a device", str(path))
    return os.fdopen(handle, "rb")


def read_limited(path: Path, largest: int, error: type[BadInputError] = BadInputError) -> bytes:
    """The content of a file of at most `largest` bytes.

    Raises:
        BadInputError: Of the given type: the file cannot be read, or is larger.
    """
    try:
        with open_regular(path) as file:
            data = file.read(largest + 1)
    except (OSError, ValueError) as cause:  # a zero byte in a path is a ValueError
        why = getattr(cause, "strerror", None) or cause
        raise error(f"{path}: expected a readable file: {why}") from None
    if len(data) > largest:
        raise error(f"{path}: expected at most {largest} bytes, found more")
    return data


def decoded(path: Path, data: bytes, error: type[BadInputError] = BadInputError) -> str:
    """The text of a file, with or without a byte order mark.

    Raises:
        BadInputError: Of the given type: it is not UTF-8.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        raise error(
            f"{path}: expected UTF-8 text, found byte {data[cause.start]:#04x} at {cause.start}"
        ) from None


def write_whole(path: Path, data: bytes, overwrite: bool = False) -> None:
    """Write a file so that a crash at any moment leaves either all of it or nothing.

    Raises:
        OutputError: It exists and may not be replaced, or it cannot be written.
    """
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        fresh.unlink(missing_ok=True)  # left by a killed process that had the same number
        try:
            with fresh.open("xb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            if overwrite:
                fresh.replace(path)
            else:
                os.link(fresh, path)  # unlike replace it fails if the file exists by now
        finally:
            fresh.unlink(missing_ok=True)
    except FileExistsError:
        raise OutputError(
            f"{path}: expected no such file, found one; choose another name or allow overwriting"
        ) from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise OutputError(f"{path}: expected to write it, found: {why}") from None
