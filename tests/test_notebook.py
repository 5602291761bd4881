"""What a notebook does with experiments: run, look at, keep and read back."""

from __future__ import annotations

import base64
import functools
import html
import json
import math
import pickle
import re
import struct
import tomllib
from dataclasses import FrozenInstanceError
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import antennate
from antennate import experiments
from antennate.control.controllers import open_loop
from antennate.errors import ControllerError
from antennate.experiments.antenna.config import AntennaConfig
from antennate.params.control import ControlParams
from antennate.types import AntennaFrame, JointCommand

SHORT = {"trials": 2, "time_limit": 1.0}


@pytest.fixture(scope="module")
def tunnel() -> antennate.Result:
    return antennate.run("tunnel", controllers=("open", "closed"), **SHORT)


def test_rows_are_typed_and_frozen(tunnel: antennate.Result) -> None:
    assert [(r.controller, r.trial) for r in tunnel.rows] == [
        *[("open", 0), ("open", 1), ("closed", 0), ("closed", 1)]
    ]
    with pytest.raises(FrozenInstanceError):
        tunnel.rows[0].time_s = 0.0
    with pytest.raises(FrozenInstanceError):
        tunnel.path = Path()  # pyright: ignore[reportAttributeAccessIssue]
    assert tunnel.summary["controllers"]["open"]["trials"] == 2
    assert "open" in tunnel.sentence
    assert set(tunnel.figures()) == {"trajectories", "summary"}


def test_a_result_is_one_line_and_shows_sentence_table_and_figure(
    tunnel: antennate.Result,
) -> None:
    assert "\n" not in repr(tunnel)
    assert len(repr(tunnel)) < 400
    assert tunnel.sentence in repr(tunnel)
    page = re.sub(' style="[^"]*"', "", tunnel._repr_html_())
    assert html.escape(tunnel.sentence) in page
    assert "<th>open</th><th>closed</th>" in page
    assert "<td>trials</td><td>2</td><td>2</td>" in page
    png = base64.b64decode(page.split("data:image/png;base64,")[1].split('"')[0])
    width, height = struct.unpack(">II", png[16:24])
    drawn = tunnel.figures()["trajectories"]  # the picture, by the order of the captions
    assert width / height == pytest.approx(drawn.get_figwidth() / drawn.get_figheight(), rel=0.01)
    assert not re.search("<(script|link|style)", page)


def test_a_result_without_trials_shows_itself_too() -> None:
    result = antennate.run("antenna")
    assert repr(result) == f"<Result of antenna: {result.sentence}>"
    assert "<img" in result._repr_html_()


def test_a_data_frame_has_the_columns_of_the_table(tunnel: antennate.Result) -> None:
    frame = tunnel.to_dataframe()
    assert frame["controller"].tolist() == ["open", "open", "closed", "closed"]
    for row, (_, series) in zip(tunnel.rows, frame.iterrows(), strict=True):
        assert series["progress_m"] == row.progress_m
        assert series["force_mean_n"] == row.force_mean_n


@pytest.mark.ci
def test_a_run_directory_is_written_and_read(tmp_path: Path) -> None:
    place = tmp_path / "mine"
    result = antennate.run("tunnel", out=place, controllers=("open",), **SHORT)
    assert result.path == place
    directory = antennate.RunDirectory.open(place)
    assert directory.result() == json.loads(json.dumps(result.summary))
    assert directory.config(type(result.config)) == result.config
    assert [row["progress_m"] for row in directory.rows()] == [r.progress_m for r in result.rows]
    assert tomllib.loads((place / "config.toml").read_text())["controllers"] == ["open"]
    assert (place / "figures" / "summary.png").stat().st_size > 1000
    with pytest.raises(antennate.AntennateError, match="expected a folder without a run"):
        antennate.run("antenna", out=place)
    antennate.run("antenna", out=place, overwrite=True)
    assert not (place / "trials.csv").exists()


def test_a_configuration_serves_as_well_as_its_name() -> None:
    config = AntennaConfig(coil_mm=4.0)
    by_config, by_name = antennate.run(config), antennate.run("antenna", coil_mm=4.0)
    assert by_config.summary == by_name.summary
    assert by_config.summary["springs"]["spring_index"] == 8.0
    lost = "expected trials, found none: antenna .* take result.summary"
    with pytest.raises(antennate.BadInputError, match=lost):
        by_config.to_dataframe()


def test_every_listed_experiment_can_be_named() -> None:
    found = antennate.list_experiments()
    assert {"tunnel", "wall", "touch", "sweep", "force", "calibrate", "gait"} <= set(found)
    assert all(summary and "\n" not in summary for summary in found.values())


@pytest.mark.parametrize("name", experiments.names())
def test_a_result_of_every_experiment_can_be_pickled(name: str, tunnel: antennate.Result) -> None:
    known = experiments.load(name)
    result = antennate.Result(known, known.config(), tunnel.outcome, Path("kept"))
    again = pickle.loads(pickle.dumps(result))
    assert (again.experiment, again.config, again.path) == (known, known.config(), Path("kept"))


def test_what_came_out_survives_pickling() -> None:
    result = antennate.run("antenna")
    again = pickle.loads(pickle.dumps(result))
    assert (again.summary, again.sentence) == (result.summary, result.sentence)


def test_trials_survive_pickling(tunnel: antennate.Result) -> None:
    again = pickle.loads(pickle.dumps(tunnel))
    assert again.to_dataframe().equals(tunnel.to_dataframe())
    assert again.summary == tunnel.summary


class Cell:
    """A controller as a cell of a notebook defines one: the open loop by other means."""

    def __init__(self, control: ControlParams, robot: Any, batch: int) -> None:
        self._open = antennate.make_controller("open", control, robot, batch)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._open, name)


