"""Searches for designs: the front, known optima, validation, and figures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from design_plans import HERE, design, plan, result, table
from hypothesis import given
from hypothesis import strategies as st

import antennate
from antennate import experiments
from antennate.cli import main
from antennate.experiments.study.designs import front, spread

pytestmark = pytest.mark.usefixtures("there")


def dominates(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """By the definition: as good in all, better in one; small is good."""
    return all(x <= y for x, y in zip(a, b, strict=True)) and a != b


def test_the_front_of_known_designs() -> None:
    values = [(1.0, 5.0), (2.0, 3.0), (2.0, 4.0), (4.0, 1.0), (4.0, 1.0), (5.0, 1.0), (3.0, 3.0)]
    assert front(np.array(values)).tolist() == [True, True, False, True, True, False, False]
    assert front(np.array([[3.0], [1.0], [1.0], [2.0]])).tolist() == [False, True, True, False]


@given(st.lists(st.tuples(*[st.integers(0, 4).map(float)] * 3), min_size=1, max_size=20))
def test_the_front_is_what_nothing_dominates(values: list[tuple[float, ...]]) -> None:
    expected = [not any(dominates(other, each) for other in values) for each in values]
    assert front(np.array(values)).tolist() == expected


def test_validated_designs_lie_along_the_front() -> None:
    assert spread([3, 1, 2], 5) == [3, 1, 2]
    assert spread(list(range(11)), 3) == [0, 5, 10]
    assert spread(list(range(10)), 1) == [5]


def test_a_known_optimum_is_found() -> None:
    """40 designs drawn at random have one so near in 18 of 100 searches."""
    plan(
        'minimize = ["bowl"]',
        "x = { low = -2.0, high = 3.0 }\nn = { low = 1, high = 8, whole = true }",
        points=40,
        validated=0,
    )
    design()
    best = [each for each in result()["designs"] if each["front"]]
    assert len(best) == 1
    assert best[0]["values"]["n"] == 3
    assert best[0]["values"]["x"] == pytest.approx(0.7, abs=0.1)


@pytest.mark.ci
def test_a_known_front_is_found_and_run_again(capsys: pytest.CaptureFixture[str]) -> None:
    """x^2 and (x - 1)^2 trade off from 0 to 1: there nothing dominates, elsewhere 0 or 1 does."""
    plan(points=24, settings={"noise": 0.01})
    import optuna

    quiet = optuna.logging.get_verbosity()
    assert main(["study", "plan.toml", "--trust-code", "--out", "run", "--workers", "1"]) == 0
    out, err = capsys.readouterr()
    assert "optuna" not in (out + err).lower()
    said = [line for line in err.splitlines() if not re.match(r"So far|[ ─]|study: [0-9]|$", line)]
    assert all(line.startswith(("design: ", "written to ")) for line in said)
    assert optuna.logging.get_verbosity() == quiet
    told = " ".join(out.split())
    assert "The front was chosen by these values, so they are optimistic." in told
    assert "Designs proposed: 24, references: 1" in told
    found = result()
    designs = found["designs"]
    assert [each["name"] for each in designs[:2]] == ["paper", "1"]
    assert designs[0]["front"] is False
    inside = [d for d in designs if 0.1 < d["values"]["x"] < 0.9]
    assert len(inside) > 3
    assert all(d["front"] for d in inside)
    far = [d for d in designs if d["front"] and not -0.3 < d["values"]["x"] < 1.3]
    assert far == []
    again = [each for each in designs if each["fresh"]]
    assert [each["name"] for each in again if each["reference"]] == ["paper"]
    assert len(again) == 3
    one = again[-1]["fresh"]["near"]
    assert one["trials"] == 12
    assert one["value95"][0] < again[-1]["values"]["x"] ** 2 + 0.01
    assert one["value"] != again[-1]["objectives"]["near"]["value"]
    rows = table()
    assert len(rows) == 3 * 25 + 12 * 3
    seeds = [{r["trial"] for r in rows if r["phase"] == p} for p in ("search", "validation")]
    assert list(map(len, seeds)) == [3, 12]
    assert not set.intersection(*seeds)
    assert Path("run/figures/tradeoff.png").stat().st_size > 10_000
    assert "optimistic" in Path("run/report.html").read_text()


def test_a_list_of_each_length_rises_and_stays_in_its_range() -> None:
    plan(
        'minimize = ["near", "fall"]\nmaximize = ["length"]',
        "x = [0.0, 0.5]\ncoils = { low = 3, high = 9, whole = true, entries = [2, 4], "
        "rising = true }",
        "",
        validated=0,
    )
    design()
    coils = [each["values"]["coils"] for each in result()["designs"]]
    assert {len(each) for each in coils} == {2, 3, 4}
    assert all(each == sorted(each) for each in coils)
    assert all(isinstance(c, int) and 3 <= c <= 9 for each in coils for c in each)
    assert {each["values"]["x"] for each in result()["designs"]} == {0.0, 0.5}


def test_a_design_that_comes_again_is_not_run_again() -> None:
    plan(vary="x = [0.0, 0.5, 1.0]", points=9, batch=2, validated=0)
    design()
    found = result()
    assert (found["proposed"], found["repeated"]) == (9, 6)
    assert len(found["designs"]) == 1 + 3
    assert len(table()) == 3 * 4


def test_an_experiment_without_trials_is_searched_as_a_whole() -> None:
    """The index of a spring is its coil over its wire, of 0.5 mm; it has no chance in it."""
    found = antennate.run(
        "study",
        experiment="antenna",
        plan="optuna",
        points=2,
        validated=1,
        vary={"coil_mm": (4.0, 5.0)},
        minimize=("springs.spring_index",),
        settings={"hold_time": 0.2, "loop_time": 0.2},
    )
    designs = found.summary["search"]["designs"]
    for each in designs:
        (value,) = each["objectives"].values()
        assert value["value"] == pytest.approx(each["values"]["coil_mm"] / 0.5)
    (again,) = [each for each in designs if each["fresh"]]
    assert again["fresh"]["springs.spring_index"]["trials"] == 1
    assert {row["seed"] for row in found.rows if row["phase"] == "validation"} == {1_000_000}


@pytest.mark.parametrize("goals", ['minimize = ["near"]', 'minimize = ["near", "far", "bowl"]'])
def test_one_objective_and_three_are_drawn(goals: str) -> None:
    plan(goals)
    design(figures=True)
    svg = Path("run/figures/tradeoff.svg").read_text()
    assert svg.count('id="axes_') == (1 if "far" not in goals else 3)


def test_the_shipped_searches_can_be_run() -> None:
    config = experiments.load("study").config
    from antennate.params.base import read_file

    paths = sorted((HERE.parent / "studies").glob("design_*.toml"))
    assert len(paths) > 1
    for path in paths:
        experiments.load("study").settled(read_file(path, config), None)
