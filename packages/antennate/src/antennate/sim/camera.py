"""Pictures of a simulated world, drawn without a display."""

from __future__ import annotations

import copy
import importlib
import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from antennate.sim import engine_setup
from antennate.sim.engine import mujoco
from antennate.sim.parts import ANTENNA_BIT
from antennate.sim.shapes import Colour, colours
from antennate.types import Floats

Picture = NDArray[np.uint8]
_LINE: Colour = (0.8, 0.8, 0.8, 1.0)
_SAMPLES = 4
"""Samples of a pixel: thin antennae would flicker otherwise."""
_THIN = 1.5
"""Least radius of an antenna in the middle of a picture [pixels], so that it is seen (assumed)."""
_SKY, _HORIZON = 255, 30.0
"""Grey of what is behind all, and elevation below which it is in the picture [deg]: half the field
of view, and some more."""
_GRID, _SPACING = 16, 0.25
"""Grid lines to either side of the middle, and their distance [m]."""


@dataclass(frozen=True, slots=True)
class Shot:
    """From where a camera looks.

    Attributes:
        distance: From what it looks at [m].
        elevation: Below the horizon it looks by so much [deg].
        azimuth: Its heading [deg]; 90 has x to the right and y to the back.
    """

    distance: float
    elevation: float = 70.0
    azimuth: float = 90.0


class Camera:
    """A camera in the world of a model; a context, as it holds memory of the driver.

    Obstacles, links, legs and antennae get colours of their own, left and right apart, unless the
    model brings its own. The model that is given stays as it is.

    Args:
        model: The compiled model, of mujoco.
        shot: From where it looks.
        size: Width and height [pixels].
        sides: Colours of the left and the right antenna.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        shot: Shot,
        size: tuple[int, int],
        sides: tuple[Colour, Colour],
    ) -> None:
        name = engine_setup.backend()
        os.environ.setdefault("PYOPENGL_PLATFORM", name)
        self._model = copy.copy(model)
        _prepare(self._model, size, sides)
        _thicken(self._model, shot.distance, size[1])
        self._data = mujoco.MjData(self._model)
        self._rect = mujoco.MjrRect(0, 0, *size)
        self._scene = mujoco.MjvScene(self._model, maxgeom=2 * self._model.ngeom + 500)
        self._option = mujoco.MjvOption()
        self._sees_sky = shot.elevation < _HORIZON
        self._camera = _aimed(shot)
        self._driver = importlib.import_module(f"mujoco.{name}").GLContext(*size)
        self._driver.make_current()
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)

    def picture(self, position: Floats, target: Floats) -> Picture:
        """The world with its coordinates at `position`, the camera on `target` [m].

        Args:
            position: All coordinates of the model, shape (nq,).
            target: What is in the middle of the picture [m], shape (3,).

        Returns:
            The picture, shape (height, width, 3).
        """
        self._data.qpos[:] = position
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._camera.lookat = target
        mujoco.mjv_updateScene(
            self._model,
            self._data,
            self._option,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL.value,
            self._scene,
        )
        _add_grid(self._scene, target)
        self._driver.make_current()
        mujoco.mjr_render(self._rect, self._scene, self._context)
        pixels = np.empty((self._rect.height, self._rect.width, 3), dtype=np.uint8)
        depth = np.empty(pixels.shape[:2], dtype=np.float32) if self._sees_sky else None
        mujoco.mjr_readPixels(pixels, depth, self._rect, self._context)
        if depth is not None:
            pixels[depth >= 1.0] = _SKY
        return pixels[::-1]

    def __enter__(self) -> Camera:
        return self

    def __exit__(self, *_: object) -> None:
        self._driver.make_current()
        self._context.free()
        self._driver.free()


def _aimed(shot: Shot) -> mujoco.MjvCamera:
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.distance, camera.azimuth, camera.elevation = shot.distance, shot.azimuth, -shot.elevation
    return camera


def _prepare(model: mujoco.MjModel, size: tuple[int, int], sides: tuple[Colour, Colour]) -> None:
    """Light and colours."""
    visual = model.vis
    visual.global_.offwidth, visual.global_.offheight = size
    visual.quality.offsamples = _SAMPLES
    visual.headlight.ambient = [0.55] * 3
    visual.headlight.diffuse = [0.45] * 3
    visual.headlight.specular = [0.0] * 3
    model.geom_rgba[:] = colours(model, sides)


def _thicken(model: mujoco.MjModel, distance: float, height: int) -> None:
    """Draw thin antennae thicker than they are; the model is only drawn."""
    seen = 2 * distance * np.tan(np.radians(model.vis.global_.fovy) / 2)
    thin = (model.geom_contype & ANTENNA_BIT) != 0
    thin &= model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE.value
    model.geom_size[thin, 0] = np.maximum(model.geom_size[thin, 0], _THIN * seen / height)


def _add_grid(scene: mujoco.MjvScene, target: Floats) -> None:
    """Lines on the floor around the target, so that one sees it move."""
    middle = np.round(target[:2] / _SPACING) * _SPACING
    half, width = _GRID * _SPACING, _SPACING / 150
    for k in range(-_GRID, _GRID + 1):
        across = middle + k * _SPACING
        _add_line(scene, [half, width, width / 10], [middle[0], across[1], 0.0])
        _add_line(scene, [width, half, width / 10], [across[0], middle[1], 0.0])


def _add_line(scene: mujoco.MjvScene, size: Sequence[float], at: Sequence[float]) -> None:
    geom = scene.geoms[scene.ngeom]
    box, colour = mujoco.mjtGeom.mjGEOM_BOX, np.array(_LINE, dtype=np.float32)
    mujoco.mjv_initGeom(geom, box, size, at, np.eye(3).ravel(), colour)
    scene.ngeom += 1
