"""The card of a data set: README.md beside its files, and what the files say of themselves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antennate import __version__
from antennate.studies.formats import to_toml
from antennate.studies.parquet import to_parquet
from antennate_lab.dataset.columns import TASKS, Column, Windows, columns_of
from antennate_lab.dataset.config import FORMAT, HISTORY, SPLITS, DatasetConfig, Kind

LICENCE = "Apache-2.0"
_WAYS: dict[Kind, str] = {
    "walk": "The whole robot walks straight on beside a wall, in MuJoCo, whatever it feels. "
    "Windows in which no antenna touches the wall are left out.",
    "gap": "Left and right antenna, each on a bench beside its own wall, sweep to and fro. Both "
    "walls are parallel, the robot stands at an angle to them. Windows in which not both touch are "
    "left out.",
    "push": "The head turns at its first yaw joint, and one antenna on it meets a post. Windows in "
    "which the post has slipped off at the end are left out.",
}
_SPLITS = {
    "train": "to learn from",
    "validation": "to choose by",
    "test": "the same kind of antennae and speeds, other episodes",
    "test_antenna": "out of distribution: antennae of the profile {held_out}; others are {profile}",
    "test_speed": "out of distribution: speeds of {fast} times the usual one; others {usual}",
}


def about(config: DatasetConfig, kind: Kind) -> dict[str, Any]:
    """Metadata of a file."""
    return {
        "antennate.dataset": {
            "format": FORMAT,
            "version": __version__,
            "kind": kind,
            "seed": config.seed,
            "rate_hz": config.rate,
            "history": HISTORY,
            "splits": list(SPLITS),
            "licence": LICENCE,
        }
    }


def parquet(config: DatasetConfig, kind: Kind, windows: Windows) -> bytes:
    """The content of the Parquet file of a kind."""
    notes = {
        column.name: {"unit": column.unit, "role": column.role, "meaning": column.meaning}
        for column in columns_of(kind, config.robot)
    }
    return to_parquet(windows, notes, about(config, kind))


def card(config: DatasetConfig, by_kind: Mapping[Kind, Windows]) -> str:
    """The text of README.md."""
    parts = [
        "# Touch of a pair of antennae",
        "Simulated readings of two tactile antennae on a many-legged robot, and what was true. "
        f"Format {FORMAT}, antennate {__version__}, seed {config.seed}, {config.trials} episodes "
        "of each kind. Every number is simulated; nothing here was measured on a robot.",
        "## Tasks",
        _table(
            ("task", "file", "label", "what"),
            [(t.name, f"{t.kind}.parquet", t.label, t.about) for t in TASKS if t.kind in by_kind],
        ),
        "`base_to_tip` stands beside a published figure; it hardly varies, so it is no task.",
        f"A row is a window of {HISTORY} samples at {config.rate:g} Hz ({config.history:g} s). "
        "Estimate a label from columns of the role `input` alone: a robot has them. Columns of the "
        "roles `label` and `truth` are privileged: only the simulation knows them.",
        "## Splits",
        _table(
            ("split", "what", *(f"{kind} windows" for kind in by_kind)), _splits(config, by_kind)
        ),
        "Split by episode, never by window: of ten episodes in a row five train, one validates, "
        "two test, and one each tests other antennae and other speeds. Learn from `train`, choose "
        "by `validation`, look at the tests once.",
    ]
    for kind, windows in by_kind.items():
        columns = columns_of(kind, config.robot)
        parts += [
            f"## {kind}.parquet",
            f"{_WAYS[kind]} {len(windows['episode'])} windows.",
            _table(("column", "unit", "role", "cell", "meaning"), [_line(c) for c in columns]),
        ]
    parts += [
        "## How it was made",
        "`antennate dataset` with the configuration below (also in config.toml); command.txt and "
        "versions.json hold the rest. Springs, friction and gain of each antenna, zeros of "
        "joints, place and speed are drawn for each episode. The same seed and versions give the "
        "same bytes, on any number of workers; with more episodes the first ones stay.",
        f"```toml\n{to_toml(config)}```",
        "## Version, licence, citation",
        "The format number rises with any change of columns, splits or definitions. Results are "
        "comparable if format, configuration and the version of antennate are the same; name all "
        f"three. Licence: {LICENCE}. Cite CITATION.cff of antennate, and arXiv:2603.07795, whose "
        "robot and antenna these data simulate.",
    ]
    return "\n\n".join(parts) + "\n"


def _splits(config: DatasetConfig, by_kind: Mapping[Kind, Windows]) -> list[tuple[str, ...]]:
    usual, fast = (f"{low:g} to {high:g}" for low, high in (config.speeds, config.held_out_speeds))
    words = {
        "held_out": config.held_out_profile,
        "profile": config.profile,
        "usual": usual,
        "fast": fast,
    }
    return [
        (
            split,
            _SPLITS[split].format(**words),
            *(str(int((windows["split"] == split).sum())) for windows in by_kind.values()),
        )
        for split in SPLITS
    ]


def _line(column: Column) -> tuple[str, ...]:
    cell = "text" if column.dtype == "str" else column.dtype
    return (
        f"`{column.name}`",
        column.unit,
        column.role,
        cell if column.size == 1 else f"{column.size} x {cell}",
        column.meaning,
    )


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
