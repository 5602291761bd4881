"""Find an object by name: one of ours, of another installed package, or of the user's own code."""

from __future__ import annotations

import ast
import functools
import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, TypeVar, cast

from antennate.errors import ConfigError, MissingPackageError, WorkerError, raised
from antennate.messages import extra, nearest, shown

T = TypeVar("T")


ADDED: dict[str, dict[str, Any]] = {}
"""Objects given to `Registry.add`, by group and name; worker processes get them too."""


def require_package(module: str, name: str, what: str = "", package: str = "") -> None:
    """Find out whether a package is there that an extra of ours installs.

    Args:
        module: The module that is imported of it.
        name: The extra.
        what: What needs it, the extra if not given; for the message.
        package: Its name, that of the module if not given.
    """
    if importlib.util.find_spec(module) is None:
        raise MissingPackageError(
            f"{what or name}: expected the package {package or module}, found none; "
            f"install it with {extra(name)}"
        )


def installed(group: str) -> Iterable[EntryPoint]:
    """The entry points of a group that installed packages declare.

    Reading them takes some milliseconds, more than a short trial: a process does it once for each
    `sys.path`, and so does not notice what is installed there while it runs.
    """
    return _installed(tuple(sys.path)).select(group=group)


@functools.cache
def _installed(path: tuple[str, ...]) -> Any:
    return entry_points()


@dataclass(frozen=True)
class NotSent:
    """Stands in a worker process for an added object that could not be sent there.

    Attributes:
        reason: Why; it is said where the object is used.
    """

    reason: str


class Shipped(Mapping[str, T]):
    """Objects of this package by name, each declared in its own module alone.

    A name is looked for in one module after the other, so that the modules behind it are not
    loaded; to list all names loads all of them.

    Args:
        modules: Modules, those of the most usual names first.
        declared: What a module declares, by name.
        where: Whether an object is among these; all are if not given.
        rank: What sorts the names where they are listed; as the modules have them if not given.
    """

    def __init__(
        self,
        modules: Sequence[str],
        declared: Callable[[ModuleType], Mapping[str, T]],
        where: Callable[[T], bool] = lambda found: True,
        rank: Callable[[T], Any] = lambda found: 0,
    ) -> None:
        self._modules, self._declared = modules, declared
        self._where, self._rank = where, rank

    def _found(self) -> Iterator[tuple[str, T]]:
        """Name and object, module by module."""
        for module in self._modules:
            for name, found in self._declared(importlib.import_module(module)).items():
                if self._where(found):
                    yield name, found

    def __getitem__(self, name: str) -> T:
        for each, found in self._found():
            if each == name:
                return found
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        listed = sorted(self._found(), key=lambda pair: self._rank(pair[1]))
        return iter(dict(listed))

    def __len__(self) -> int:
        return sum(1 for _ in self)


