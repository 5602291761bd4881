"""The pages on result files name every measure and every column."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from antennate.experiments.compete.episodes import Episode
from antennate.experiments.compete.standings import CONTROLLER, PAIR
from antennate.experiments.dataset.episodes import EpisodeRow
from antennate.experiments.dataset.experiment import KIND
from antennate.experiments.force.experiment import MEASURES as FORCE
from antennate.experiments.force.experiment import TraverseRow
from antennate.experiments.gait.experiment import MANEUVER
from antennate.experiments.geometry import experiment as geometry
from antennate.experiments.geometry.physics import Walked
from antennate.experiments.sweep.experiment import SweepRow
from antennate.experiments.touch.experiment import AVERAGING, PROFILE
from antennate.experiments.tracks.run import TrackRow
from antennate.experiments.tunnel import measures as tunnel
from antennate.experiments.tunnel.physics import TrialResult
from antennate.experiments.wall import experiment as wall
from antennate.experiments.wall.physics import WallTrial
from antennate.studies.measures import Measure, count, mean, shown, summarise

DOCS = Path(__file__).parents[1] / "docs"
MEASURES = {
    ("results.md", "tunnel"): (*tunnel.CONTROLLER, *tunnel.PAIR),
    ("results.md", "compete"): (*CONTROLLER, *PAIR),
    ("results.md", "gait"): MANEUVER,
    ("results.md", "geometry"): geometry.GAIT,
    ("results.md", "wall"): (*wall.PROFILE, *wall.PAIR),
    ("results.md", "touch"): (*PROFILE, *AVERAGING),
    ("results.md", "force"): FORCE,
    ("results.md", "dataset"): KIND,
}
ROWS = {
    ("results.md", "tunnel"): TrialResult,
    ("results.md", "compete"): Episode,
    ("results.md", "geometry"): Walked,
    ("results.md", "wall"): WallTrial,
    ("results.md", "force"): TraverseRow,
    ("results.md", "dataset"): EpisodeRow,
    ("tracks.md", "tracks"): TrackRow,
}


def words(page: str, command: str) -> set[str]:
    """Words in backticks of a command's part of a page."""
    parts = re.split(r"^## ", (DOCS / page).read_text(), flags=re.MULTILINE)
    own = [p for p in parts if re.search(rf"`antennate (\w+ )?{command}`", p.splitlines()[0])]
    assert own
    marked = re.findall(r"`([^`\n]+)`", "\n".join(own))
    return {word for text in marked for word in text.split(".")}


@pytest.mark.parametrize("where", MEASURES, ids="-".join)
def test_every_measure_is_explained(where: tuple[str, str]) -> None:
    known = words(*where)
    asked = {part for m in MEASURES[where] for part in m.name.split(".")}
    # a key with _95 is the interval of the one without
    assert {name for name in asked if name not in known} <= {f"{name}_95" for name in known}


@pytest.mark.parametrize("where", ROWS, ids="-".join)
def test_every_column_is_explained(where: tuple[str, str]) -> None:
    assert {field.name for field in fields(ROWS[where])} <= words(*where)


def test_a_measure_is_made_of_rows_and_shown_with_its_unit() -> None:
    rows = [TrialResult(0, k, "open", "success", 10.0 * k, *[k] * 10, reason="") for k in (1, 2)]
    measures = (
        Measure("time_s", "time", "s", mean, ".1f"),
        Measure("share.hold", "hold", "%", mean, ".0f", 100.0),
        Measure("won", "won", of=count("outcome", "success"), form="d"),
    )
    summary = summarise(measures, rows)
    assert summary == {"time_s": 15.0, "share": {"hold": 1.5}, "won": 2}
    assert [f"{m.title}: {m.cell(summary)}" for m in measures] == [
        "time [s]: 15.0",
        "hold [%]: 150",
        "won: 2",
    ]
    assert (shown(None), shown(float("nan")), shown((0.25, 1.0), ".2f")) == (
        "-",
        "-",
        "0.25 to 1.00",
    )
    assert shown((-0.004, 0.004), ".0f", 100.0) == "0 to 0"
    assert [shown(-0.004), shown(-0.006), shown(-10, "d")] == ["0.00", "-0.01", "-10"]


def test_the_columns_of_sweep_are_known() -> None:
    assert {"seed", "trial", "profile", "condition"} <= {f.name for f in fields(SweepRow)}