def test_an_own_class_runs_and_may_be_defined_again() -> None:
    for _ in range(2):
        again = type("Cell", (Cell,), {})
        result = antennate.run("tunnel", controllers=("open", again), **SHORT)
        ours, mine = result.rows[0], result.rows[2]
        assert mine.controller == "Cell"
        assert mine.progress_m == ours.progress_m
    again = type("Cell", (Cell,), {})
    with pytest.raises(antennate.AntennateError, match="or run with one worker"):
        antennate.run("tunnel", controllers=(again,), workers=2, trials=4)


@pytest.mark.ci
def test_an_own_class_of_a_module_runs_in_workers() -> None:
    result = antennate.run(
        "tunnel", controllers=("open", open_loop), trials=1, time_limit=1.0, workers=2
    )
    assert {row.controller for row in result.rows} == {"open", "open_loop"}


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"experiment": "tunel"}, r"expected an experiment \(did you mean tunnel\?\), one .*tunel"),
        ({"experiment": "tunnel", "trials": 0}, "trials: expected .*at least 1"),
        ({"experiment": "tunnel", "trails": 2}, "trails: .*trials"),
        (
            {"experiment": "tunnel", "control": {"gait": {"frequency": -1}}},
            "control.gait.frequency",
        ),
        ({"experiment": "tunnel", "controllers": ("opne",)}, "opne"),
        ({"experiment": AntennaConfig(), "wire_mm": 0.4}, "settings only beside a name"),
        ({"experiment": antennate.run}, "expected a name or the configuration"),
        ({"experiment": "antenna", "engine": "dask"}, "that runs trials on workers, found antenna"),
        ({"experiment": "antenna", "out": "a\0b"}, "out: expected a path, found"),
        *(
            ({"experiment": "wall", "workers": workers}, "workers: expected a whole number")
            for workers in (0, -1, 1.5, None, True)
        ),
    ],
)
def test_a_wrong_word_is_one_line(wrong: dict[str, object], why: str) -> None:
    settings = dict(wrong)
    with pytest.raises(antennate.BadInputError, match=why) as error:
        antennate.run(settings.pop("experiment"), **settings)  # pyright: ignore[reportArgumentType]
    assert "\n" not in str(error.value)


def test_a_simulated_trial_is_that_of_the_tunnel(tunnel: antennate.Result) -> None:
    series = antennate.simulate("closed", trial=1, time_limit=1.0)
    row = tunnel.rows[3]
    ticks = len(series)
    assert 100 <= ticks <= 102  # the limit is looked at with the engine's sum of steps
    assert series.t == pytest.approx(0.01 * np.arange(ticks), abs=1e-9)
    share = (series.maneuver == antennate.Maneuver.FORWARD).mean()
    assert share == pytest.approx(row.share_forward, abs=1e-6)
    assert series.head[-1, 0] == pytest.approx(row.progress_m, abs=0.02)  # along the first leg
    assert series.meta["outcome"] == "timeout"
    assert (series.yaw.shape, series.leg.shape) == ((ticks, 5), (ticks, 6, 2))
    again = antennate.simulate("closed", trial=1, time_limit=1.0)
    assert again.head.tobytes() == series.head.tobytes()
    other = antennate.simulate("closed", trial=1, time_limit=0.1, seed=5)
    assert (other.counts != series.counts[: len(other)]).any()


def test_a_trial_that_succeeds_ends_at_the_exit() -> None:
    """On the flat floor the robot walks straight on; the monitor of `tunnel` says when."""
    settings = {"scene": "flat", "time_limit": 60.0, "seed": 1}
    row = antennate.run("tunnel", trials=1, controllers=("open",), **settings).rows[0]
    series = antennate.simulate("open", **settings)
    assert series.meta["outcome"] == row.outcome == "success"
    assert series.t[-1] == pytest.approx(row.time_s, abs=1e-9)


def test_wrong_settings_of_a_trial_are_one_line() -> None:
    with pytest.raises(antennate.BadInputError, match=r"scen.*scene"):
        antennate.simulate("open", scen="flat")
    with pytest.raises(antennate.BadInputError, match="opne"):
        antennate.simulate("opne")
    for trial in (-1, 1.5):
        with pytest.raises(antennate.BadInputError, match="trial: expected a whole number"):
            antennate.simulate("open", trial=trial)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("kept", [False, True])
@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("maneuver", np.zeros((1, 1), np.int64), r"maneuver of shape \(1,\), found \(1, 1\)"),
        ("maneuver", np.array([7]), "tick 1: expected a maneuver of 0 to 4, found 7"),
        ("level", np.zeros(2), r"level of shape \(1, 2\), found \(2,\)"),
    ],
)
def test_an_answer_that_is_no_decision_is_one_line(
    name: str, value: Any, said: str, kept: bool, tmp_path: Path
) -> None:
    def make(*arguments: Any) -> Any:
        made = open_loop(*arguments)
        sound = made.step

        def step(frame: AntennaFrame) -> JointCommand:
            command = sound(frame)
            setattr(made, name, value)
            return command

        made.step = step
        return made

    with pytest.raises(ControllerError, match=said):
        antennate.simulate(
            functools.partial(make), time_limit=0.1, log=tmp_path / "log.mcap" if kept else None
        )


def test_the_summary_holds_no_surprise(tunnel: antennate.Result) -> None:
    """Numbers of rows and summary agree: the mean force over both trials."""
    mean = math.fsum(r.force_mean_n for r in tunnel.rows[:2]) / 2
    assert tunnel.summary["controllers"]["open"]["force_mean_n"] == pytest.approx(mean, rel=1e-12)
    assert tunnel.found.controllers["open"].force_mean_n == pytest.approx(mean, rel=1e-12)
