"""What a study calls a column, and what it knows of an experiment before it is run."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from antennate import experiments
from antennate.cli import main
from antennate.errors import BadInputError
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.designs import Aim, Design, Search, Value
from antennate.experiments.study.effects import Elementary, Slope
from antennate.experiments.study.measures import bounds, measure_of
from antennate.experiments.study.measures import cell as shown_cell
from antennate.experiments.study.result import Cell, CellOfSuccesses, StudyResult, summarise
from antennate.experiments.study.subject import find
from antennate.params.base import Params
from antennate.studies.columns import column, content, tabular, typed
from antennate.studies.experiment import Done, Experiment

pytestmark = pytest.mark.usefixtures("there")


@tabular
class Measured:
    """Of one throw and of many."""

    height_m: float | None = column("height", "cm", scale=100.0, least=0.0, default=None)


@tabular
class Throw(Measured):
    """A throw."""

    share_up: float = 0.0
    time_s: int | None = None
    far_falls: int = column("  far", form="d", default=0)
    word: str = ""


@tabular
class Shares:
    """Shares of time."""

    up: float = column("rising", "%", scale=100.0, least=0.0, most=1.0)


@tabular
class Best:
    """The best throw."""

    angle_deg: float = column("angle", "deg", form=".0f")


@tabular
class Thrown(Measured):
    """Many throws."""

    share: Shares = column("of the time")
    height_m: float | None = column("height, mean", "m", default=None)


@tabular
class Result:
    """Of all."""

    throws: dict[str, Thrown | None]
    best: list[Best]


@pytest.fixture
def thrown(monkeypatch: pytest.MonkeyPatch) -> Experiment[Any, Any]:
    """An experiment without trials of its own whose rows and result have columns."""
    made: Experiment[Any, Any] = Experiment(
        "throw",
        "Throw.",
        Params,
        lambda *_: Done([Throw(height_m=1.0)], {}),
        lambda _: [],
        lambda _: "",
        result=Result,
        row=Throw,
    )
    monkeypatch.setattr(experiments, "names", lambda: ["throw"])
    monkeypatch.setattr(experiments, "load", lambda _: made)
    return made


@pytest.mark.parametrize(
    ("name", "title"),
    [
        ("height_m", "height [cm]"),  # as the row says, whatever the result says of many
        ("share_up", "rising of the time [%]"),
        ("throws.a.share.up", "rising of the time (throws.a) [%]"),
        ("best.0.angle_deg", "angle (best.0) [deg]"),
        ("time_s", "time [s]"),  # nobody says more
        ("far_falls", "far falls"),  # its label is for the line below that of all falls
        ("success_share", "share of successes [%]"),
    ],
)
@pytest.mark.usefixtures("thrown")
def test_a_column_is_called_as_the_row_or_the_result_declares_it(name: str, title: str) -> None:
    assert measure_of("throw", name).title == title


@pytest.mark.usefixtures("thrown")
def test_bounds_come_with_the_column() -> None:
    found = [bounds(measure_of("throw", name), "throw", {}) for name in ("height_m", "share_up")]
    assert found == [(0.0, math.inf, False), (0.0, 1.0, False)]


@pytest.mark.usefixtures("thrown")
def test_a_mean_of_whole_numbers_is_no_whole_number() -> None:
    assert shown_cell(measure_of("throw", "far_falls"), 1.5, (0.25, 2.75)) == "1.5 (0.25 to 2.75)"


@pytest.mark.usefixtures("thrown")
def test_columns_of_rows_are_known_before_an_experiment_is_run() -> None:
    known = find("throw").columns
    assert known is not None
    assert known.names == [field.name for field in fields(Throw)]
    assert known.numbers == ["height_m", "share_up", "time_s", "far_falls"]
    with pytest.raises(BadInputError, match="did you mean height_m"):
        known.require("hieght_m", "response", "throw")


def test_a_response_that_no_row_has_is_refused_before_anything_is_run(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Of an experiment that has rows, but no trials of its own."""
    Path("plan.toml").write_text(
        'experiment = "force"\nresponse = "forse_max_n"\n[vary]\nseed = [1, 2]\n'
    )
    assert main(["study", "plan.toml", "--out", "run", "--workers", "1"]) == 2
    assert "did you mean force_max_n?" in capsys.readouterr().err
    assert not Path("run").exists()


def cell(kind: type[Cell], **more: Any) -> Cell:
    numbers: Any = {"trials": 2, "invalid": 1, "response": 0.5, "response95": None}
    return kind(point=0, values={"x": [1, "a"]}, condition="", **numbers, **more)


WON: Any = {"successes": 1, "success_share": 1.0, "wilson95": (0.2, 1.0)}
SIZE: Any = {"of": "", "parameter": "x", "noise": 0.1, "above_noise": None}
STUDY = StudyResult(
    experiment="throw",
    plan="random",
    axes=["x"],
    trials=2,
    ended=2,
    interrupted=False,
    statuses={"ok": 1, "nan": 1},
    response=None,
    conditions={},
    points=[cell(Cell), cell(CellOfSuccesses, **WON)],
    effects=[
        Slope(slope=1.0, slope95=(0.5, 1.5), **SIZE),
        Elementary(mu_star=1.0, mu_star95=None, mu=-1.0, sigma=None, **SIZE),
    ],
)
VALUE = Value(value=0.5, value95=(0.0, 1.0), trials=4)
SEARCH = Search(
    optuna="4.0",
    objectives=[Aim(name="x", goal="minimize", title="x", scale=1.0)],
    proposed=1,
    repeated=0,
    designs=[
        Design(
            point=0,
            name="0",
            reference=False,
            state="ok",
            values={"x": [1, "a"]},
            front=True,
            objectives={"x": VALUE},
        )
    ],
)


@pytest.mark.parametrize("found", [STUDY, dataclasses.replace(STUDY, plan="optuna", search=SEARCH)])
def test_a_result_is_read_back_as_it_was_written(found: Any) -> None:
    """Whether trials have an outcome, and whichever effects there are."""
    written = json.loads(json.dumps(content(found)))
    assert typed(type(found), written) == found
    for key in set(written) - {"schema", "command", "search"}:
        less = {name: value for name, value in written.items() if name != key}
        with pytest.raises(ValueError, match=f"{key}: field required"):
            typed(type(found), less)


def test_rows_without_an_outcome_have_no_successes() -> None:
    config = StudyConfig(vary={"x": (1, 2)})
    row = {"point": 0, "trial": 0, "status": "ok", "far_m": 3.0}
    found = content(summarise(config, [{"x": 1}], {"x": [1]}, "", [row], 1, 1))
    assert list(found["conditions"][""]) == ["trials", "invalid"]
    won = content(summarise(config, [{"x": 1}], {"x": [1]}, "", [row | {"outcome": "a"}], 1, 1))
    assert list(won["conditions"][""]) == [*("trials", "invalid"), *WON]
    keys = ["point", "values", "condition", "trials", "invalid", "response", "response95"]
    assert [list(each["points"][0]) for each in (found, won)] == [keys, [*keys, *WON]]


def test_the_response_is_the_first_column_that_has_a_number_in_any_row() -> None:
    config = StudyConfig(vary={"x": (1, 2)})
    rows = [
        {"point": 0, "x": 1, "trial": k, "word": "a", "far_m": far, "near_m": 1.0, "status": "ok"}
        for k, far in enumerate([None, 3.0])
    ]
    found = summarise(config, [{"x": 1}], {"x": [1]}, "", rows, 2, 2)
    assert (found.response, found.points[0].response) == ("far_m", 3.0)
