"""The report of a run: one HTML page that needs nothing else, made from its run directory alone.

It says what was run, what came out with its intervals, and shows figures and films. Two runs of one
command make a page that sets them side by side.
"""

from __future__ import annotations

import json
import shlex
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from antennate import messages
from antennate.errors import BadInputError
from antennate.files import read_limited
from antennate.params.base import Params
from antennate.studies import page
from antennate.studies.columns import NONE
from antennate.studies.formats import to_toml
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import (
    BY_HAND,
    COMMAND,
    CONFIG,
    FIGURES,
    FILMS,
    LARGEST,
    REPORT,
    RESULT,
    TABLE,
    when_run,
)
from antennate.studies.tables import FEW, FEW_PER_POINT, Table
from antennate.studies.trial_file import TRIALS

_MOST_REASONS = 20
"""Most trials whose failure is quoted."""
Result = Mapping[str, Any]
Body = Callable[[Result, Mapping[str, str]], str]
"""HTML of a result and of its figures, images by name."""


@dataclass(frozen=True)
class View:
    """How the result of a command is shown.

    Attributes:
        name: Name of the command.
        about: What it does; the first paragraph is shown.
        config: Its configuration.
        tables: Tables of a result.
        sentence: What came out, in one sentence.
        body: HTML in place of tables and figures; None for these.
        captions: What each figure shows, by its name, in one sentence.
    """

    name: str
    about: str
    config: type[Params] | None
    tables: Callable[[Result], Sequence[Table]]
    sentence: Callable[[Result], str]
    body: Body | None = None
    captions: Mapping[str, str] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """The command as it is typed."""
        return f"antennate {messages.command_words(self.name)}"

    @property
    def figures(self) -> list[str]:
        """Names of the files of its figures."""
        return [f"{FIGURES}/{name}.{kind}" for name in self.captions for kind in ("svg", "png")]

    def ordered(self, figures: Iterable[str]) -> list[str]:
        """Names of figures in the order of the captions, others behind: the first is the picture.

        A result begins with it, in a report and in a notebook.
        """
        known = list(self.captions)
        return sorted(figures, key=lambda n: (known.index(n) if n in known else len(known), n))

    def caption(self, figure: str) -> str:
        """What a figure shows: the sentence of its command, else its name in words."""
        words = figure.replace("_", " ")
        return self.captions.get(figure) or words[:1].upper() + words[1:]


def command_of(run: RunDirectory) -> str:
    """Name of the command that made a run."""
    result = run.result() if (run.path / RESULT).exists() else {}
    words = shlex.split(run.text(COMMAND).partition("\n")[0])
    name = result.get("command") if isinstance(result, dict) else None
    name = name or messages.command_of(words[1:])
    if not name or not isinstance(name, str):
        raise BadInputError(f"{run.path}: expected a run that names its command, found none")
    return name


def write_report(run: RunDirectory, view: View) -> None:
    """Write the page of a run into its directory."""
    run.write(REPORT, report(run, view))


def report(run: RunDirectory, view: View) -> str:
    """The page of a run."""
    ended = (run.path / TABLE).exists() and not (run.path / TRIALS).exists()
    result = run.result() if ended or (run.path / RESULT).exists() else None
    parts = [f"<h1>{page.escape(view.title)}</h1>"]
    parts.append(page.paragraphs(view.about.split("\n\n")[0], "muted"))
    headline = (
        f"This run has not ended, or was stopped: {len(run.rows())} trials were kept."
        if result is None
        else view.sentence(result)
    )
    parts.append(page.paragraphs(headline, "headline"))
    tables = [] if result is None or view.body else view.tables(result)
    parts += [page.definitions(table.preface) for table in tables]
    parts.append(page.block(run.text(BY_HAND), wrap=True))
    films = "".join(page.captioned(film, name) for name, film in _films(run).items())
    parts.append(f'<div class="pair">{films}</div>' if films else "")
    if result is not None:
        bare = [replace(table, preface="") for table in tables]
        parts.append(_shown(run, result, bare, view))
    parts.append(f"<h2>How it was run</h2>{page.paragraphs(_when(run, result))}")
    parts.append(page.block(_command(run, view), wrap=True))
    parts += [_failures(run), _settings(run, view), _versions(run)]
    return page.page(view.title, "".join(parts))


def _command(run: RunDirectory, view: View) -> str:
    words = run.text(COMMAND).partition("\n")[0]
    return words or f"antennate.run({view.name!r}, ...)  # from Python, with {CONFIG}"


