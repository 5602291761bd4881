"""What is said of the engine before it is imported: which is installed, its warnings, how it draws.

`mujoco` and, from 4.0 on, `mujoco-core` write the same files. The engine prints its warnings and
writes them to `MUJOCO_LOG.TXT`; commands and their workers drop them, as worlds read the engine's
counters instead. In a program of one's own they stay as they are. Drawing without a display goes by
EGL, else OSMesa, whichever works; a driver that does not fit may crash a process, so each is tried
in a child process first.
"""

from __future__ import annotations

import contextlib
import functools
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import metadata
from importlib.util import find_spec
from typing import Any

from antennate.errors import BadInputError, MissingPackageError
from antennate.messages import extra, shown

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


_only = [False]


def describe_only(asked: bool) -> None:
    """Say, before the engine is imported, whether nothing is simulated."""
    _only[0] = asked


def is_described() -> bool:
    """Whether nothing is simulated."""
    return _only[0]


_dropping = [0]
"""Number of `dropped` blocks that are open."""


@contextlib.contextmanager
def dropped() -> Iterator[None]:
    """Drop warnings of the engine for a while, also if it is imported only then."""
    engine = _engine()
    before = engine.get_mju_user_warning() if engine is not None else None
    _dropping[0] += 1
    drop_if_asked()
    try:
        yield
    finally:
        _dropping[0] -= 1
        engine = _engine()
        if engine is not None:
            engine.set_mju_user_warning(before)


def drop_if_asked() -> None:
    """Drop warnings of the engine within `dropped`, once it is imported."""
    engine = _engine()
    if engine is not None and _dropping[0]:
        engine.set_mju_user_warning(lambda message: None)


def _engine() -> Any:
    """The engine if it is imported, and one that can be asked; None otherwise."""
    engine = sys.modules.get("mujoco")
    return engine if hasattr(engine, "get_mju_user_warning") else None


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
    setting = os.environ.get(_NAME, "")
    if setting != _OFF:
        _wish[0] = setting
    os.environ[_NAME] = _OFF


@functools.cache
def backend() -> str:
    """The first way to draw that works, or the one that MUJOCO_GL names."""
    if find_spec("OpenGL") is None:
        raise MissingPackageError(
            f"video: expected the package PyOpenGL, found none; install it with {extra('video')}"
        )
    setting = os.environ.get(_NAME, "")
    wanted = (_wish[0] if setting == _OFF else setting).strip().lower()
    if wanted and wanted not in BACKENDS:
        raise BadInputError(f"{_NAME}: expected {' or '.join(BACKENDS)}, found {shown(wanted)}")
    names = [wanted] if wanted in BACKENDS else list(BACKENDS)
    troubles = {}
    for name in names:
        troubles[name] = _trouble(name)
        if not troubles[name]:
            return name
    reasons = ", ".join(f"{name} ({why})" for name, why in troubles.items())
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
