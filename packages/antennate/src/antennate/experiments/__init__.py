"""The experiments. Every folder here is one; other packages add theirs by an entry point.

A folder holds a module `experiment` with an object `EXPERIMENT`; the first line of its docstring is
the summary. An entry point in the group `antennate.experiments` names such an object; its summary
is found in the same place, so that a list of commands loads no experiment.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from antennate.errors import BadInputError, in_one_line
from antennate.messages import nearest, shortened

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from antennate.studies.experiment import Experiment

GROUP = "antennate.experiments"
"""Group of the entry points."""
FITTED = "fitted"
"""What stands for a file of `fitted`, as in `--config fitted`."""


def is_ours(name: str) -> bool:
    """Whether it is an experiment of this package."""
    return name in _folders()


def home(experiment: Experiment[Any, Any]) -> str:
    """Package whose modules belong to an experiment alone."""
    return experiment.config.__module__.rpartition(".")[0]


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
    for name, entry in _entries().items():
        if name not in texts:
            try:
                place, _, last = entry.module.rpartition(".")
                texts[name] = (last == "experiment" and _first_line(place)) or _described(name)
            except BadInputError as error:
                texts[name] = f"({error})"
    return texts


def load(name: str) -> Experiment[Any, Any]:
    """The experiment of this name."""
    if is_ours(name):
        return importlib.import_module(f"{__name__}.{name}.experiment").EXPERIMENT
    entries = _entries()
    if name not in entries:
        raise BadInputError(unknown(name))
    try:
        return entries[name].load()
    except (Exception, SystemExit) as error:  # a module may end the program when it is imported
        raise BadInputError(
            f"{name}: expected an experiment at {entries[name].value}, found: {in_one_line(error)}"
        ) from error


def unknown(name: str) -> str:
    """What is said of a name that no experiment has."""
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


def _entries() -> dict[str, EntryPoint]:
    from antennate.lookup import installed  # slow to import

    return {entry.name: entry for entry in installed(GROUP)}