def _when(run: RunDirectory, result: Result | None) -> str:
    """When it was run, how long it took, and its seed, as far as they are known."""
    seed = (result or {}).get("seed", _table(run.text(CONFIG)).get("seed"))
    when = when_run(run.text(COMMAND))
    return f"{when} Seed {seed}." if seed is not None else when


def _images(run: RunDirectory, view: View) -> dict[str, str]:
    """The figures by name, the picture first."""
    files = {path.stem: path for path in run.made(FIGURES, ".png")}
    return {
        name: page.picture(
            read_limited(files[name], LARGEST),
            read_limited(files[name].with_suffix(".svg"), LARGEST),
            view.caption(name),
        )
        for name in view.ordered(files)
    }


def _films(run: RunDirectory) -> dict[str, str]:
    """The films by name, in the order in which the run has what they show."""
    config = _table(run.text(CONFIG))
    names = [str(each) for key in _SHOWN if key in config for each in config[key]]

    def place(path: Path) -> tuple[int, str]:
        places = (i for i, name in enumerate(names) if path.stem.startswith(name))
        return next(places, len(names)), path.stem

    files = sorted(run.made(FILMS, ".mp4"), key=place)
    return {path.stem: page.film(read_limited(path, LARGEST)) for path in files}


_SHOWN = ("controllers", "profiles")
"""Parameters whose entries have a film each."""


def _shown(run: RunDirectory, result: Result, tables: Sequence[Table], view: View) -> str:
    """Figures beside tables, or what the command shows in their place."""
    images = _images(run, view)
    if view.body is not None:
        return view.body(result, images)
    words = "".join(page.numbers(table) for table in tables if not page.is_broad(table))
    figures = [page.captioned(image, view.caption(name)) for name, image in images.items()]
    broad = "".join(page.numbers(table) for table in tables if page.is_broad(table))
    return page.beside(figures, words + page.terms_explained(result)) + broad


def _failures(run: RunDirectory) -> str:
    """Trials that say why they are invalid."""
    bad = [r for r in run.rows() if r.get("reason") and "invalid" in r.values()]
    if not bad:
        return ""
    columns = [name for name in bad[0] if name in _WHICH]
    rows = [[str(row.get(name)) for name in columns] for row in bad[:_MOST_REASONS]]
    more = f" The first {_MOST_REASONS} are shown." if len(bad) > _MOST_REASONS else ""
    note = page.paragraphs(f"{len(bad)} trials are invalid; they enter no mean.{more}", "muted")
    return f"<h2>Invalid trials</h2>{page.grid(columns, rows)}{note}"


_WHICH = ("seed", "trial", "controller", "profile", "wall", "speed_m_s", "reason")


def _settings(run: RunDirectory, view: View) -> str:
    """What differs from the defaults, and all of it."""
    text = run.text(CONFIG)
    if not text:
        return ""
    changed = ""
    if view.config is not None:
        default, now = _flat(to_toml(view.config())), _flat(text)
        rows = [[k, v, default.get(k, NONE)] for k, v in now.items() if default.get(k) != v]
        changed = (
            page.grid(["parameter", "this run", "default"], rows)
            if rows
            else page.paragraphs("All parameters are at their defaults.")
        )
    whole = page.folded(f"All parameters ({CONFIG})", page.block(text))
    return f"<h2>Parameters</h2>{changed}{whole}"


def _flat(text: str) -> dict[str, str]:
    """Every parameter of a TOML file by its dotted path, in words."""
    values: dict[str, str] = {}

    def walk(table: Mapping[str, Any], before: str) -> None:
        for key, value in table.items():
            if isinstance(value, Mapping):
                walk(value, f"{before}{key}.")
            else:
                values[before + key] = value if isinstance(value, str) else json.dumps(value)

    walk(_table(text), "")
    return values


