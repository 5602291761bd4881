"""A scene from an MJCF file of unknown origin, with the sites `start` and `exit`.

The engine's own reader opens any file that a model names and accepts models without end and numbers
that are not numbers. So the file is read and bounded here first, and the engine gets a text and the
contents of the files it names, all of them from the folder of the model or below. What still gets
through may crash the engine or keep it busy for ever, so a process of its own compiles it first.
"""

from __future__ import annotations

import itertools
import math
import os
import re
import resource
import signal
import subprocess
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from antennate.errors import SceneError
from antennate.files import read_limited
from antennate.messages import one_line
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.parts import FLOOR_BIT, OBSTACLE_BIT
from antennate.sim.places import outline
from antennate.sim.scenes.scene import Route, add_floor
from antennate.types import Floats

LARGEST_MODEL = 5_000_000
"""Most bytes of a model."""
LARGEST_ASSET = 20_000_000
"""Most bytes of a mesh, texture or height field."""
MOST_ELEMENTS = 20_000
"""Most elements of a model, those of `replicate` and the like counted as often as they come."""
_MOST_CPU = 10
"""Most CPU time for the first compilation, the start of its process included [s]."""
_LONGEST_COMPILE = 60.0
"""Most time for that compilation on a busy machine [s]."""
_MOST_MEMORY = 2 << 30
"""Most memory of that process [bytes]."""
_NO_MODEL = 3
"""Exit code of that process for a refused file; the reason is found again and said later."""
_REFUSED = ("include", "extension", "plugin", "model", "size", "lengthrange")
_COUNTED = ("replicate", "composite", "flexcomp")
_DIRECTORIES = ("assetdir", "meshdir", "texturedir")
_OBEYED = (
    *("angle", "eulerseq", "autolimits", "coordinate", "usethread"),
    *("inertiafromgeom", "inertiagrouprange", "alignfree", "discardvisual"),
    *("fusestatic", *_DIRECTORIES),
)
"""Attributes of `<compiler>` that mean the same in a scene, in its export, and alone."""
_LARGEST_SIDE = 4096
"""Most rows or columns of a height field or texture."""
_PREFIX = re.compile(r"^(XML )?Error: (Schema violation: )?")
_ASIDE = re.compile(r"<!--.*?-->|<\?.*?\?>|<!\[CDATA\[.*?\]\]>", re.DOTALL)
_MARK = re.compile(r"\n|<(?!/)")
_TEXTS = ("name", "class", "childclass", "file", "content_type")


def require_compiles(
    path: Path,
    limit: float = _LONGEST_COMPILE,
    child: Sequence[str] = ("-m", "antennate.sim.scenes.mjcf"),
) -> None:
    """Let a process of its own compile a model; this one survives whatever happens.

    Args:
        path: The file.
        limit: Time that it may take on the clock [s].
        child: What Python runs there, with the path as its argument.
    """
    try:
        code = subprocess.run(  # noqa: S603 a list of words, no shell: this Python and our own module
            [sys.executable, "-P", *child, str(path)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},  # each thread reserves memory
            timeout=limit,
            check=False,
        ).returncode
    except subprocess.TimeoutExpired:
        raise _too_slow(path, f"{limit:g} s") from None
    if code == -signal.SIGXCPU:
        raise _too_slow(path, f"{_MOST_CPU} s of CPU time")
    if code not in (0, _NO_MODEL):
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        raise SceneError(f"{path}: expected an MJCF model, found one that crashes MuJoCo ({how})")


def _too_slow(path: Path, limit: str) -> SceneError:
    return SceneError(f"{path}: expected a model that MuJoCo compiles within {limit}, found none")


def read_spec(path: Path) -> mujoco.MjSpec:
    """Read a model as a spec."""
    data = read_limited(path, LARGEST_MODEL, SceneError)
    try:
        if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
            raise SceneError("expected no DOCTYPE and no ENTITY")
        root = ElementTree.fromstring(data)  # noqa: S314 without DOCTYPE there are no entities
        _check(root)
        assets = _take_assets(root, path.parent)
        return mujoco.MjSpec.from_string(_text(root, data), assets=assets)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from error
    except ElementTree.ParseError as error:
        (line, column), what = error.position, str(error).split(":")[0]
        raise SceneError(
            f"{path}: expected an MJCF model, found broken XML at line {line}, column "
            f"{column + 1}: {what}"
        ) from error
    except (ValueError, mujoco.FatalError) as error:
        raise SceneError(f"{path}: expected an MJCF model, found {in_words(error)}") from error


def in_words(error: Exception) -> str:
    """What the engine says of a model, without the names of its parts."""
    return _PREFIX.sub("", one_line(str(error)))


def _text(root: ElementTree.Element, data: bytes) -> str:
    """The model as text, each element at its line of the file, which the engine's messages name."""
    elements, lines, line = list(root.iter()), [], 1
    text = data.decode(errors="replace")
    for mark in _MARK.finditer(_ASIDE.sub(lambda aside: "\n" * aside.group().count("\n"), text)):
        if mark.group() == "\n":
            line += 1
        else:
            lines.append(line)
    if len(lines) != len(elements):  # another encoding
        return ElementTree.tostring(root, encoding="unicode")
    before = {}
    for parent in elements:
        parent.text = parent.tail = None
        before |= dict(zip(parent, [None, *parent], strict=False))
    parents = {child: parent for parent in elements for child in parent}
    for child, (last, own) in zip(elements[1:], pairwise(lines), strict=True):
        gap, previous = "\n" * (own - last), before[child]
        if previous is None:
            parents[child].text = gap
        else:
            previous.tail = gap
    return "\n" * (lines[0] - 1) + ElementTree.tostring(root, encoding="unicode")


