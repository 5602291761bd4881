"""What a run is: command, configuration, versions and code; and how two runs differ."""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
import inspect
import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import antennate
import dynamixel_bus
import geometric_locomotion
from antennate.lookup import ADDED
from antennate.messages import shortened
from antennate.params.base import Params
from antennate.telemetry.header import versions

_SHOWN = 5
"""Most differences that are told."""
_NONE = "nothing"


def identity(command: str, config: Params) -> dict[str, Any]:
    """What decides the numbers of a run, as JSON can hold it."""
    values = json.loads(config.model_dump_json())
    shared = environment(command, config)
    more, module = _code_added(_names(config)), type(config).__module__
    if not module.startswith("antennate."):  # of another package
        more |= _module(module)
    return {
        "command": command,
        "config": values,
        "versions": shared["versions"],
        "code": shared["code"] | more,
    }


def packages_used(command: str, config: Params) -> tuple[str, ...]:
    """Optional packages that its numbers depend on: of policies, GPU, search."""
    words, values = command.split(), _names(config)
    return (
        *(("onnxruntime",) if any(text.endswith(".onnx") for text in values) else ()),
        *(("mujoco-warp", "warp-lang") if "warp" in words else ()),
        *(("optuna",) if getattr(config, "plan", "") == "optuna" else ()),
    )


def environment(command: str = "", config: Params | None = None) -> dict[str, Any]:
    """The part of it that driver and workers must share; without a command, of this package."""
    packages = () if config is None else packages_used(command, config)
    named = {} if config is None else code_named(_names(config)) | _package_of(config)
    return {"versions": dict(versions(packages)), "code": code() | named}


def _package_of(config: Params) -> dict[str, str]:
    """Checksums of the package that has an experiment; none if it is ours, or a single module."""
    package, dot, _ = type(config).__module__.partition(".")
    return _sources(package) if dot and package != antennate.__name__ else {}


def _names(config: Params) -> list[str]:
    """All texts of a configuration, and those of a file that it names."""
    return [*texts(config.model_dump(mode="json")), *config.names_in_files()]


def environment_here(theirs: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """What a worker has of the environment of its driver, which works in this folder."""
    files = dict(code())
    for name in theirs["code"].keys() - files.keys():
        file = folder / name
        if file.is_file():
            files[name] = _checksum(file)
        elif "/" in name and _is_module(package := name.partition("/")[0]):
            files |= _sources(package)
        elif _is_module(name):
            files |= _module(name)
    return {"versions": dict(versions(tuple(theirs["versions"]))), "code": files}


@functools.cache
def code() -> dict[str, str]:
    """Checksum of every file of our packages, but those that only talk to people."""
    checksums = {}
    for room in (antennate, dynamixel_bus, geometric_locomotion):
        checksums |= _sources(room.__name__)
    return checksums


def _sources(package: str) -> dict[str, str]:
    """Checksum of every file of a package, but those that only talk to people."""
    first, checksums = _file_of(package), {}
    root = first.parent if first else Path()
    for path in sorted(root.rglob("*.py")) if first else ():
        if (file := path.relative_to(root)).parts[0] not in ("cli", "command.py"):
            checksums[f"{root.name}/{file.as_posix()}"] = _checksum(path)
    return checksums


def code_named(values: Any) -> dict[str, str]:
    """Checksums of files that a configuration names: FILE, FILE.py:NAME or MODULE:NAME.

    Beside FILE.py also what it imports of its own folder.
    """
    checksums = {}
    for text in texts(values):
        place, _, name = text.rpartition(":")
        file = Path(place if name and place else text)
        if file.suffix and file.is_file():
            files = _with_imports(file) if file.suffix == ".py" else [file]
            checksums |= {str(each): _checksum(each) for each in files}
        elif place and name.isidentifier() and all(map(str.isidentifier, place.split("."))):
            checksums |= _module(place)
    return checksums


def _with_imports(first: Path) -> list[Path]:
    """A file and all beside it that it imports, or that those import."""
    paths = [first]
    for file in paths:
        try:
            nodes = [*ast.walk(ast.parse(file.read_bytes()))]
        except (SyntaxError, ValueError):
            continue  # it is told where it is imported
        names = [
            alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names
        ]
        names += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
        for name in dict.fromkeys(name.partition(".")[0] for name in names):
            module, package = first.with_name(f"{name}.py"), first.parent / name
            beside = [module] if module.is_file() else sorted(package.rglob("*.py")) if name else []
            paths += [each for each in beside if each not in paths]
    return paths


def _code_added(values: Any) -> dict[str, str]:
    """Checksums of the source of objects that were added to a registry and are named."""
    named = set(texts(values))
    added = [pair for objects in ADDED.values() for pair in objects.items() if pair[0] in named]
    checksums = {}
    for name, each in added:
        try:
            source = inspect.getsource(each)
        except (OSError, TypeError):
            continue  # typed at a prompt
        checksums[name] = hashlib.sha256(source.encode()).hexdigest()[:16]
    return checksums


def _module(name: str) -> dict[str, str]:
    file = _file_of(name)
    return {} if file is None else {name: _checksum(file)}


def _file_of(name: str) -> Path | None:
    """The file of a module, or the first one of a package; None if it has none."""
    try:
        loaded = getattr(sys.modules.get(name), "__file__", None)
        spec = None if loaded else importlib.util.find_spec(name)
    except (ImportError, ValueError, AttributeError):
        return None
    file = loaded or (spec.origin if spec else None)
    return Path(file) if file and Path(file).is_file() else None


def _checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def texts(values: Any) -> Iterator[str]:
    """All texts in nested tables and lists."""
    if isinstance(values, str):
        yield values
    elif isinstance(values, Mapping | list | tuple):
        for item in values.values() if isinstance(values, Mapping) else values:
            yield from texts(item)


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """What differs, in words; empty if nothing does."""
    before, after = dict(_flat(old, ())), dict(_flat(new, ()))
    changes = [
        _told(path, before.get(path, _NONE), after.get(path, _NONE))
        for path in dict.fromkeys([*before, *after])
        if before.get(path, _NONE) != after.get(path, _NONE)
    ]
    more = f" and {len(changes) - _SHOWN} more" if len(changes) > _SHOWN else ""
    return ", ".join(changes[:_SHOWN]) + more


def but_trials(known: Mapping[str, Any]) -> Mapping[str, Any]:
    """What is run, without how many trials of it."""
    config = {k: v for k, v in known["config"].items() if k != "trials"}
    if isinstance(settings := config.get("settings"), Mapping):
        config["settings"] = {k: v for k, v in settings.items() if k != "trials"}
    return {**known, "config": config}


def _told(path: tuple[str, ...], old: Any, new: Any) -> str:
    group, name = path[0], ".".join(path[1:])
    if group == "code":
        kind = "module" if _is_module(name) else "file"
        change = "is new" if old == _NONE else "is gone" if new == _NONE else "changed"
        return f"the {kind} {name} {change}"
    return f"{name or group} {_short(old)}, now {_short(new)}"


def _is_module(name: str) -> bool:
    return not name.endswith(".py") and all(map(str.isidentifier, name.split(".")))


def _short(value: Any) -> str:
    return value if value == _NONE else shortened(json.dumps(value))


def _flat(values: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    if isinstance(values, Mapping) and values:
        for key, item in values.items():
            yield from _flat(item, (*path, str(key)))
    else:
        yield path, values
