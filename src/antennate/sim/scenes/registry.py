"""Find a scene by name: one of ours, an MJCF file, or a class of the user's own."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing import parent_process
from pathlib import Path

from antennate.errors import AntennateError, ConfigError, SceneError, raised
from antennate.lookup import Registry
from antennate.params.scene import CorridorsParams, TunnelParams
from antennate.sim.scenes.corridors import CorridorsScene
from antennate.sim.scenes.hard import HARD
from antennate.sim.scenes.mjcf import MjcfScene
from antennate.sim.scenes.mjcf_file import require_compiles
from antennate.sim.scenes.scene import FlatScene, Scene
from antennate.sim.scenes.tunnel import TunnelScene

TUNNEL = "tunnel"
CORRIDORS = "corridors"
_SHIPPED: dict[str, Callable[[], Scene]] = {
    TUNNEL: TunnelScene,
    "flat": FlatScene,
    CORRIDORS: CorridorsScene,
    **HARD,
}
SHIPPED = tuple(_SHIPPED)
"""Scenes that need no file and no code of others."""
SCENES: Registry[Callable[[], Scene]] = Registry("scene", "antennate.scenes", _SHIPPED)


def check_name(name: str) -> str:
    """Return the name if it may be that of a scene; no code of the user runs.

    Raises:
        ConfigError: The name has another form.
    """
    return name if _is_file(name) else SCENES.check(name)


def make_scene(
    name: str, tunnel: TunnelParams | None = None, corridors: CorridorsParams | None = None
) -> Scene:
    """The scene of a name.

    Args:
        name: One of `SHIPPED`, the path of an MJCF file that ends in .xml, or, for a class of the
            user's own, `module:Class`, `path/file.py:Class` or an entry point of the group
            `antennate.scenes`. Its constructor is called without arguments.
        tunnel: Parameters of `tunnel`; no other scene takes them.
        corridors: Parameters of `corridors`, likewise.

    Raises:
        ConfigError: There is no such scene.
        SceneError: The file cannot be used, or the constructor failed.
    """
    if name == TUNNEL:
        return TunnelScene(tunnel)
    if name == CORRIDORS:
        return CorridorsScene(corridors)
    if _is_file(name):
        if parent_process() is None:  # the process that started this worker has tried it
            require_compiles(Path(name))
        return MjcfScene(name)
    try:
        return SCENES.find(name)()
    except ConfigError as error:
        raise ConfigError(f"--scene: {error}") from error
    except AntennateError:
        raise
    except Exception as error:
        raise SceneError(f"--scene: expected to make {name!r}, found {raised(error)}") from error


def _is_file(name: str) -> bool:
    return name.endswith(".xml")