def _table(text: str) -> dict[str, Any]:
    """The table of a TOML file."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInputError(f"{CONFIG}: expected TOML, found: {error}") from None


def _versions(run: RunDirectory) -> str:
    found = ", ".join(f"{name} {value}" for name, value in run.versions().items())
    rows = len(run.rows())
    kept = f" {rows} rows in {TABLE if (run.path / TABLE).exists() else TRIALS}." if rows else ""
    return f"<h2>Versions</h2>{page.paragraphs(f'{found}.{kept}', 'muted')}" if found else ""


def compare(runs: Sequence[RunDirectory], view: View) -> str:
    """The page of two runs of one command."""
    names = _names(runs)
    results = [run.result() for run in runs]
    parts = [f"<h1>{page.escape(view.title)}: {page.escape(' and '.join(names))}</h1>"]
    parts.append(page.paragraphs(view.about.split("\n\n")[0], "muted"))
    sentences = [view.sentence(result) for result in results]
    for name, run, text in zip(names, runs, sentences, strict=True):
        alone = page.paragraphs(text.replace(FEW, "").replace(FEW_PER_POINT, "").strip())
        parts.append(f"<h2>{page.escape(name)}</h2>{alone}")
        parts.append(page.block(_command(run, view), wrap=True))
    said = [few for few in (FEW, FEW_PER_POINT) if any(few in text for text in sentences)]
    parts += map(page.paragraphs, said)
    parts.append(_differing("Parameters", names, [_flat(run.text(CONFIG)) for run in runs]))
    parts.append(_differing("Versions", names, [run.versions() for run in runs]))
    parts += map(page.numbers, _side_by_side(names, [view.tables(r) for r in results]))
    parts += [
        _pairs("Films", names, [_films(run) for run in runs], str, "pair"),
        _pairs("Figures", names, [_images(run, view) for run in runs], view.caption),
    ]
    return page.page(view.title, "".join(parts))


def _names(runs: Sequence[RunDirectory]) -> list[str]:
    """The last part of each path, or all of it where those are the same."""
    short = [run.path.resolve().name for run in runs]
    return short if len(set(short)) == len(short) else [str(run.path) for run in runs]


def _differing(title: str, names: Sequence[str], runs: Sequence[Mapping[str, str]]) -> str:
    keys = dict.fromkeys(key for run in runs for key in run)
    rows = [[key, *(run.get(key, NONE) for run in runs)] for key in keys]
    rows = [row for row in rows if len(set(row[1:])) > 1]
    head = f"<h2>{title} that differ</h2>"
    return head + (page.grid(["", *names], rows) if rows else page.paragraphs("None."))


def _side_by_side(names: Sequence[str], found: Sequence[Sequence[Table]]) -> list[Table]:
    """Tables of the same title as one, the line of each run below that of the other."""
    by_title = [{table.title: table for table in tables} for tables in found]
    joined = []
    for title in dict.fromkeys(title for tables in by_title for title in tables):
        own = {n: t[title] for n, t in zip(names, by_title, strict=True) if title in t}
        columns = list(dict.fromkeys(c for table in own.values() for c in table.columns))
        cells = {name: _cells(table) for name, table in own.items()}
        rows = [
            (
                line[0] if name == next(iter(own)) else "",
                [name, *(found.get(c, NONE) for c in columns)],
            )
            for line in dict.fromkeys(line for lines in cells.values() for line in lines)
            for name, found in ((name, cells[name].get(line, {})) for name in own)
        ]
        notes = dict.fromkeys(table.note for table in own.values())
        prefaces = (line for table in own.values() for line in table.preface.splitlines())
        joined.append(
            Table(
                title,
                ["run", *columns],
                rows,
                note="\n\n".join(filter(None, notes)),
                preface="\n".join(dict.fromkeys(prefaces)),
            )
        )
    return joined


def _cells(table: Table) -> dict[tuple[str, int], dict[str, str]]:
    """The cells of a table by line and column; a label that comes again is another line."""
    seen: dict[str, int] = {}
    cells_of = {}
    for name, cells in table.rows:
        label = ", ".join(cells[: table.leading]) or name
        seen[label] = seen.get(label, 0) + 1
        cells_of[label, seen[label]] = dict(zip(table.columns, cells, strict=True))
    return cells_of


def _pairs(
    title: str,
    names: Sequence[str],
    by_run: Sequence[Mapping[str, str]],
    caption: Callable[[str], str],
    kind: str = "",
) -> str:
    """Pictures of the same name together: below one another, or side by side as a `pair`."""
    parts = []
    for key in dict.fromkeys(key for pictures in by_run for key in pictures):
        shown = [
            page.captioned(pictures[key], f"{name}: {caption(key)}")
            for name, pictures in zip(names, by_run, strict=True)
            if key in pictures
        ]
        parts.append(f'<div class="{kind}">{"".join(shown)}</div>')
    return f"<h2>{title}</h2>{''.join(parts)}" if parts else ""
