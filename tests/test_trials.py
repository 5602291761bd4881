"""A trial is written once: pool, lockstep, view and studies carry out the same."""

from __future__ import annotations

import importlib
import signal
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from antennate.params.base import Params, number
from antennate.studies.columns import CONDITION
from antennate.studies.experiment import Experiment
from antennate.studies.pool import Workers
from antennate.studies.trial_file import TrialFile
from antennate.studies.trials import Trials, no_row, no_step
from antennate.telemetry import Restart


class Config(Params):
    """Throws of two dice."""

    trials: int = number(3, "1", "assumed: few", ge=1)
    """Throws."""
    seed: int = number(7, "1", "assumed: any", ge=0)
    """Seed of all chance."""


@dataclass(frozen=True)
class Row:
    seed: int
    trial: int
    die: str = field(metadata=CONDITION)
    eyes: int


@dataclass(frozen=True)
class Thrown:
    throws: int
    interrupted: bool = False


@dataclass(frozen=True)
class Summed:
    eyes: int


def throw(config: Config, die: str, number: int, view: Any = None) -> tuple[Row, str | None]:
    if view is not None:
        view.watch(number)
    eyes = (config.seed + 5 * number + (die == "red")) % 6 + 1
    return Row(config.seed, number, die, eyes), "drawn" if number == 0 else None


def dice(**more: Any) -> Trials[Config]:
    return Trials[Config](
        throw,
        row=Row,
        summarise=lambda found: Thrown(len(found.rows)),
        every=lambda config: [(d, k) for k in range(config.trials) for d in ("red", "blue")],
        invalid=lambda config, die, number, reason: Row(config.seed, number, die, 0),
        **more,
    )


def test_trials_come_by_condition_and_number_whatever_their_order() -> None:
    """The order of conditions is that in which they come first."""
    rows: list[Row] = []
    ended, interrupted = dice().gather(Config(), 1, no_step, rows.append)
    assert not interrupted
    assert [(row.die, row.trial) for row, _ in ended] == [
        (die, k) for die in ("red", "blue") for k in range(3)
    ]
    assert [(row.die, row.trial) for row in rows] == [
        (die, k) for k in range(3) for die in ("red", "blue")
    ]
    assert [extra for _, extra in ended] == ["drawn", None, None] * 2


def test_a_study_gets_the_row_of_each_trial_by_its_place() -> None:
    config, places = Config(), dict[int, Row]()
    dice().run(config, [("blue", 2), ("red", 0), ("blue", 1)], places.__setitem__)
    assert [(places[i].die, places[i].trial) for i in range(3)] == [
        ("blue", 2),
        ("red", 0),
        ("blue", 1),
    ]
    assert places[0] == throw(config, "blue", 2)[0]


class View:
    """A person who wants the second trial anew, with another seed."""

    def __init__(self) -> None:
        self.begun: list[tuple[str, int]] = []

    def begin(self, title: str, seed: int) -> None:
        self.begun.append((title, seed))

    def watch(self, number: int) -> None:
        if len(self.begun) == 2:
            raise Restart(99)


def test_a_trial_that_is_begun_anew_has_the_seed_that_a_person_wants_and_no_other_has() -> None:
    view: Any = View()
    ended, _ = dice().gather(Config(trials=2), 1, no_step, no_row, view=view)
    assert [seed for _, seed in view.begun] == [7, 7, 99, 7, 7]
    assert view.begun[1][0] == view.begun[2][0] == "blue, trial 0"
    assert {(row.die, row.trial): row.seed for row, _ in ended} == {
        ("red", 0): 7,
        ("red", 1): 7,
        ("blue", 0): 99,
        ("blue", 1): 7,
    }


@pytest.mark.parametrize("result", [Thrown, Summed])
def test_what_had_ended_before_ctrl_c_is_a_result_only_where_it_can_say_so(result: type) -> None:
    def on_step(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    experiment = Experiment[Config, Any](
        "dice", "Throw.", Config, dice(), lambda _: [], lambda _: "", result=result
    )
    if result is Summed:
        with pytest.raises(KeyboardInterrupt):
            experiment.run(Config(), 1, on_step, no_row)
        return
    assert experiment.run(Config(), 1, on_step, no_row).result() == Thrown(2, interrupted=True)


@pytest.mark.parametrize("where", ["the trial", "a third package"])
def test_figure_data_of_another_package_than_the_row_is_read_back(
    where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No finished trial runs again."""
    (tmp_path / "dice_drawn.py").write_text(
        "from dataclasses import dataclass\n@dataclass\nclass Rolled:\n    turns: int\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    drawn = importlib.import_module("dice_drawn")
    times: list[int] = []

    def rolled(config: Config, die: str, number: int) -> Any:
        times.append(number)
        return throw(config, die, number)[0], drawn.Rolled(3 * number)

    def trials() -> Trials[Config]:
        if where == "the trial":
            monkeypatch.setattr(rolled, "__module__", "dice_drawn")
            return replace(dice(), trial=rolled)
        return replace(dice(), trial=rolled, drawn=drawn.Rolled)

    found: list[Any] = []
    for _ in range(2):
        file = TrialFile(tmp_path / "trials.jsonl")
        file.begin({"command": "dice"})
        workers = Workers(1, trials=file)
        found.append(trials().gather(Config(), workers, no_step, no_row))
        file.close()
    assert found[0] == found[1]
    assert [seen.turns for _, seen in found[1][0]] == [0, 3, 6] * 2
    assert len(times) == 6


def test_a_finished_trial_that_cannot_be_read_back_is_told_when_it_runs_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    def signalled(config: Config, die: str, number: int) -> tuple[Row, signal.Signals]:
        return throw(config, die, number)[0], signal.SIGTERM  # a class of another package

    strange = replace(dice(), trial=signalled)
    for _ in range(2):
        file = TrialFile(tmp_path / "trials.jsonl")
        file.begin({"command": "dice"})
        strange.gather(Config(trials=1), Workers(1, trials=file), no_step, no_row)
        file.close()
    assert "run again: 2: expected a class of" in caplog.text
    assert "found signal:Signals" in caplog.text
