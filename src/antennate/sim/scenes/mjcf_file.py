"""Read an MJCF file of unknown origin.

The engine's own reader opens any file that a model names and accepts models without end and numbers
that are not numbers. So the file is read and bounded here first, and the engine gets a text and the
contents of the files it names, all of them from the folder of the model or below. What still gets
through may crash the engine or keep it busy for ever, so a process of its own compiles it first.
"""

from __future__ import annotations

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

from antennate.errors import SceneError
from antennate.files import read_limited
from antennate.messages import one_line
from antennate.sim.engine import mujoco

LARGEST_MODEL = 5_000_000
"""Most bytes of a model."""
LARGEST_ASSET = 20_000_000
"""Most bytes of a mesh, texture or height field."""
MOST_ELEMENTS = 20_000
"""Most elements of a model, those of `replicate` and the like counted as often as they come."""
_MOST_CPU = 10
"""Most CPU time for the first compilation, the start of its process included [s]."""
_LONGEST_COMPILE = 60.0
"""Most time for it on a busy machine [s]."""
_MOST_MEMORY = 2 << 30
"""Most memory of that process [bytes]."""
_NO_MODEL = 3
"""Its exit code if the file is refused with a reason, which is found again and said later."""
_REFUSED = ("include", "extension", "plugin", "model", "size")
_COUNTED = ("replicate", "composite", "flexcomp")
_DIRECTORIES = ("assetdir", "meshdir", "texturedir")
_LARGEST_SIDE = 4096
"""Most rows or columns of a height field or texture."""
_PREFIX = re.compile(r"^(XML )?Error: (Schema violation: )?")
_ASIDE = re.compile(r"<!--.*?-->|<\?.*?\?>|<!\[CDATA\[.*?\]\]>", re.DOTALL)
_MARK = re.compile(r"\n|<(?!/)")
_TEXTS = ("name", "class", "childclass", "file", "content_type")


def require_compiles(
    path: Path,
    limit: float = _LONGEST_COMPILE,
    child: Sequence[str] = ("-m", "antennate.sim.scenes.mjcf_file"),
) -> None:
    """Let a process of its own compile a model; this one survives whatever happens.

    Args:
        path: The file.
        limit: Time that it may take on the clock [s].
        child: What Python runs there, with the path as its argument.

    Raises:
        SceneError: The engine crashes, or takes longer, or more than 10 s of CPU time.
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
    """Read a model as a spec.

    Raises:
        SceneError: It cannot be read, is too large, or holds what a scene must not hold.
    """
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


if __name__ == "__main__":
    _compile(Path(sys.argv[1]))
