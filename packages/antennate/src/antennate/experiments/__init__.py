"""The experiments. Every folder here is one; other packages add theirs by an entry point.

A folder holds a module `experiment` with an object `EXPERIMENT`; the first line of its docstring is
the summary. An entry point in the group `antennate.experiments` names such an object.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
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


def names() -> list[str]:
    """Names of all experiments, ours first."""
    return list(dict.fromkeys([*_folders(), *_entries()]))


def fitted() -> dict[str, Path]:
    """Files of numbers that the paper does not give, fitted to it, by name of the experiment."""
    files = Path(__file__).parent.glob(f"reproduce/{FITTED}/*.toml")
    return {file.stem: file for file in sorted(files)}


def summaries() -> dict[str, str]:
    """Name and summary of every experiment; ours are not loaded for it."""
    texts = {}
    for name in _folders():
        text = importlib.import_module(f"{__name__}.{name}").__doc__ or ""
        texts[name] = text.splitlines()[0].rstrip(".")
    for name in names():
        if name not in texts:
            try:
                texts[name] = load(name).description.strip().partition(".")[0]
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


@functools.cache
def _folders() -> tuple[str, ...]:
    return tuple(module.name for module in pkgutil.iter_modules(__path__) if module.ispkg)


def _entries() -> dict[str, EntryPoint]:
    from antennate.lookup import installed  # slow to import

    return {entry.name: entry for entry in installed(GROUP)}