class Registry(Generic[T]):
    """Objects of one kind by name.

    A name is one of these:

    - a name of ours, or one given to `add`;
    - an entry point that an installed package declares in `group`;
    - `module:Name`, for a module that Python can import;
    - a file, where objects of this kind can be made of files;
    - `folder/file.py:Name`, the path relative to the working directory. Modules beside the file can
      be imported from it.

    Args:
        kind: What the objects are, in the singular, for messages.
        group: Entry-point group.
        ours: The objects of this package.
        files: What makes an object of a file's name, by the end of that name, such as `.onnx`.

    Attributes:
        added: Objects that were given to `add`, by name.
    """

    def __init__(
        self,
        kind: str,
        group: str,
        ours: Mapping[str, T],
        files: Mapping[str, Callable[[str], T]] | None = None,
    ) -> None:
        self._kind, self._group = kind, group
        self._files = files or {}
        self._ours = ours
        self.added: dict[str, T] = ADDED.setdefault(group, {})
        self._found: dict[str, T] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """All names that need no code of the user, ours first."""
        others = (point.name for point in installed(self._group))
        return tuple(dict.fromkeys((*self._ours, *others, *self.added)))

    def add(self, name: str, value: T) -> None:
        """Make an object known under a name, here and in workers; a later one takes its place.

        Raises:
            ConfigError: The name is that of another object, or holds a colon.
        """
        if ":" in name or name in set(self.names) - set(self.added):
            raise ConfigError(
                f"expected a new name without a colon for a {self._kind}, found {name!r}"
            )
        self.added[name] = value

    def known(self, name: str) -> T | None:
        """The object of a name that was added or found before in this process; no code runs."""
        return self.added.get(name, self._found.get(name))

    def check(self, name: str) -> str:
        """Return the name if it may be valid, that of a file in its shortest form; no code runs.

        Raises:
            ConfigError: It is neither a known name nor MODULE:NAME nor FILE.py:NAME.
        """
        place, _, attribute = name.rpartition(":")
        if name in self._ours or name in self.added or name in self.names:
            return name
        if place and attribute:
            return f"{Path(place)}:{attribute}" if place.endswith(".py") else name
        if Path(name).suffix in self._files:
            return str(Path(name))
        forms = "FILE.xml, MODULE:NAME" if self._kind == "scene" else "MODULE:NAME"
        forms = ", ".join([*(f"FILE{end}" for end in self._files), forms])
        meant = f" (did you mean {name}:NAME?)" if name.endswith(".py") else ""
        ours = f"one of {', '.join(self.names)}, or " if self.names else ""
        raise ConfigError(
            f"expected {ours}{forms} or FILE.py:NAME of your own "
            f"{self._kind}, found {shown(name)}{meant or nearest(name, self.names)}"
        )

    def find(self, name: str) -> T:
        """The object of a name. This imports its module.

        Raises:
            ConfigError: There is none of that name, or its module cannot be imported.
            WorkerError: This is a worker process, and the object could not be sent to it.
        """
        if name in self._ours:
            return self._ours[name]
        if name in self.added:
            if isinstance(added := self.added[name], NotSent):
                raise WorkerError(added.reason)
            return added
        self.check(name)
        if (make := self._files.get(Path(name).suffix)) is not None:
            return make(name)
        try:
            value = self._load(name)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            ours = isinstance(error, LookupError | FileNotFoundError) and str(error)[:3] == "no "
            what = str(error) if ours else raised(error)
            raise ConfigError(f"expected a {self._kind} at {name!r}, found {what}") from error
        if not callable(value):
            raise ConfigError(
                f"expected a class or a function at {name!r}, found {type(value).__name__}"
            )
        found = self._found[name] = cast("T", value)
        return found

    def _load(self, name: str) -> Any:
        for point in installed(self._group):
            if point.name == name:
                return point.load()
        place, _, attribute = name.rpartition(":")
        if place.endswith(".py"):
            module = _module_of(Path(place))
        else:
            module = importlib.import_module(place)
        if not hasattr(module, attribute):
            defined = [n for n, v in vars(module).items() if callable(v) and n[:1] != "_"]
            raise LookupError(f"no {attribute} in {place}{nearest(attribute, defined)}")
        return getattr(module, attribute)


def _require_own_modules(path: Path) -> None:
    """Refuse a file that would be given another module than the one that lies beside it.

    Python knows a module by its name alone, and gives to all the first that it finds. Modules of
    the standard library are left out: they always come first.
    """
    files, seen = [path], set(sys.stdlib_module_names)
    while files:
        for name in _imported(files.pop()) - seen:
            seen.add(name)
            own = _beside(path.parent, name)
            if own is None:
                continue
            files += [own] if own.suffix == ".py" else []
            origin = _origin_of(name, path.parent)
            if origin is None or (own.is_dir() and not origin.is_dir()):
                continue  # any module comes before a bare folder, as a clone of its project is
            if not origin.samefile(own):
                raise LookupError(
                    f"no module {name} of its own: Python gives it {origin}, not {own}; rename "
                    "one, or run each by itself"
                )


def _imported(file: Path) -> set[str]:
    """First parts of the names of modules that a file imports, those relative to it left out."""
    try:
        nodes = list(ast.walk(ast.parse(file.read_bytes())))
    except (OSError, SyntaxError, ValueError):
        return set()  # to import it says why
    whole = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    parts = [n.module for n in nodes if isinstance(n, ast.ImportFrom) and n.module and not n.level]
    return {name.partition(".")[0] for name in (*whole, *parts)}


def _beside(folder: Path, name: str) -> Path | None:
    """What a name means in a folder: the first file of a package, a module, or a bare folder."""
    for path in (folder / name / "__init__.py", folder / f"{name}.py", folder / name):
        if _is_there(path):
            return path
    return None


def _is_there(path: Path) -> bool:
    """Whether there is such a file or folder, as far as it may be looked at."""
    try:
        return path.exists()
    except OSError:
        return False


def _origin_of(name: str, folder: Path) -> Path | None:
    """What Python gives for a name once the folder is searched last; None if that has no file."""
    if name in sys.modules:
        module = sys.modules[name]
        file, places = getattr(module, "__file__", None), getattr(module, "__path__", ())
    else:
        spec = PathFinder.find_spec(name, [*sys.path, str(folder)])
        file = None if spec is None or not spec.has_location else spec.origin
        places = () if spec is None else spec.submodule_search_locations or ()
    place = file or next(iter(places), None)
    return Path(place) if place is not None and _is_there(Path(place)) else None


def _module_of(path: Path) -> ModuleType:
    """Import a file once a process; its folder comes last in the search for modules."""
    path = path.resolve()
    name = f"antennate_user_code.{path.with_suffix('')}"
    if name in sys.modules:
        return sys.modules[name]
    if not path.is_file():
        raise FileNotFoundError(f"no file {path}")
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"no Python file: {path}")
    _require_own_modules(path)
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
