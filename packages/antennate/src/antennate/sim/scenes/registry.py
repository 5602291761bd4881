"""Scenes by name: one of ours, the hard set, an MJCF file, or a class of the user's own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from multiprocessing import parent_process
from pathlib import Path

from antennate.errors import FAILURES, ConfigError, SceneError, raised
from antennate.lookup import Registry, Shipped
from antennate.params.scene import (
    GROUND_READS,
    CorridorsParams,
    GroundParams,
    TunnelParams,
)
from antennate.sim.scenes.scene import TIME_LIMIT, Scene

TUNNEL = "tunnel"
CORRIDORS = "corridors"
_MODULES = ("tunnel", "scene", "corridors", "wall", "ground", "step_tunnel")
"""Modules of `antennate.sim.scenes` with a table `SCENES`, that of the tunnel first."""
SHIPPED: Mapping[str, Callable[..., Scene]] = Shipped(
    [f"antennate.sim.scenes.{name}" for name in _MODULES], lambda module: module.SCENES
)
"""Scenes that need no file and no code of others, by name."""
SCENES: Registry[Callable[[], Scene]] = Registry("scene", "antennate.scenes", SHIPPED)


def shared_limit(name: str) -> float:
    """The time limit that all trials of a scene share [s]; infinite where it may be drawn."""
    return TIME_LIMIT if name != CORRIDORS and (name in SHIPPED or _is_file(name)) else math.inf


def check_name(name: str) -> str:
    """Return the name if it may be that of a scene; no code of the user runs."""
    return name if _is_file(name) else SCENES.check(name)


def make_scene(
    name: str,
    tunnel: TunnelParams | None = None,
    corridors: CorridorsParams | None = None,
    ground: GroundParams | None = None,
) -> Scene:
    """The scene of a name.

    Args:
        name: One of `SHIPPED`, the path of an MJCF file that ends in .xml, or, for a class of the
            user's own, `module:Class`, `path/file.py:Class` or an entry point of the group
            `antennate.scenes`. Its constructor is called without arguments.
        tunnel: Parameters of `tunnel`; no other scene takes them.
        corridors: Parameters of `corridors`, likewise.
        ground: Sizes of the scenes of ground that is not flat, likewise.
    """
    sizes = {TUNNEL: tunnel, CORRIDORS: corridors, **dict.fromkeys(GROUND_READS, ground)}
    if name in sizes:
        return SHIPPED[name](sizes[name])
    if _is_file(name):
        from antennate.sim.scenes.mjcf import MjcfScene, require_compiles  # only where one is named

        if parent_process() is None:  # the process that started this worker has tried it
            require_compiles(Path(name))
        return MjcfScene(name)
    try:
        return SCENES.find(name)()
    except ConfigError as error:
        raise ConfigError(f"--scene: {error}") from error
    except FAILURES:
        raise
    except Exception as error:
        raise SceneError(f"--scene: expected to make {name!r}, found {raised(error)}") from error


def _is_file(name: str) -> bool:
    return name.endswith(".xml")
