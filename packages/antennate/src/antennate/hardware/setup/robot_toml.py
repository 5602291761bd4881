"""Changes a few keys of a TOML file and leaves all else in it, comments too, as it stands."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Mapping
from pathlib import Path

import tomlkit
from tomlkit.exceptions import TOMLKitError

from antennate.errors import ConfigError
from antennate.files import decoded, read_limited, write_whole
from antennate.params.base import LARGEST_FILE
from antennate.params.toml_text import Key, Value, edited


def change(path: Path, values: Mapping[Key, Value]) -> None:
    """Set keys of a file, which is made if it is not there.

    Args:
        path: The file.
        values: By their tables and name, such as `("robot", "yaw", "zeros")`.
    """
    data, changed = _read_and_edited(path, values)
    if changed != data:
        write_whole(path, changed, overwrite=True)


def require_changeable(path: Path, values: Mapping[Key, Value]) -> None:
    """Check that keys of a file can be set, before somebody works for their values.

    Args:
        path: The file.
        values: As of `change`.
    """
    _read_and_edited(path, values)


def _read_and_edited(path: Path, values: Mapping[Key, Value]) -> tuple[bytes, bytes]:
    """The bytes of a file, none if it is not there, and those with keys set.

    A byte order mark stays, and new lines end as those of the file.
    """
    data = read_limited(path, LARGEST_FILE, ConfigError) if path.exists() else b""
    text = decoded(path, data, ConfigError)
    try:
        changed = edited(text, values)
    except (TOMLKitError, ValueError) as error:
        keys = ", ".join(
            f"{'.'.join(key)} = {tomlkit.item(value).as_string()}" for key, value in values.items()
        )
        raise ConfigError(
            f"{path}: expected tables that can be changed, found: {error}; write by hand: {keys}"
        ) from None
    if "\r\n" in text and text.count("\n") == text.count("\r\n"):
        changed = changed.replace("\r\n", "\n").replace("\n", "\r\n")
    return data, (BOM_UTF8 if data.startswith(BOM_UTF8) else b"") + changed.encode()
