"""A model as MJCF: plain names, and every number with all its digits.

The engine's writer gives six digits, and leaves out what is within rounding of its default. Here it
writes 17, which bring back the same double, and what was left out is put in. `difference` tells
whether a model that is read from a text is the same to the bit.
"""

from __future__ import annotations

import contextlib
import ctypes
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from antennate.errors import ConfigError
from antennate.sim.engine import mujoco
from antennate.sim.world import PREFIX

_DIGITS = 17
"""Significant decimal digits that tell any double from its neighbours."""
_LONG = re.compile(r"-?[0-9.]{16,}(e[-+]?[0-9]+)?")
_NAMES = ("names", "names_map", "nnames", "paths", "nbuffer")
"""Parts of a model that names change."""
_LIBRARIES = ("libmujoco.so*", "libmujoco*.dylib")


class Mjcf(NamedTuple):
    """A model as text.

    Attributes:
        text: The MJCF.
        assets: Contents of the files that it names: meshes, textures, height fields.
        difference: Largest difference between each array of the model and of the one that is read
            from the text; empty if all of them are the same to the bit.
    """

    text: str
    assets: Mapping[str, bytes]
    difference: Mapping[str, float]


def to_mjcf(spec: mujoco.MjSpec, title: str) -> Mjcf:
    """A model as MJCF.

    Names lose the prefix `robot/`, and a slash in others becomes an underscore.

    Args:
        spec: The model; it is compiled.
        title: Comment in the first line.
    """
    model = spec.compile()
    with _all_digits():
        root = ElementTree.fromstring(spec.to_xml())  # noqa: S314 the engine's own text
    _drop_empty_defaults(root)
    _fold_frames(root)
    _rename(root)
    _name_servos(root)
    files = {name: name.replace("/", "_") for name in spec.assets}
    for element in root.iter():
        for key in (key for key in element.attrib if key.startswith("file")):
            element.set(key, files.get(element.get(key, ""), element.get(key, "")))
    assets = {files[name]: bytes(content) for name, content in spec.assets.items()}
    _restore(root, model, mujoco.MjModel.from_xml_string(_text(root, title), assets))
    _shorten(root)
    text = _text(root, title)
    again = mujoco.MjModel.from_xml_string(text, assets)
    return Mjcf(text, assets, difference(model, again))


def difference(first: mujoco.MjModel, second: mujoco.MjModel) -> dict[str, float]:
    """The largest difference of each array and option that two models do not share to the bit.

    Names do not count; what has another size or is no number differs by infinity.
    """
    parts = {"": (first, second), "opt.": (first.opt, second.opt)}
    return {
        head + name: _largest(getattr(a, name), getattr(b, name))
        for head, (a, b) in parts.items()
        for name in dir(a)
        if not name.startswith(("_", "name_")) and name not in _NAMES
        if isinstance(getattr(a, name), np.ndarray | float | int)
        if np.asarray(getattr(a, name)).tobytes() != np.asarray(getattr(b, name)).tobytes()
    }


def _largest(first: Any, second: Any) -> float:
    a, b = np.asarray(first), np.asarray(second)
    if a.shape != b.shape or a.dtype.kind not in "fiub":
        return float("inf")
    return float(np.abs(a.astype(float) - b.astype(float)).max())


@contextlib.contextmanager
def _all_digits() -> Iterator[None]:
    """Let the engine write doubles whole; it has a switch for its own programs."""
    folder = Path(mujoco.__file__).parent
    libraries = [path for form in _LIBRARIES for path in sorted(folder.glob(form))]
    try:
        engine = ctypes.CDLL(str(libraries[0]))
        read, write = engine._mjPRIVATE__get_xml_precision, engine._mjPRIVATE__set_xml_precision
    except (IndexError, OSError, AttributeError):
        raise ConfigError(
            "expected an engine that writes numbers with all digits, found mujoco "
            f"{mujoco.__version__}, which does not"
        ) from None
    before = int(read())
    write(_DIGITS)
    try:
        yield
    finally:
        write(before)


