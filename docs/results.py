"""Write the tables of docs/results.md, tracks.md and fit.md; with --check only compare them.

A table stands between `<!-- results of NAME -->` and `<!-- end -->`: the keys of result.json and
the columns of trials.csv of an experiment, from the classes of its result and of its rows.
"""

import re
import sys
from collections.abc import Collection, Iterable, Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

from generated import heads, row

from antennate import experiments
from antennate.params.base import docstrings
from antennate.studies.columns import columns, named

PAGES = ("results", "tracks", "fit")
PART = re.compile(r"(<!-- results of (\w+) -->\n).*?(<!-- end -->\n)", re.DOTALL)
KNOWN = ("schema", "command")
"""Keys of every result, which the page explains once."""
POOLS = ("mean", "median", "largest", "smallest", "total")
"""How many rows become one number, where a word says it."""
WORDS = {
    "controller": "Name of the controller",
    "first_reason": "Why the first invalid one is invalid; `null` if none is",
    "interrupted": "Whether the run was interrupted; the rest then speaks of the trials that had "
    "ended",
    "invalid": "Invalid trials; they are left out of all else",
    "profile": "Springs of the antenna",
    "profiles": "Each profile",
    "reason": "Why it is invalid; empty otherwise",
    "seed": "Seed of the run",
    "statuses": "Trials of each status",
    "successes": "Trials that succeeded",
    "trial": "Number of the trial, from 0; with the seed it decides all chance",
    "trials": "Trials run",
    "void_decisions": "Decisions of a learned policy whose answer was no number, so that the robot "
    "held",
}
"""What a key is in several experiments, unless a class says it by a docstring of its own."""


def texts(kind: type, others: Iterable[type]) -> dict[str, str]:
    """What each field is, by name.

    It is its docstring, else one of `WORDS`, else its label, else what it is in the first other
    class of the experiment.
    """
    found = dict[str, str]()
    for other in reversed([*others]):
        found |= documented(other)
    labels = {each.name: each.label.strip() for each in columns(kind)}
    found |= {name: label[0].upper() + label[1:] for name, label in labels.items() if label}
    return found | WORDS | documented(kind)


def documented(kind: type) -> dict[str, str]:
    """The docstring of each field that has one, by name."""
    found = dict[str, str]()
    for each in reversed(kind.__mro__):
        found |= docstrings(each)
    return found


def parts_of(hint: Any) -> Iterator[tuple[str, type]]:
    """How a field holds parts, and their class; several of a field that holds one or another."""
    if is_dataclass(hint) and isinstance(hint, type):
        yield "Of", hint
    held = getattr(hint, "__origin__", None) in (dict, list, tuple)
    for inner in get_args(hint):
        yield from (("Of each of" if held else how, kind) for how, kind in parts_of(inner))


def table(kind: type, without: Collection[str], others: Iterable[type], pooled: bool = True) -> str:
    """A line for each field: key, unit and meaning; an interval stands beside its number."""
    said, lines = texts(kind, others), list[str]()
    beside = {each.name: each.interval for each in columns(kind) if each.interval}
    pools = {each.name: getattr(each.pool, "__name__", "") for each in columns(kind)}
    units = {  # "1" is none, whatever a name ends with
        each.name: each.unit.removesuffix("1")
        for each in columns(kind)
        if each.unit and each.scale == 1.0
    }
    hints = get_type_hints(kind)
    for field in fields(kind):
        if field.name in without or field.name in beside.values():
            continue
        if field.name not in said:
            raise SystemExit(
                f"{kind.__name__}.{field.name}: expected a docstring or a label, found none"
            )
        keys = [field.name, *filter(None, [beside.get(field.name)])]
        text = " ".join(said[field.name].split()).removesuffix(".")
        pool = pools.get(field.name)
        if pooled and pool in POOLS and not text.endswith(f", {pool}"):
            text += f" ({pool})"
        no_unit = field.name.startswith("per_") or hints[field.name] is bool
        of_name = "" if no_unit else named(field.name).unit
        unit = units.get(field.name, of_name)
        lines.append(row(", ".join(f"`{key}`" for key in keys), unit, text))
    return "\n".join([heads("key", "unit", "meaning"), *lines]) + "\n"


