"""Small searches over a function, as files, and what they leave."""

from __future__ import annotations

import csv
import dataclasses
import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

import antennate
from antennate.cli import main
from antennate.experiments.study.experiment import EXPERIMENT

HERE = Path(__file__).parent
TRIAL = f"{HERE / 'design_trials.py'}:trial"
BOTH = 'minimize = ["near", "far"]'


def plan(
    goals: str = BOTH,
    vary: str = "x = { low = -2.0, high = 3.0 }",
    reference: str = "[reference]\npaper = { x = 2.0 }\n",
    settings: dict[str, Any] | None = None,
    **more: Any,
) -> None:
    """A small search over a function, as a file."""
    told = {"experiment": TRIAL, "plan": "optuna", "points": 12, "batch": 4, "trials": 3}
    lines = [
        f"{key} = {json.dumps(value)}" for key, value in (told | {"validated": 2} | more).items()
    ]
    inner = [f"{key} = {json.dumps(value)}" for key, value in (settings or {}).items()]
    text = [*lines, goals, "[vary]", vary, reference, "[settings]", *inner]
    Path("plan.toml").write_text("\n".join(text) + "\n")


def words(*more: str, out: str = "run") -> list[str]:
    return ["study", "plan.toml", "--trust-code", "--no-figures", "--out", out, *more]


def design(out: str = "run", workers: int = 1, figures: bool = False) -> antennate.Result:
    """Run the file from Python: in this process, which takes less time than the command."""
    with pytest.MonkeyPatch.context() as patch:
        if not figures:
            without = dataclasses.replace(EXPERIMENT, figures=lambda outcome: {})
            patch.setattr("antennate.experiments.study.experiment.EXPERIMENT", without)
        values = tomllib.loads(Path("plan.toml").read_text())
        return antennate.run("study", out=out, workers=workers, **values)


def result(run: str = "run") -> dict[str, Any]:
    return json.loads(Path(run, "result.json").read_text())["search"]


def table(run: str = "run") -> list[dict[str, str]]:
    return list(csv.DictReader(Path(run, "trials.csv").read_text().splitlines()))


def same(first: str, second: str, *names: str) -> None:
    for name in names or ("trials.csv", "result.json"):
        assert Path(first, name).read_bytes() == Path(second, name).read_bytes(), name


def refusal(capsys: pytest.CaptureFixture[str], *given_: str) -> str:
    capsys.readouterr()
    assert main(list(given_)) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert "Traceback" not in "".join(said)
    return said[-1]
