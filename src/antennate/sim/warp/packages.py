"""The packages that a batch on a GPU needs beside the engine."""

from __future__ import annotations

import os
from importlib import import_module, metadata
from importlib.util import find_spec
from typing import Any

from antennate.errors import ConfigError, MissingPackageError, in_one_line

INSTALL = "pip install --no-deps mujoco-warp==4.0.0 warp-lang==1.19.0 absl-py etils"
"""What was tried. Without --no-deps `mujoco` 3.17 comes too and overwrites the engine, so that no
extra of this package can have it."""
_MODULES = {"mujoco_warp": "mujoco-warp", "warp": "warp-lang", "absl": "absl-py", "etils": "etils"}
_SERIES = "4.0"
"""Older ones tell nothing of dropped contacts; newer ones were not tried."""


def require_warp() -> tuple[Any, Any]:
    """The modules warp and mujoco_warp.

    Raises:
        ConfigError: mujoco-warp is another one.
        MissingPackageError: A package is not installed.
    """
    missing = [package for module, package in _MODULES.items() if find_spec(module) is None]
    if missing:
        uv = "uv " if os.environ.get("UV") else ""  # `uv run` sets it: there pip installs elsewhere
        raise MissingPackageError(
            f"--engine warp: expected the packages {', '.join(_MODULES.values())}, found no "
            f"{', '.join(missing)}; install them with {uv}{INSTALL}"
        )
    version = _version("mujoco-warp")
    if version and not version.startswith(f"{_SERIES}."):
        raise ConfigError(f"--engine warp: expected mujoco-warp {_SERIES}, found {version}")
    import mujoco_warp  # pyright: ignore[reportMissingImports]

    warp = import_module("warp")  # type checkers take our own folder of that name for it
    warp.config.log_level = warp.LOG_WARNING
    return warp, mujoco_warp


def require_device(name: str | None) -> Any:
    """The device of a name, or a GPU.

    Raises:
        ConfigError: There is none.
        MissingPackageError: Warp is not installed.
    """
    warp, _ = require_warp()
    try:
        device = warp.get_device(name) if name else warp.get_preferred_device()
    except Exception as error:
        raise ConfigError(f"--engine warp: {in_one_line(error)}") from error
    if name is None and not device.is_cuda:
        raise ConfigError(
            "--engine warp: expected a GPU with CUDA, found none; without one the usual engine is "
            'much faster, and device "cpu" is there for tests'
        )
    return device


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""
