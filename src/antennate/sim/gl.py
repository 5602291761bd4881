"""Drawing without a display: EGL, else OSMesa, whichever works here.

A driver that does not fit may crash a process, so each is tried in a child process first.
"""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from importlib.util import find_spec

from antennate.errors import BadInputError, MissingPackageError
from antennate.messages import extra, shown

BACKENDS = {"egl": "libegl1 libgl1-mesa-dri", "osmesa": "libosmesa6"}
"""Ways to draw, best first, and the Debian packages of each."""
_NAME, _OFF = "MUJOCO_GL", "disable"
_PATIENCE = 60.0
"""Longest wait for a trial [s]; the first one compiles shaders."""
_TRIAL = """
import importlib, sys, mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
context = importlib.import_module("mujoco." + sys.argv[1]).GLContext(16, 16)
context.make_current()
mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value).free()
context.free()
"""
_wish = [""]
"""What MUJOCO_GL said when the command began."""


def keep_wish() -> None:
    """Keep what MUJOCO_GL says for `backend`, and let the engine load no way to draw.

    The engine reads it when it is imported, and raises there if it cannot be used, even where
    nothing is drawn. If it says nothing, the engine loads GLFW, which starts a process. Processes
    of workers inherit the setting.
    """
    said = os.environ.get(_NAME, "")
    if said != _OFF:
        _wish[0] = said
    os.environ[_NAME] = _OFF


@functools.cache
def backend() -> str:
    """The first way to draw that works, or the one that MUJOCO_GL names.

    Raises:
        MissingPackageError: PyOpenGL is not installed.
        BadInputError: None works; the text names the packages of the system to install. Or
            MUJOCO_GL names something else.
    """
    if find_spec("OpenGL") is None:
        raise MissingPackageError(
            f"video: expected the package PyOpenGL, found none; install it with {extra('video')}"
        )
    said = os.environ.get(_NAME, "")
    wanted = (_wish[0] if said == _OFF else said).strip().lower()
    if wanted and wanted not in BACKENDS:
        raise BadInputError(f"{_NAME}: expected {' or '.join(BACKENDS)}, found {shown(wanted)}")
    names = [wanted] if wanted in BACKENDS else list(BACKENDS)
    found = {}
    for name in names:
        found[name] = _trouble(name)
        if not found[name]:
            return name
    reasons = ", ".join(f"{name} ({why})" for name, why in found.items())
    cures = " or ".join(f"`apt-get install {BACKENDS[name]}`" for name in names)
    raise BadInputError(
        f"video: expected EGL or OSMesa to draw without a display, found none that works: "
        f"{reasons}; {cures}"
    )


def _trouble(name: str) -> str:
    """Why a way to draw does not work; empty if it does."""
    env = {**os.environ, "MUJOCO_GL": name, "PYOPENGL_PLATFORM": name}
    try:
        done = subprocess.run(  # noqa: S603 our own code
            [sys.executable, "-c", _TRIAL, name],
            env=env,
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no answer in {_PATIENCE:g} s"
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines()
    return lines[-1][:120] if lines else f"exit code {done.returncode}"
