"""The packages that a batch on a GPU needs, and the engine that must not come with them."""

from __future__ import annotations

from importlib import metadata
from importlib.util import find_spec
from typing import Any

from antennate.errors import ConfigError, MissingPackageError

INSTALL = "pip install --no-deps mujoco-warp==4.0.0 warp-lang==1.19.0 absl-py etils"
"""What was tried. Without --no-deps `mujoco` 3.17 comes too and overwrites the engine, so that no
extra of this package can have it."""
_MODULES = {"mujoco_warp": "mujoco-warp", "warp": "warp-lang", "absl": "absl-py", "etils": "etils"}
_SERIES = "4.0"
"""Older ones tell nothing of dropped contacts; newer ones were not tried."""
_ENGINES = ("mujoco", "mujoco-core")


def require_warp() -> tuple[Any, Any]:
    """The modules warp and mujoco_warp.

    Raises:
        ConfigError: Two engines are installed over one another, or mujoco-warp is another one.
        MissingPackageError: A package is not installed.
    """
    found = {name: found for name in _ENGINES if (found := _version(name))}
    if len(found) > 1:
        both = " and ".join(f"{name} {version}" for name, version in found.items())
        raise ConfigError(
            f"--engine warp: expected one engine, found {both}, which write the same files; "
            f"uninstall both, then install mujoco-core {found[_ENGINES[1]]} again"
        )
    missing = [package for module, package in _MODULES.items() if find_spec(module) is None]
    if missing:
        raise MissingPackageError(
            f"--engine warp: expected the packages {', '.join(_MODULES.values())}, found no "
            f"{', '.join(missing)}; install them with {INSTALL}"
        )
    version = _version("mujoco-warp")
    if version and not version.startswith(f"{_SERIES}."):
        raise ConfigError(f"--engine warp: expected mujoco-warp {_SERIES}, found {version}")
    import mujoco_warp  # pyright: ignore[reportMissingImports]
    import warp  # pyright: ignore[reportMissingImports]

    warp.config.log_level = warp.LOG_WARNING
    return warp, mujoco_warp


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""