def _drop_empty_defaults(root: ElementTree.Element) -> None:
    """Drop the classes of attached parts that set nothing."""
    for top in root.findall("default"):
        for child in [c for c in top if c.tag == "default" and _is_empty(c)]:
            dropped = {each.get("class") for each in child.iter("default")}
            top.remove(child)
            for element in root.iter():
                for key in ("class", "childclass"):
                    if element.get(key) in dropped:
                        del element.attrib[key]
        if not len(top):
            root.remove(top)


def _is_empty(default: ElementTree.Element) -> bool:
    return all(each.tag == "default" for each in default.iter())


def _fold_frames(root: ElementTree.Element) -> None:
    """Give the place of a frame to its only body, where that has none of its own."""
    for parent in list(root.iter()):
        for at, frame in enumerate(list(parent)):
            bodies = list(frame)
            if frame.tag != "frame" or not set(frame.attrib) <= {"pos", "quat"}:
                continue
            if len(bodies) == 1 and bodies[0].tag == "body" and not _has_place(bodies[0]):
                bodies[0].attrib.update(frame.attrib)
                parent[at] = bodies[0]


def _has_place(body: ElementTree.Element) -> bool:
    return not {"pos", "quat", "euler", "axisangle", "xyaxes", "zaxis"}.isdisjoint(body.attrib)


def _rename(root: ElementTree.Element) -> None:
    """Give plain names to what is named, and use them wherever the old ones stand."""
    old = {e.get(key, "") for e in root.iter() for key in ("name", "class") if e.get(key)}
    used = {name for name in old if "/" not in name}
    plain: dict[str, str] = {}
    for name in sorted(old - used):
        new = name.removeprefix(PREFIX).replace("/", "_")
        while new in used:
            new += "_"
        used.add(new)
        plain[name] = new
    for element in root.iter():
        for key, value in element.attrib.items():
            if "/" not in value or key.startswith(("file", "content_type")):
                continue
            words = [value] if value in plain else value.split()
            element.set(key, " ".join(plain.get(word, word) for word in words))


def _name_servos(root: ElementTree.Element) -> None:
    """Write position servos as `position`, which older engines read too."""
    for actuator in root.iter("general"):
        gain = actuator.get("gainprm", "")
        if actuator.get("biasprm") == f"0 -{gain}" and actuator.get("input") == "pos":
            actuator.tag = "position"
            for key in ("input", "biastype", "gainprm", "biasprm"):
                actuator.attrib.pop(key, None)
            actuator.set("kp", gain)


def _restore(root: ElementTree.Element, model: mujoco.MjModel, again: mujoco.MjModel) -> None:
    """Put in what the writer leaves out of named parts.

    That is a turn below 1e-16 rad, a third size where two make the shape, and the sign of a zero.
    """
    for tag, field in (("geom", "quat"), ("body", "quat"), ("site", "size")):
        parts = {e.get("name", ""): e for e in root.iter(tag)}
        values, others = (getattr(each, f"{tag}_{field}") for each in (model, again))
        if values.shape != others.shape:
            continue
        differs = (values.view(np.int64) != others.view(np.int64)).any(axis=1)
        for i in np.flatnonzero(differs).tolist():
            name = getattr(again, tag)(i).name
            if name and (tag != "geom" or field not in parts[name].attrib):
                parts[name].set(field, " ".join(f"{value:.{_DIGITS}g}" for value in values[i]))


def _shorten(root: ElementTree.Element) -> None:
    """Write numbers with as few digits as bring back the same double."""
    for element in root.iter():
        for key, value in element.attrib.items():
            words = (repr(float(w)) if _LONG.fullmatch(w) else w for w in value.split(" "))
            element.set(key, " ".join(words))


def _text(root: ElementTree.Element, title: str) -> str:
    ElementTree.indent(root)
    return f"<!-- {title} -->\n{ElementTree.tostring(root, encoding='unicode')}\n"
