"""The experiments. Every folder here is one; other packages add theirs by an entry point.

A folder holds a module `experiment` with an object `EXPERIMENT`; the first line of its docstring is
the summary. An entry point in the group `antennate.experiments` names such an object; its summary
is found in the same place, so that a list of commands loads no experiment.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from antennate.errors import BadInputError, in_one_line
from antennate.messages import INSTALLATION, nearest, shortened, shown

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from antennate.studies.experiment import Experiment

GROUP = "antennate.experiments"
"""Group of the entry points."""
_LABORATORY = ("compete", "gait", "geometry", "dataset", "reproduce", "tracks", "servo", "fit")
ELSEWHERE = {**dict.fromkeys(_LABORATORY, "antennate-lab"), "build": "antennate-build"}
"""Distributions of ours that may not be installed, by the names of their experiments."""
_NAME = re.compile(r"\w[\w-]*")
FITTED = "fitted"
"""What stands for a file of `fitted`, as in `--config fitted`."""


def is_ours(name: str) -> bool:
    """Whether it is an experiment of this package."""
    return name in _folders()


def home(experiment: Experiment[Any, Any]) -> str:
    """Package whose modules belong to an experiment alone."""
    return experiment.config.__module__.rpartition(".")[0]


def is_explained(experiment: Experiment[Any, Any]) -> bool:
    """Whether docs/results.md says what its rows mean: that of this package or the laboratory."""
    return home(experiment).partition(".")[0] in ("antennate", "antennate_lab")


def names() -> list[str]:
    """Names of all experiments, ours first."""
    return list(dict.fromkeys([*_folders(), *_entries()]))


def fitted() -> dict[str, Path]:
    """Files of numbers that the paper does not give, fitted to it, by name of the experiment."""
    files = Path(__file__).parent.glob(f"{FITTED}/*.toml")
    return {file.stem: file for file in sorted(files)}


def summaries() -> dict[str, str]:
    """Name and summary of every experiment; ours are not loaded for it."""
    texts = {name: _first_line(f"{__name__}.{name}") for name in _folders()}
    for name in names():
        if name not in texts:
            try:
                place, _, last = _entry(name).module.rpartition(".")
                texts[name] = (last == "experiment" and _first_line(place)) or _described(name)
            except BadInputError as error:
                texts[name] = f"({error})"
    return texts


def loaded(tell: Callable[[str], object]) -> dict[str, Experiment[Any, Any]]:
    """Every experiment that can be loaded, by name; of another one `tell` gets the reason."""
    found = {}
    for name in sorted(names()):
        try:
            found[name] = load(name)
        except BadInputError as error:
            tell(str(error))
    return found


def load(name: str) -> Experiment[Any, Any]:
    """The experiment of this name."""
    if is_ours(name):
        return importlib.import_module(f"{__name__}.{name}.experiment").EXPERIMENT
    from antennate.studies.experiment import Experiment

    entry = _entry(name)
    wanted = f"{name}: expected an experiment at {entry.value}, found"
    try:
        found = entry.load()
    except (Exception, SystemExit) as error:  # a module may end the program when it is imported
        raise BadInputError(f"{wanted}: {in_one_line(error)}") from error
    if not isinstance(found, Experiment):
        raise BadInputError(f"{wanted} {shown(found)}")
    return found


def unknown(name: str) -> str:
    """What is said of a name that no experiment has."""
    if name in ELSEWHERE:
        return (
            f"expected the package {ELSEWHERE[name]}, which has {name}, found none; install it "
            f"with {INSTALLATION}"
        )
    known = names()
    hint = nearest(name, known)
    return f"expected an experiment{hint}, one of {', '.join(known)}, found {shortened(name)}"


def _first_line(package: str) -> str:
    """What the docstring of a package begins with; empty where it cannot be imported."""
    text = ""
    with suppress(Exception, SystemExit):  # what is wrong is said where the experiment is loaded
        text = importlib.import_module(package).__doc__ or ""
    return text.partition("\n")[0].rstrip(".")


def _described(name: str) -> str:
    return load(name).description.strip().partition(".")[0]


@functools.cache
def _folders() -> tuple[str, ...]:
    return tuple(module.name for module in pkgutil.iter_modules(__path__) if module.ispkg)


def _entry(name: str) -> EntryPoint:
    """The entry point of this name; one that is found twice, as in a clone, is one."""
    entries = {entry.value: entry for entry in _entries().get(name, ())}
    if not entries:
        raise BadInputError(unknown(name))
    if len(entries) > 1:
        those = " and ".join(
            f"{value} of {entry.dist.name if entry.dist else 'nothing known'}"
            for value, entry in entries.items()
        )
        raise BadInputError(f"expected one experiment {name}, found {those}")
    return next(iter(entries.values()))


def _entries() -> dict[str, list[EntryPoint]]:
    from antennate.lookup import installed  # slow to import

    found: dict[str, list[EntryPoint]] = {}
    for entry in installed(GROUP):
        if not _NAME.fullmatch(entry.name):  # it could not be typed as a command
            continue
        found.setdefault(entry.name, []).append(entry)
    return found
