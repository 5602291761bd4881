"""A scene from an MJCF file with the sites `start` and `exit`."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np

from antennate.errors import SceneError
from antennate.robots.spec import RobotSpec
from antennate.sim import layers
from antennate.sim.engine import mujoco
from antennate.sim.outline import outline
from antennate.sim.scenes.mjcf_file import in_words, read_spec
from antennate.sim.scenes.scene import Route, add_floor
from antennate.types import Floats

PREFIX = "scene/"
_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
_OWN_BITS = 8
"""The file's collision bits are moved up by so many, past those of the robot and the floor."""
_MOST_BITS = 1 << 20
_VIA = re.compile("via[0-9]+")


class MjcfScene:
    """The same scene in every trial.

    The head starts at the site `start` and faces the next site; progress is arc length from there
    through the sites `via0`, `via1` and so on, if there are any, to `exit`. Heights of sites do not
    count. A horizontal plane at z = 0 is the floor; a floor is added if there is none. Whatever
    would touch a geom with MuJoCo's default collision bits touches the robot: body, legs, antennae.

    Args:
        path: The file.

    Raises:
        SceneError: It cannot be used.
    """

    random = False

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._spec = read_spec(self._path)
        try:
            model = self._spec.compile()
        except ValueError as error:
            raise self._error("a model that compiles", in_words(error)) from error
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        self._route = self._read_route(model, data)
        solid = [g for g in range(model.ngeom) if _is_wall(model, g)]
        self._bounds = [outline(model, data, g) for g in solid]
        self._has_floor = _share_bits(self._spec, model, data)

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Route:
        """The scene of the file."""
        bounds = np.concatenate(self._bounds) if self._bounds else None
        return _Instance(self._route, bounds, self._spec, self._has_floor)

    def _read_route(self, model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
        names = [model.site(i).name for i in range(model.nsite)]
        every = (f"via{i}" for i in itertools.count())
        vias = [*itertools.takewhile(names.__contains__, every)]
        for name in ("start", "exit"):
            if name not in names:
                found = ", ".join(filter(None, names)) or "no site with a name"
                raise self._error(f"a site named {name!r}", found)
        if gap := [name for name in names if _VIA.fullmatch(name) and name not in vias]:
            raise self._error(f"a site named 'via{len(vias)}' before {gap[0]!r}", "none")
        route = np.array([data.site_xpos[names.index(n), :2] for n in ("start", *vias, "exit")])
        if (np.hypot(*np.diff(route, axis=0).T) < 1e-3).any():
            raise self._error("sites at least 1 mm apart from start to exit", "two at one place")
        return route

    def _error(self, expected: str, found: str) -> SceneError:
        return SceneError(f"{self._path}: expected {expected}, found {found}")


class _Instance(Route):
    def __init__(
        self, route: Floats, bounds: Floats | None, spec: mujoco.MjSpec, has_floor: bool
    ) -> None:
        super().__init__(route, bounds)
        self._spec, self._has_floor = spec, has_floor

    def build(self, spec: mujoco.MjSpec) -> None:
        if not self._has_floor:
            add_floor(spec)
        spec.attach(self._spec.copy(), frame=spec.worldbody.add_frame(), prefix=PREFIX)


def _is_wall(model: mujoco.MjModel, geom: int) -> bool:
    """Whether a geom stands still, touches something and has an end."""
    touches = model.geom_contype[geom] or model.geom_conaffinity[geom]
    still = model.body_weldid[model.geom_bodyid[geom]] == 0
    return bool(touches and still and model.geom_type[geom] != _PLANE)


def _share_bits(spec: mujoco.MjSpec, model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Translate collision bits to ours; return whether there is a floor.

    Among themselves the geoms touch as before: their bits are moved up. A geom that would touch one
    with the default bits, contype 1 and conaffinity 1, becomes an obstacle that rests on our floor.
    """
    has_floor = False
    for geom in spec.geoms:
        contype, conaffinity = geom.contype, geom.conaffinity
        if not 0 <= max(contype, conaffinity) < _MOST_BITS:
            raise SceneError(f"expected collision bits below {_MOST_BITS}, found more")
        geom.contype, geom.conaffinity = contype << _OWN_BITS, conaffinity << _OWN_BITS
        if not (contype | conaffinity) & 1:
            continue
        if _is_floor(model, data, geom.id):
            geom.contype |= layers.FLOOR
            has_floor = True
        else:
            geom.contype |= layers.OBSTACLE
            geom.conaffinity |= layers.FLOOR
    return has_floor


def _is_floor(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> bool:
    plane = model.geom_type[geom] == _PLANE
    level = abs(data.geom_xmat[geom].reshape(3, 3)[2, 2] - 1.0) < 1e-6
    return bool(plane and level and abs(data.geom_xpos[geom, 2]) < 1e-6)