def _check(root: ElementTree.Element) -> None:
    """Refuse what a scene must not hold, and bound what it may."""
    if root.tag != "mujoco":
        raise SceneError(f"expected an MJCF model, found the element <{root.tag}>")
    total, waiting = 0, [(root, 1)]
    while waiting:
        element, copies = waiting.pop()
        total += copies
        if element.tag in _REFUSED:
            raise SceneError(f"expected no <{element.tag}> in a scene, found one")
        if element.tag in ("option", "flag") and element.attrib:
            raise SceneError(
                f"expected no <{element.tag}> with values in a scene, found "
                f"{', '.join(element.attrib)}; the parameters `physics` set the numerics"
            )
        if element.tag == "compiler" and (more := [k for k in element.attrib if k not in _OBEYED]):
            raise SceneError(
                f"expected no {', '.join(more)} of <compiler> in a scene, found "
                f"{', '.join(f'{k}={element.attrib[k]!r:.60}' for k in more)}; masses and "
                f"inertias are to be written out; obeyed are {', '.join(_OBEYED)}"
            )
        _check_numbers(element)
        if element.tag in _COUNTED:
            copies *= math.prod(max(1, int(float(n))) for n in element.get("count", "1").split())
        if total > MOST_ELEMENTS or copies > MOST_ELEMENTS:
            raise SceneError(f"expected at most {MOST_ELEMENTS} elements, copies counted")
        waiting.extend((child, copies) for child in element)


def _check_numbers(element: ElementTree.Element) -> None:
    for key, text in element.attrib.items():
        if key in _TEXTS:
            continue
        for word in text.split():
            try:
                value = float(word)
            except ValueError:
                continue
            if not math.isfinite(value):
                raise SceneError(f"expected finite numbers, found {key}={text!r:.60}")
            if key in ("nrow", "ncol", "width", "height") and value > _LARGEST_SIDE:
                raise SceneError(f"expected {key} of at most {_LARGEST_SIDE}, found {word}")


def _take_assets(root: ElementTree.Element, folder: Path) -> dict[str, bytes]:
    """Read the files that a model names, and let it name them by number."""
    directories = dict.fromkeys(_DIRECTORIES, "")
    for compiler in root.iter("compiler"):
        for key in _DIRECTORIES:
            directories[key] = compiler.attrib.pop(key, directories[key])
    assets: dict[str, bytes] = {}
    for element in root.iter():
        own = directories["texturedir" if element.tag == "texture" else "meshdir"]
        for key in [key for key in element.attrib if key.startswith("file")]:
            named = element.get(key, "")
            path = _below(folder, Path(own or directories["assetdir"], named))
            element.attrib.setdefault("name", Path(named).stem)
            element.set(key, f"{len(assets)}{Path(named).suffix}")
            assets[element.get(key, "")] = read_limited(path, LARGEST_ASSET, SceneError)
    return assets


def _below(folder: Path, named: Path) -> Path:
    """The path of a file, which must be below the folder, links resolved."""
    path = (folder / named).resolve()
    if named.is_absolute() or not path.is_relative_to(folder.resolve()):
        raise SceneError(
            f"expected files in the folder of the model or below, found {str(named)!r}"
        )
    return path


def _compile(path: Path) -> None:
    """What that process does."""
    resource.setrlimit(resource.RLIMIT_AS, (_MOST_MEMORY, _MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (_MOST_CPU, _MOST_CPU + 1))
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        model = read_spec(path).compile()
    except (SceneError, ValueError):
        sys.exit(_NO_MODEL)
    mujoco.mj_forward(model, mujoco.MjData(model))


PREFIX = "scene/"
_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
_OWN_BITS = 8
"""The file's collision bits are moved up by so many, past those of the robot and the floor."""
_MOST_BITS = 1 << 20
_VIA = re.compile("via[0-9]+")


class MjcfScene:
    """Scene from an MJCF file, the same in every trial.

    The head starts at the site `start` and faces the next site; progress is arc length from there
    through the sites `via0`, `via1` and so on, if there are any, to `exit`. Heights of sites do not
    count. A horizontal plane at z = 0 is the floor; a floor is added if there is none. Whatever
    would touch a geom with MuJoCo's default collision bits touches the robot: body, legs, antennae.

    Args:
        path: The file.
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
            geom.contype |= FLOOR_BIT
            has_floor = True
        else:
            geom.contype |= OBSTACLE_BIT
            geom.conaffinity |= FLOOR_BIT
    return has_floor


def _is_floor(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> bool:
    plane = model.geom_type[geom] == _PLANE
    level = abs(data.geom_xmat[geom].reshape(3, 3)[2, 2] - 1.0) < 1e-6
    return bool(plane and level and abs(data.geom_xpos[geom, 2]) < 1e-6)


if __name__ == "__main__":
    _compile(Path(sys.argv[1]))
