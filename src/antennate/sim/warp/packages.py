"""The packages that a batch on a GPU needs beside the engine."""

from __future__ import annotations

from importlib import import_module, metadata
from importlib.util import find_spec
from typing import Any

from antennate.errors import ConfigError, MissingPackageError, in_one_line
from antennate.messages import extra
from antennate.sim.engine import mujoco

_MODULES = {"mujoco_warp": "mujoco-warp", "warp": "warp-lang", "absl": "absl-py", "etils": "etils"}


def require_warp() -> tuple[Any, Any]:
    """The modules warp and mujoco_warp.

    Raises:
        ConfigError: mujoco-warp is of another series than the engine.
        MissingPackageError: A package is not installed.
    """
    missing = [package for module, package in _MODULES.items() if find_spec(module) is None]
    if missing:
        raise MissingPackageError(
            f"--engine warp: expected the packages {', '.join(_MODULES.values())}, found no "
            f"{', '.join(missing)}; install them with {extra('gpu')}"
        )
    engine, version = _series(mujoco.__version__), _version("mujoco-warp")
    if version and _series(version) != engine:
        raise ConfigError(
            f"--engine warp: expected mujoco-warp {engine}, as the engine mujoco is "
            f"{mujoco.__version__}, found {version}"
        )
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
    if name is None and not (device and device.is_cuda):
        raise ConfigError(
            "--engine warp: expected a GPU with CUDA, found none; without one the usual engine is "
            'much faster, and device "cpu" is there for tests'
        )
    return device


def _series(version: str) -> str:
    """The first two numbers of a version."""
    return ".".join(version.split(".")[:2])


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""
