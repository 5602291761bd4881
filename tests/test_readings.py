"""What a controller is given in place of its own readings."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from antennate.cli import main
from antennate.control.readings import make_readings, parts_of
from antennate.control.registry import make_controller
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.params.control import ControlParams
from antennate.telemetry.reader import LogReader
from antennate.types import AntennaFrame, Contact, Floats

CONTROL = ControlParams()
NARROW = ["--seed", "3", "--time-limit", "2"]


def changed(name: str, counts: Floats, **more: Any) -> Floats:
    """What is given for counts (ticks, B, 2)."""
    readings = make_readings(name, CONTROL, counts.shape[1], **more)
    readings.reset(np.arange(counts.shape[1]))
    times = np.arange(len(counts)) * CONTROL.period
    frames = (
        AntennaFrame(np.full(counts.shape[1], t), c) for t, c in zip(times, counts, strict=True)
    )
    return np.array([readings.change(frame).counts for frame in frames])


@pytest.fixture
def counts() -> Floats:
    return np.random.default_rng(0).integers(1300, 1900, (120, 3, 2)).astype(float)


def test_none_is_a_sound_antenna_that_touches_nothing(counts: Floats) -> None:
    given = changed("none", counts)
    made = make_controller("closed", CONTROL, batch=3)
    for tick, reading in enumerate(given):
        made.step(AntennaFrame(np.full(3, 0.01 * tick), reading))
        assert (made.contact == int(Contact.FREE)).all()
        assert (made.level < 0.01).all()


def test_swapped_and_own_and_delayed(counts: Floats) -> None:
    assert np.array_equal(changed("own", counts), counts)
    assert np.array_equal(changed("swapped", counts), counts[:, :, ::-1])
    late = changed("delayed:0.25", counts)
    assert np.array_equal(late[25:], counts[:-25])
    assert (late[:25] == counts[0]).all()


def test_a_row_that_begins_anew_forgets_and_the_others_go_on(counts: Floats) -> None:
    readings = make_readings("delayed:0.1", CONTROL, 3)
    given: list[Floats] = []
    for tick, reading in enumerate(counts):
        if tick == 50:
            readings.reset(np.array([1]))
        given.append(readings.change(AntennaFrame(np.zeros(3), reading)).counts)
    late = np.array(given)
    assert (late[50:60, 1] == counts[50, 1]).all()
    assert np.array_equal(late[60:, 1], counts[50:-10, 1])
    assert np.array_equal(late[10:, [0, 2]], counts[:-10, [0, 2]])


def test_yoked_repeats_what_was_recorded(counts: Floats) -> None:
    donors = [counts[:7, 0], counts[:50, 1], counts[:120, 2]]
    given = changed("yoked", np.zeros_like(counts), donors=donors)
    for row, donor in enumerate(donors):
        assert np.array_equal(given[:, row], np.resize(donor, (120, 2)))


def test_a_path_with_an_at_is_no_condition() -> None:
    assert parts_of("closed@delayed:0.5") == ("closed", "delayed:0.5")
    assert parts_of("me@home/mine.py:Mine@yoked") == ("me@home/mine.py:Mine", "yoked")
    assert parts_of("me@home/mine.py:Mine") == ("me@home/mine.py:Mine", "own")


def logged(path: Path) -> Floats:
    with LogReader(path) as log:
        return np.array([tick.frame().counts[0] for tick in log])


@pytest.mark.slow
def test_yoked_trials_get_the_readings_of_the_next_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On one worker and on two, and replayed."""
    monkeypatch.chdir(tmp_path)
    words = ["tunnel", *NARROW, "--trials", "3", "--controllers", "closed"]
    more = ["--readings", "own", "yoked", "--no-figures"]
    assert main([*words, *more, "--workers", "1", "--out", "one", "--log"]) == 0
    assert main([*words, *more, "--workers", "2", "--out", "two"]) == 0
    assert Path("one/trials.csv").read_text() == Path("two/trials.csv").read_text()
    result = json.loads(Path("one/result.json").read_text())
    assert list(result["controllers"]) == ["closed", "closed@yoked"]
    assert result["paired"]["closed-closed@yoked"]["trials"] == 3
    own = [logged(Path(f"one/logs/closed-{trial}.mcap")) for trial in range(3)]
    for trial in range(3):
        path = Path(f"one/logs/closed_yoked-{trial}.mcap")
        given = logged(path)
        assert np.array_equal(given, np.resize(own[(trial + 1) % 3], given.shape))
        with LogReader(path) as log:
            assert (log.header.controller, log.header.readings) == ("closed", "yoked")
        assert main(["log", "replay", str(path)]) == 0
        assert "decided as recorded in all" in capsys.readouterr().out
    log, other = "one/logs/closed-0.mcap", "one/logs/closed-1.mcap"
    words = ["log", "replay", log, "--readings", "yoked", "--donor", other]
    assert main([*words, "--out", "again"]) == 0
    assert json.loads(Path("again/result.json").read_text())["controller"] == "closed@yoked"
    capsys.readouterr()
    lent = {log: "expected a log of another trial or drive, found the same"}
    lent["one/logs/closed_yoked-1.mcap"] = "expected a log of own readings, found yoked"
    for donor, said in lent.items():
        assert main([*words[:-1], donor]) == 2
        error = capsys.readouterr().err
        assert said in error
        assert error.count("\n") == 1


@pytest.mark.ci
def test_rows_do_not_depend_on_the_batch() -> None:
    config = TunnelConfig(seed=3, trials=4, time_limit=2.0, control=ControlParams(rate=50.0))
    tables: list[dict[int, Any]] = []
    for batch in (1, 3):
        rows: dict[int, Any] = {}
        run_trials(
            *(config, "timed@yoked", range(4)),
            *(lambda found, rows=rows: rows.__setitem__(found[0].trial, found[0]), batch),
        )
        tables.append(rows)
    assert tables[0] == tables[1]


@pytest.mark.slow
def test_with_more_trials_only_the_yoked_trial_that_was_last_runs_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["tunnel", "--seed", "3", "--time-limit", "1", "--scene", "flat", "--no-figures"]
    words += ["--controllers", "closed", "--readings", "own", "yoked", "--workers", "1"]
    assert main([*words, "--trials", "2", "--out", "run"]) == 0
    assert main([*words, "--trials", "3", "--out", "run", "--resume"]) == 0
    assert main([*words, "--trials", "3", "--out", "once"]) == 0
    for name in ("trials.csv", "result.json"):
        assert Path("run", name).read_bytes() == Path("once", name).read_bytes()


def test_a_replay_needs_another_log_for_yoked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = str(tmp_path / "none.mcap")
    assert main(["log", "replay", log, "--readings", "yoked"]) == 2
    assert "expected --donor" in capsys.readouterr().err
    assert main(["log", "replay", log, "--donor", log]) == 2
    assert "expected --readings yoked beside it" in capsys.readouterr().err
