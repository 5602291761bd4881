"""Objects of a user for workers: what was added to registries here is known there, too."""

from __future__ import annotations

import contextlib
import operator
import os
import pickle
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from multiprocessing.spawn import prepare
from pathlib import Path
from typing import Any

from antennate.errors import WorkerError, in_one_line
from antennate.lookup import ADDED, NotSent

Packed = Mapping[str, Mapping[str, bytes]]
"""Objects that were added to registries, by registry and name, each pickled."""


def by_value() -> Callable[[Any], bytes] | None:
    """What packs an object that no worker can import, as one of a prompt, where it is installed."""
    try:
        from cloudpickle import dumps
    except ImportError:
        return None
    return dumps


def pack_whole(each: Any) -> bytes:
    """An object for workers that have not imported the program; with it where its file is."""
    dumps = by_value() or pickle.dumps
    path = os.path.abspath(getattr(sys.modules["__main__"], "__file__", None) or "")  # noqa: PTH100
    name = getattr(each, "__qualname__", None)  # an instance has none
    if getattr(each, "__module__", None) != "__main__" or not name or not Path(path).is_file():
        return dumps(each)
    program = _OfProgram(path, Path(path).read_bytes(), name, dumps(each))
    return pickle.dumps(program)


IMPORTING: list[str] = []
"""The program that this worker imports now: it may run nothing."""


@dataclass(frozen=True)
class _OfProgram:
    """An object of the program, which a process of our own imports as those of one machine do.

    So a trial may begin processes that find by name what it gives them.
    """

    path: str
    source: bytes
    name: str
    content: bytes

    def found(self, may_import: bool) -> Any:
        """The object by its name if the same program can be imported here, else a copy."""
        with contextlib.suppress(Exception, SystemExit):
            if may_import and Path(self.path).read_bytes() == self.source:
                IMPORTING.append(self.path)
                try:
                    prepare({"init_main_from_path": self.path})
                finally:
                    IMPORTING.clear()
            if getattr(sys.modules["__main__"], "__file__", None) == self.path:
                return operator.attrgetter(self.name)(sys.modules["__main__"])
        return pickle.loads(self.content)  # noqa: S301  (the driver wrote it)


def _pack(each: Any) -> bytes:
    """An object by its name, as workers that import the program find it; one of a prompt whole."""
    dumps = pickle.dumps if _has_file(each) else by_value()
    return (dumps or pickle.dumps)(each)


def _has_file(each: Any) -> bool:
    """Whether the module of an object can be imported elsewhere; that of a prompt cannot."""
    module = sys.modules.get(getattr(each, "__module__", None) or "")
    spec, file = getattr(module, "__spec__", None), getattr(module, "__file__", None)
    return module is None or spec is not None or (file is not None and Path(file).is_file())


def require_sent(names: Iterable[str]) -> None:
    """Check that the objects of these names that were added here can be sent to workers."""
    named = set(names)
    for objects in ADDED.values():
        for name in sorted(objects.keys() & named):
            if isinstance(sent := sendable(objects[name]), NotSent):
                raise WorkerError(f"{name}: {sent.reason}")


def added_objects(dumps: Callable[[Any], bytes] = _pack) -> Packed:
    """Objects that were added to registries here, for workers; what cannot be sent says so.

    Each is packed apart, so that one that a worker cannot read costs no other.

    Args:
        dumps: What packs one: `cloudpickle.dumps` also packs what was typed at a prompt.
    """
    return {
        group: {name: dumps(sendable(each)) for name, each in objects.items()}
        for group, objects in ADDED.items()
    }


def take_added(added: Packed, may_import: bool = False) -> None:
    """In a worker: know the objects that were added in the driver.

    Args:
        added: Those objects.
        may_import: Whether this process may import the driver's program as its own.
    """
    for group, objects in added.items():
        objects_read = {name: _read(each, may_import) for name, each in objects.items()}
        ADDED.setdefault(group, {}).update(objects_read)


def _read(content: bytes, may_import: bool) -> Any:
    """In a worker: an object that was sent, or what says why it cannot be read here."""
    try:
        each = pickle.loads(content)  # noqa: S301  (the driver wrote it)
        return each.found(may_import) if isinstance(each, _OfProgram) else each
    except Exception as error:  # noqa: BLE001  (an object's own module may raise anything)
        return NotSent(
            f"expected an object of your own that workers can import, found {in_one_line(error)}"
        )


def sendable(each: Any) -> Any:
    """An object if it can be sent to a worker, else what says why not."""
    try:
        pickle.dumps(each)
    except Exception as error:  # noqa: BLE001  (an object's own code may raise anything)
        return NotSent(
            f"expected what can be sent to workers, found {in_one_line(error)}; an object of "
            "your own has to be defined at the top of a module, or run with one worker"
        )
    if not _has_file(each) and (each.__module__ != "__main__" or by_value() is None):
        return NotSent(
            f"expected what workers can import, found it in {each.__module__} without a file, as "
            "in a notebook cell or after -c; put it in a file and import that, or use one worker"
        )
    return each
