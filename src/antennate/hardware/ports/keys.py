"""The key that an antenna board and its host share; it is read here, and never shown."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

from antennate.errors import BadInputError, reason
from antennate.files import open_regular

KEY_SIZE = 32
"""As many bytes as SHA-256 gives; more would add nothing."""
ENVIRONMENT = "ANTENNATE_KEY"
_MAKE = (
    'make one with: (umask 077; python3 -c "import secrets; print(secrets.token_hex(32))" > FILE)'
)


def read_key(path: Path | None, way_out: str = "") -> bytes:
    """The key in a file, or in the environment variable ANTENNATE_KEY if there is no file.

    Args:
        path: The file.
        way_out: What else can be done without a key, for the error.

    Raises:
        BadInputError: There is none, others may read the file, or it holds no key.
    """
    if path is None:
        text = os.environ.get(ENVIRONMENT)
        if text is None:
            cures = f"{_MAKE}; {way_out}" if way_out else _MAKE
            raise BadInputError(f"--key: expected a file, or {ENVIRONMENT} set; {cures}")
        return _parse(text, ENVIRONMENT)
    return _parse(_private(path), f"--key {path}")


def _private(path: Path) -> str:
    """Content of a file that nobody else can read; looked at after opening, so it cannot change."""
    try:
        with open_regular(path) as file:
            mode = os.fstat(file.fileno()).st_mode
            content = file.read(1024)
    except OSError as error:
        raise BadInputError(f"--key: expected a file, found {path}: {reason(error)}") from None
    if mode & 0o077:
        raise BadInputError(
            f"--key: expected a file that only you can read (mode 0600), found {path} with mode "
            f"{stat.S_IMODE(mode):04o}; others may know this key: chmod 600 it, or better {_MAKE}"
        )
    return content.decode("ascii", "replace")


def _parse(text: str, where: str) -> bytes:
    if re.fullmatch(rf"\s*[0-9a-fA-F]{{{2 * KEY_SIZE}}}\s*", text) is None:
        raise BadInputError(f"{where}: expected {2 * KEY_SIZE} hexadecimal digits; {_MAKE}")
    return bytes.fromhex(text)
