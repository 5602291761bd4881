"""Scenes by name: one of ours, the hard set, an MJCF file, or a class of the user's own."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from multiprocessing import parent_process
from pathlib import Path

from antennate.errors import FAILURES, ConfigError, SceneError, raised
from antennate.lookup import Registry
from antennate.params.scene import CorridorsParams, CylinderParams, GroundParams, TunnelParams
from antennate.sim.scenes.corridors import CorridorsScene
from antennate.sim.scenes.geometry import Arm, Room
from antennate.sim.scenes.ground import KINDS, GroundScene
from antennate.sim.scenes.mjcf import MjcfScene, require_compiles
from antennate.sim.scenes.scene import TIME_LIMIT, FlatScene, Scene
from antennate.sim.scenes.step_tunnel import StepTunnelScene
from antennate.sim.scenes.tunnel import TunnelScene
from antennate.sim.scenes.wall import WallScene

_CORNER = TunnelParams(turns_deg=(120.0,))
_U_TURN = TunnelParams(segments=(1.0, 0.8, 1.0), turns_deg=(90.0, 90.0))
_ROOM = TunnelParams(segments=(1.0, 1.8), turns_deg=(90.0,), strewn=0)
_DEAD_END = TunnelParams(segments=(0.7, 1.0), turns_deg=(90.0,), free_width=0.44, strewn=0)
_HEAVY = TunnelParams(cylinder=CylinderParams(mass=0.5))

HARD: Mapping[str, Callable[[], TunnelScene]] = {
    "corner": functools.partial(TunnelScene, _CORNER),
    "uturn": functools.partial(TunnelScene, _U_TURN),
    "room": functools.partial(TunnelScene, _ROOM, rooms=(Room(1, 0.6, 1.6, 1.2, gap=0.5),)),
    "deadend": functools.partial(TunnelScene, _DEAD_END, arms=(Arm(0, 1.1),)),
    "heavy": functools.partial(TunnelScene, _HEAVY),
    "noisy": functools.partial(TunnelScene, variation={"reading_noise": 3.0}),
    "broken": functools.partial(TunnelScene, variation={"broken": "random"}),
}
"""A corner of 120 deg; two of 90 deg to the same side; a room behind a corner, 1 m long and 1.2 m
wide, left by a gap of 0.5 m in the wall opposite; a way that goes on by a branch of 0.44 m at
0.7 m, with a blind end at 1.8 m straight ahead; the tunnel with cylinders of 0.5 kg, with three
times the noise of the readings, with one antenna broken off."""


TUNNEL = "tunnel"
CORRIDORS = "corridors"
_SHIPPED: dict[str, Callable[[], Scene]] = {
    TUNNEL: TunnelScene,
    "flat": FlatScene,
    CORRIDORS: CorridorsScene,
    "wall": WallScene,
    **HARD,
    **{name: functools.partial(GroundScene, name) for name in KINDS},
    "step_tunnel": StepTunnelScene,
}
SHIPPED = tuple(_SHIPPED)
"""Scenes that need no file and no code of others."""
SCENES: Registry[Callable[[], Scene]] = Registry("scene", "antennate.scenes", _SHIPPED)


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
    if name == TUNNEL:
        return TunnelScene(tunnel)
    if name == CORRIDORS:
        return CorridorsScene(corridors)
    if name in KINDS:
        return GroundScene(name, ground)
    if name == "step_tunnel":
        return StepTunnelScene(ground)
    if _is_file(name):
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
