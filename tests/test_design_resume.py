"""Searches for designs that are cut, killed, changed, or whose trials fail."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from design_plans import HERE, design, plan, refusal, result, same, table, words

from antennate import experiments
from antennate.cli import main
from antennate.studies.run_files import add_to_list
from antennate.studies.trial_file import TRIALS

pytestmark = pytest.mark.usefixtures("there")


@pytest.mark.ci
def test_workers_do_not_change_a_byte() -> None:
    plan(settings={"noise": 0.1, "mode": "nan"})
    design("one", figures=True)
    design("two", workers=2, figures=True)
    same("one", "two", "trials.csv", "result.json", "config.toml", "figures/tradeoff.svg")


def test_a_search_cut_anywhere_goes_on_to_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan(settings={"noise": 0.1})
    design("whole")
    lines = Path("whole", TRIALS).read_bytes().splitlines(keepends=True)
    trials = len(table("whole"))
    assert len(lines) == 2 + trials + 3 + 1  # what is run, the processor, three batches, the end
    assert b'"processor":' in lines[1]
    for cut in (1, 5, 20, 41, len(lines) - 1):
        shutil.rmtree("run", ignore_errors=True)
        Path("run").mkdir()
        add_to_list(Path("run"), [TRIALS])
        Path("run", TRIALS).write_bytes(b"".join(lines[:cut]) + lines[cut][:30])
        notes = tmp_path / f"notes{cut}"
        with monkeypatch.context() as patch:
            patch.setenv("STUDY_NOTES", str(notes))
            design()
        same("run", "whole")
        kept = sum(b'"result"' in line for line in lines[:cut])
        ran = notes.read_text().splitlines() if notes.exists() else []
        assert len(ran) == len(set(ran)) == trials - kept


@pytest.mark.ci
def test_a_killed_search_goes_on_to_the_same_bytes() -> None:
    plan(settings={"noise": 0.1, "sleep": 0.05})
    design("whole")
    source = Path(experiments.__file__).parents[2]
    known = {**os.environ, "PYTHONPATH": f"{source}{os.pathsep}{HERE}"}
    command = [sys.executable, "-m", "antennate", *words("--workers", "2")]
    with subprocess.Popen(command, env=known, stderr=subprocess.DEVNULL) as driver:
        store = Path("run", TRIALS)
        while not store.exists() or store.read_bytes().count(b'"result"') < 15:
            assert driver.poll() is None
            time.sleep(0.02)
        driver.send_signal(signal.SIGKILL)
    assert not Path("run/trials.csv").exists()
    design()
    same("run", "whole")


def test_another_search_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    plan()
    design()
    before = Path("run/trials.csv").read_bytes()
    plan(seed=1)
    assert "seed 0, now 1" in refusal(capsys, *words())
    plan()
    path = Path("run", TRIALS)
    text = path.read_text()
    design()
    assert path.read_text() == text
    assert Path("run/trials.csv").read_bytes() == before


def test_another_version_of_optuna_is_refused(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import optuna

    plan()
    design()
    monkeypatch.setattr(optuna, "__version__", "0.1")
    assert f"expected optuna {result()['optuna']}, with which it was begun, found 0.1" in refusal(
        capsys, *words()
    )


@pytest.mark.parametrize(
    ("mode", "lost", "status", "states"),
    [("nan", 1, "nan", {"ok"}), ("raise", 3, "failed", {"ok", "failed"})],
)
def test_trials_that_say_nothing_are_rows(
    mode: str, lost: int, status: str, states: set[str]
) -> None:
    plan(settings={"mode": mode})
    said = design().sentence
    rows = [row for row in table() if row["phase"] == "search"]
    by_design = {
        number: [row["status"] for row in rows if row["point"] == number]
        for number in {row["point"] for row in rows}
    }
    assert {each.count(status) for each in by_design.values()} <= {0, lost}
    assert sum(map(len, by_design.values())) == 3 * 13
    assert {each["state"] for each in result()["designs"]} == states
    for each in result()["designs"]:
        assert (each["objectives"] is None) == (each["state"] == "failed")
        assert (each["state"] == "failed") == (mode == "raise" and each["values"]["x"] > 0.5)
    assert f"{status}; trials.csv has why" in said


def test_too_few_trials_that_are_ok_fail_a_design() -> None:
    plan(settings={"mode": "nan"}, least_ok=0.7)
    found = design()
    assert {each["state"] for each in found.summary["search"]["designs"]} == {"failed"}
    assert found.sentence.endswith("Designs that could not be judged: 13.")


@pytest.mark.ci
def test_failed_trials_can_be_run_again_and_proposals_stay() -> None:
    plan(settings={"mode": "file", "file": "bad", "noise": 0.1}, least_ok=0.9, validated=0)
    Path("bad").touch()
    design()
    before = result()["designs"]
    assert {each["state"] for each in before} == {"failed"}
    Path("bad").unlink()
    assert main(words("--retry", "--workers", "1")) == 0
    after = result()["designs"]
    assert {each["state"] for each in after} == {"ok"}
    assert [each["values"] for each in after] == [each["values"] for each in before]


def test_a_shard_of_a_search_is_refused_and_leaves_the_folder_as_it_is(
    capsys: pytest.CaptureFixture[str],
) -> None:
    plan()
    design()
    Path("run/result.json").unlink()  # as of a run that goes on
    before = {path: path.read_bytes() for path in Path("run").rglob("*.*")}
    for out in ("run", "other"):
        line = refusal(capsys, *words("--shard", "1/2", out=out))
        assert "--shard: expected trials that are known before the run, found a plan" in line
    assert {path: path.read_bytes() for path in Path("run").rglob("*.*")} == before
    assert not Path("other").exists()


@pytest.mark.ci
def test_bad_words_and_late_findings_are_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan('minimize = ["ner"]')
    assert "did you mean near?" in refusal(capsys, *words("--workers", "1", out="late"))
    plan('minimize = ["word"]')
    assert "expected a measure of" in refusal(capsys, *words("--workers", "1", out="later"))
    plan()
    monkeypatch.setitem(sys.modules, "optuna", None)
    assert "uv run --extra design antennate" in refusal(capsys, *words())
