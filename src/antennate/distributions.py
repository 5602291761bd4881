"""The engine's distributions: `mujoco` and, from 4.0 on, `mujoco-core` write the same files."""

from __future__ import annotations

from importlib import metadata

ENGINES = ("mujoco", "mujoco-core")


def engines() -> dict[str, str]:
    """Versions of the installed distributions that write the engine's files, by name."""
    versions = {}
    for name in ENGINES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions
