"""How soon a run answers: controllers take turns, each quarter says how it stands, and the result
begins with its sentence, which says how little a few trials decide."""

from __future__ import annotations

import re

import pytest
from scipy.stats import binomtest

from antennate.cli import main
from antennate.cli.results import drawn_table
from antennate.cli.terminal import progress
from antennate.experiments.tunnel.experiment import EXPERIMENT
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.experiments.tunnel.result import summarise
from antennate.experiments.tunnel.tables import sentence
from antennate.studies.pool import Workers
from antennate.studies.pooling import frame
from antennate.studies.tables import Interim
from antennate.studies.work import Here


@pytest.mark.parametrize(
    ("parts", "tables"), [(40, ["10 trials", "20 trials", "30 trials"]), (12, [])]
)
def test_a_long_run_says_after_each_quarter_how_it_stands(
    parts: int, tables: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    interim = Interim(["timed", "closed", "open"])
    with progress("trials", lambda: drawn_table(interim.table())) as step:
        for done in range(1, parts + 1):
            outcome = "success" if done % 2 else "left"
            interim.add({"controller": "open" if done <= 4 else "timed", "outcome": outcome})
            step(done, parts)
    said = capsys.readouterr().err
    assert re.findall(r"So far, (\d+ trials)", said) == tables
    if tables:
        assert re.findall(r"^ *(open|closed|timed) +(.+?) +(\d+) *$", said, re.M) == [
            *(("timed", "3 of 6", "3"), ("open", "2 of 4", "2")),
            *(("timed", "8 of 16", "8"), ("open", "2 of 4", "2")),
            *(("timed", "13 of 26", "13"), ("open", "2 of 4", "2")),
        ]


def test_trials_that_say_nothing_are_no_failures_and_a_study_of_values_has_no_successes() -> None:
    interim = Interim()
    for outcome in ("success", "invalid", "left"):
        interim.add({"controller": "mine/left.py:left", "outcome": outcome})
    interim.add({"controller": "mine/left.py:left", "status": "crashed"})
    table = interim.table()
    assert table is not None
    assert table.columns == ["successes", "crashed", "invalid", "left the scene"]
    assert table.rows == [("left", ["1 of 2", "1", "1", "1"])]
    values = Interim()
    values.add({"profile": "tapered", "status": "ok"})
    table = values.table()
    assert table is not None
    assert (table.columns, table.rows) == (["ok"], [("tapered", ["1"])])


def test_controllers_take_turns_so_that_half_of_a_run_tells_of_each() -> None:
    config = TunnelConfig(trials=6, time_limit=0.05)
    order: list[str] = []
    EXPERIMENT.run(config, Workers(2, Here()), on_row=lambda row: order.append(row.controller))
    assert sorted(order[: len(order) // 2]) == sorted([*config.controllers] * 3)


@pytest.mark.parametrize(("trials", "says"), [(5, True), (29, True), (30, False)])
def test_few_trials_say_how_little_they_decide(trials: int, says: bool) -> None:
    """Of discordant trials all of one side, 6 are the fewest with a two-sided p below 0.05."""
    assert binomtest(5, 5).pvalue > 0.05 > binomtest(6, 6).pvalue
    names = TunnelConfig().controllers
    rows = [
        TrialResult(seed=0, trial=k, controller=name, outcome="success", time_s=10.0 + k)
        for name in names
        for k in range(trials)
    ]
    config = TunnelConfig(trials=trials)
    said = sentence(summarise(config, frame(rows)))
    assert said.endswith("one alone crosses at least 6.") is says


def test_the_sentence_comes_before_the_tables(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tunnel", "--trials", "1", "--time-limit", "0.05", "--no-figures"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("Tunnels crossed")
    assert out.index("Tunnels crossed") < out.index("Controllers") < out.index("Pairs")
