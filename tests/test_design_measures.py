"""What a design is worth: measures of successes, the front on fresh seeds, names and units."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import antennate
from antennate import experiments
from antennate.cli import main
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.designs import Value, front_of, objectives_of, worth_of

HERE = Path(__file__).parent
TRIAL = f"{HERE / 'design_trials.py'}:trial"


pytestmark = pytest.mark.usefixtures("there")


def walls(*outcomes: str, flex: tuple[float | None, ...]) -> list[dict[str, Any]]:
    return [
        {"status": "ok", "outcome": outcome, "flex_max_deg": value}
        for outcome, value in zip(outcomes, flex, strict=True)
    ]


OBJECTIVES = objectives_of(
    StudyConfig(maximize=("success_share", "flex_max_deg@success", "flex_max_deg"))
)


def test_a_measure_of_successes_leaves_jams_out() -> None:
    """(18 + 21) / 2 = 19.5 of passes; over all walls the jams make it (18 + 21 + 87 + 90) / 4."""
    rows = walls("success", "jam", "success", "jam", flex=(18.0, 87.0, 21.0, 90.0))
    found = worth_of(rows, OBJECTIVES, 0.5)
    assert found is not None
    assert found["success_share"].value == 0.5
    assert found["flex_max_deg@success"].value == pytest.approx(19.5)
    assert found["flex_max_deg@success"].trials == 2
    assert found["flex_max_deg"].value == pytest.approx(54.0)
    assert found["flex_max_deg@success"].value95 is None  # of two trials


def test_the_interval_of_an_objective_is_that_of_student_within_its_bounds() -> None:
    rows = walls(*["success"] * 5, flex=(1.0, 2.0, 3.0, 4.0, 20.0))
    name, half = "flex_max_deg", 2.776 * math.sqrt(62.5 / 5)  # the printed quantile
    found = worth_of(rows, OBJECTIVES, 0.5)
    assert found is not None
    assert found[name].value95 == pytest.approx((6.0 - half, 6.0 + half), abs=0.01)
    found = worth_of(rows, OBJECTIVES, 0.5, {name: (0.0, 10.0)})
    assert found is not None
    assert found[name].value95 == (0.0, 10.0)


def test_without_success_there_is_no_value_and_the_design_stands() -> None:
    found = worth_of(walls("jam", "jam", flex=(87.0, 90.0)), OBJECTIVES, 0.5)
    assert found is not None
    assert found["flex_max_deg@success"] == Value(value=None, value95=None, trials=0)


def test_what_failures_lack_does_not_fail_a_design() -> None:
    """A column that only successes have: three of four are None, and the trials are ok."""
    rows = walls("success", "jam", "jam", "jam", flex=(18.0, None, None, None))
    found = worth_of(rows, OBJECTIVES[:2], 0.5)
    assert found is not None
    assert found["flex_max_deg@success"] == Value(value=18.0, value95=None, trials=1)
    for row in rows[1:]:
        row["status"] = "failed"
    assert worth_of(rows, OBJECTIVES[:2], 0.5) is None


@pytest.mark.parametrize("goal", ["maximize", "minimize"])
def test_a_design_without_a_value_is_the_worst(goal: str) -> None:
    """It is on the front by another objective alone, and there only if it is the best."""
    measures = {"near": "minimize", "far@success": goal}
    asked = {g: tuple(m for m, its in measures.items() if its == g) for g in measures.values()}
    objectives = objectives_of(StudyConfig.model_validate(asked))

    def each(near: float, far: float | None) -> dict[str, Value]:
        worth = {"near": near, "far@success": far}
        return {name: Value(value=of, value95=None, trials=3) for name, of in worth.items()}

    assert front_of([each(1.0, None), each(2.0, 5.0), each(2.0, None)], objectives) == [
        True,
        True,
        False,
    ]
    assert front_of([each(1.0, None), each(1.0, -1e9)], objectives) == [False, True]
    assert front_of([each(1.0, None), each(1.0, None)], objectives) == [True, True]
    assert front_of([], objectives) == []


def plan(goals: str) -> None:
    """x below 0.5 succeeds (design_trials.py); the reference x = 2 never does."""
    Path("plan.toml").write_text(
        f'experiment = "{TRIAL}"\nplan = "optuna"\npoints = 24\nbatch = 6\nvalidated = 2\n'
        f"trials = 2\n{goals}\n[vary]\nx = {{ low = -1.0, high = 3.0 }}\n"
        "[reference]\npaper = { x = 2.0 }\ngood = { x = 0.0 }\n"
    )


def test_a_search_by_successes_goes_where_trials_succeed() -> None:
    """Of all x the largest (x - 1)^2 is 4, at -1 and at 3; only at -1 does a trial succeed."""
    plan('maximize = ["far@success"]\nminimize = ["near"]')
    found = antennate.run("study", out="run", **tomllib.loads(Path("plan.toml").read_text()))
    result = json.loads(Path("run/result.json").read_text())["search"]
    assert result["designs"] == json.loads(json.dumps(found.summary["search"]["designs"]))
    paper, good, *proposed = result["designs"]
    assert paper["state"] == "ok"
    assert paper["objectives"]["far@success"]["value"] is None
    assert paper["fresh"]["far@success"]["value"] is None
    assert not paper["front"]
    assert not paper["fresh_front"]
    assert good["objectives"]["far@success"]["value"] == 1.0
    # at x = 0 `near` has its least value; nothing can be better in both
    assert good["front"]
    assert good["fresh_front"]
    front = [each["values"]["x"] for each in proposed if each["front"]]
    assert front
    assert max(front) < 0.0
    assert "far (successes only): design" in found.sentence
    assert Path("run/figures/tradeoff.png").stat().st_size > 10_000


def test_a_search_in_which_nothing_succeeds_ends() -> None:
    plan('maximize = ["far@success"]')
    values = tomllib.loads(Path("plan.toml").read_text())
    values["vary"]["x"]["low"] = 1.0
    del values["reference"]["good"]
    found = antennate.run("study", **values)
    designs = found.summary["search"]["designs"]
    assert {each["state"] for each in designs} == {"ok"}
    assert all(each["front"] for each in designs)  # none is better than another
    assert "far (successes only): none" in found.sentence


@pytest.mark.ci
@pytest.mark.parametrize(
    ("goals", "expected"),
    [
        ('maximize = ["fer@success"]', "did you mean far@success?"),
        ('maximize = ["far@jam"]', "expected a measure of"),
        ('maximize = ["success_share@success"]', "found success_share@success"),
        ('maximize = ["far@success", "far@success"]', "expected an objective once"),
    ],
)
def test_unknown_measures_are_one_line(
    goals: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    plan(goals)
    assert main(["study", "plan.toml", "--trust-code", "--workers", "1"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert "Traceback" not in "".join(said)
    assert expected in said[-1]


@pytest.mark.ci
def test_successes_of_an_experiment_without_outcomes_are_refused(
    refused: Callable[..., str],
) -> None:
    Path("plan.toml").write_text(
        'experiment = "antenna"\nplan = "optuna"\nminimize = ["springs.spring_index@success"]\n'
        "[vary]\ncoil_mm = [3.0, 4.0]\n"
    )
    assert "found springs.spring_index@success" in refused("study", "plan.toml", "--workers", "1")


def test_objectives_have_names_and_units() -> None:
    config = experiments.load("study").config(
        experiment="wall",
        plan="optuna",
        points=1,
        validated=0,
        trials=1,
        vary={"antenna.friction": (0.2, 0.3)},
        settings={
            "profiles": ["descending"],
            "wall": {"travel": 0.03, "start": 0.002, "speed": 0.2},
        },
        maximize=("success_share", "flex_max_deg@success"),
        minimize=("force_mean_n",),
    )
    result = experiments.load("study").run(config, 1, lambda *_: None, lambda _: None).result()
    assert [each.title for each in result.search.objectives] == [
        "share of successes [%]",
        "flex, largest (successes only) [deg]",
        "contact force, mean [N]",
    ]


def test_columns_that_a_search_fills_itself_are_refused() -> None:
    Path("own.py").write_text(
        "def trial(config, seed):\n    return {'near': config['x'], config['column']: 1.0}\n"
    )
    asked: dict[str, Any] = {"plan": "optuna", "points": 2, "validated": 0, "trials": 1}
    asked |= {"experiment": "own.py:trial", "vary": {"x": [1.0, 2.0]}, "minimize": ("near",)}
    for column in ("phase", "x", "far"):
        found = antennate.run("study", **asked, settings={"column": column})
        refused = [row for row in found.rows if "expected another name" in (row["reason"] or "")]
        assert bool(refused) is (column != "far")