def above(kind: type, seen: dict[type, str]) -> dict[str, str]:
    """Fields that a class has from one whose table is above, and where that is."""
    told = {base: where for each, where in reversed(seen.items()) for base in each.__mro__}
    bases = [base for base in kind.__mro__ if base in told and is_dataclass(base)]
    return {field.name: told[base] for base in bases for field in fields(base)}


def keys_above(known: dict[str, str], seen: dict[type, str]) -> Iterator[tuple[str, str]]:
    """Each place above with a table, and the keys that are told there."""
    whole = {where: {field.name for field in fields(each)} for each, where in seen.items()}
    for where in dict.fromkeys(known.values()):
        keys = [key for key, of in known.items() if of == where]
        every = len(keys) > 1 and whole[where] <= set(known)
        yield where, "all of them" if every else ", ".join(f"`{key}`" for key in keys)


def tables(kind: type, name: str, seen: dict[type, str], rows: list[type]) -> Iterator[str]:
    """The table of a class, then those of its parts, each class and each inherited field once."""
    known = above(kind, seen)
    told = list(keys_above(known, seen))
    hidden = known if seen else KNOWN
    seen[kind] = name
    if any(field.name not in known for field in fields(kind)):
        yield table(kind, hidden, [*rows, *seen])
    for where, keys in told:
        yield f"Keys as in `{where}`: {keys}.\n"
    same: dict[str, list[str]] = {}
    for name, hint in get_type_hints(kind).items():
        parts = list(parts_of(hint))
        for how, inner in parts:
            wider = [kind, *(other for _, other in parts if other is not inner)]
            if inner in seen:
                same.setdefault(seen[inner], []).append(name)
                continue
            if any(issubclass(each, inner) for each in wider):
                keys = ", ".join(f"`{field.name}`" for field in fields(inner))
                yield f"{how} `{name}`: as above, {keys}.\n"
                continue
            yield f"{how} `{name}`: {' '.join((inner.__doc__ or '').split())}\n"
            yield from tables(inner, name, seen, rows)
    for where, names in same.items():
        if others := ", ".join(f"`{name}`" for name in names if name != where):
            yield f"The keys of {others} are those of `{where}`.\n"


def results(name: str) -> str:
    """All tables of an experiment."""
    experiment = experiments.load(name)
    parts = list[str]()
    seen: dict[type, str] = {}
    rows = [experiment.row] if experiment.row is not None else []
    if experiment.result is not None:
        parts += tables(experiment.result, name, seen, rows)
    if experiment.row in seen:
        parts.append(f"A row of `trials.csv` is one of `{seen[experiment.row]}`.\n")
    elif experiment.row is not None:
        known = above(experiment.row, seen)
        said = "A row of `trials.csv` has these keys of `{}`: {}.\n"
        if any(field.name not in known for field in fields(experiment.row)):
            parts += ["A row of `trials.csv`:\n", table(experiment.row, known, seen, pooled=False)]
            said = "And of this trial what `{}` has of many: {}.\n"
        parts += [said.format(*told) for told in keys_above(known, seen)]
    again = [i for i, part in enumerate(parts) if part in parts[:i] and part.startswith("The keys")]
    return "\n".join(part for i, part in enumerate(parts) if i not in again)


def main() -> None:
    """Write or compare."""
    for page in PAGES:
        path = Path(__file__).with_name(f"{page}.md")
        old = path.read_text(encoding="utf-8")
        new = PART.sub(lambda found: f"{found[1]}\n{results(found[2])}\n{found[3]}", old)
        if "--check" not in sys.argv[1:]:
            path.write_text(new, encoding="utf-8")
        elif new != old:
            sys.exit(f"docs/{page}.md is out of date: run `uv run python docs/results.py`")


if __name__ == "__main__":
    main()
