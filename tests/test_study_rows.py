"""Rows of a user's own function in a study: what is kept, and what makes a row `failed`."""

from __future__ import annotations

import csv
import json
import time
from pathlib import Path
from typing import Any

import pytest

from antennate.cli import main
from antennate.studies.run_directory import RunDirectory
from antennate.studies.trial_file import TRIALS

OWN = """
import numpy as np

class Thing:
    pass

ROWS = [
    {"value": np.float64(1.5), "n": np.int64(3), "yes": np.bool_(True), "small": np.float32(0.5)},
    {"value": Thing()},
    {"value": 1j},
    {"value": np.complex128(1j)},
    {"value": 10**400},
    {"value": "\\ud800"},
    {"value": 2.5, "point": 7},
    {"value": 2.5, "trial": 7},
    {"value": 2.5, "status": "ok"},
    {"value": 2.5, "reason": "mine"},
    {"value": 2.5, "seed": 9},
    {"value": 2.5, "deep.x": 9},
    [1.0],
    {1: 2.0},
    {"value": 2.5, "list": np.arange(2), 'n': None},
]

def trial(config, seed):
    if seed == len(ROWS):
        raise ValueError("\\udcff")
    return ROWS[seed]
"""
REASONS = [
    "",
    "column value: expected numbers or text, found an object of type Thing",
    "column value: expected numbers or text, found an object of type complex",
    "column value: expected numbers or text, found an object of type complex",
    "not finite: value",
    "column value: 'utf-8' codec can't encode character '\\ud800' in position 11: surrogates not "
    "allowed",
    *(
        f"column {name}: expected another name, as the study has this column"
        for name in ("point", "trial", "status", "reason", "seed", "deep.x")
    ),
    "expected a row as a dictionary or a dataclass, found list",
    "expected names of columns as text, found int",
    "",
    "ValueError: \\udcff",
]
PLAN = 'experiment = "own.py:trial"\ntrials = {}\n[vary]\n"deep.x" = [1]\n'


pytestmark = [pytest.mark.ci, pytest.mark.usefixtures("there")]


def study(own: str, trials: int, *more: str) -> tuple[int, list[dict[str, str]]]:
    """Exit code and rows of a study of a function."""
    Path("own.py").write_text(own)
    Path("plan.toml").write_text(PLAN.format(trials))
    words = ["study", "plan.toml", "--trust-code", "--out", "run", "--workers", "1", *more]
    code = main(words)
    with Path("run/trials.csv").open(newline="") as file:
        return code, list(csv.DictReader(file))


def test_a_row_that_cannot_be_kept_is_failed_with_a_reason_and_the_study_goes_on() -> None:
    code, rows = study(OWN, len(REASONS), "--no-figures")
    assert code == 0
    found = [row["reason"].removeprefix("BadInputError: ") for row in rows]
    assert found == REASONS
    statuses = {"": "ok", "not finite: value": "nan"}
    assert [row["status"] for row in rows] == [statuses.get(text, "failed") for text in REASONS]
    first, last = rows[0], rows[-2]
    assert [first[name] for name in ("value", "n", "yes", "small")] == ["1.5", "3", "True", "0.5"]
    assert (last["value"], last["list"], last["n"]) == ("2.5", "[0, 1]", "")
    assert [row["trial"] for row in rows] == [str(seed) for seed in range(len(rows))]
    result = json.loads(Path("run/result.json").read_text())
    assert (result["response"], result["points"][0]["response"]) == ("value", 2.0)


def test_the_response_is_found_where_the_first_trial_failed() -> None:
    own = "def trial(config, seed):\n    return {'value': 1 / seed}\n"
    assert study(own, 3, "--no-figures")[0] == 0
    result = json.loads(Path("run/result.json").read_text())
    assert (result["response"], result["points"][0]["response"]) == ("value", 0.75)


def test_an_interrupted_study_says_how_many_of_its_trials_have_ended(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the note of its table and in its sentence."""
    kept = RunDirectory.append

    def append(self: RunDirectory, row: Any) -> None:
        kept(self, row)
        if row["trial"] == 1:
            raise KeyboardInterrupt

    monkeypatch.setattr(RunDirectory, "append", append)
    own = "import time\ndef trial(config, seed):\n    time.sleep(60 if seed == 3 else 0)\n"
    code, rows = study(own + "    return {'value': float(seed)}\n", 4, "--no-figures")
    assert code == 130
    ended = len(rows)
    assert ended in (2, 3)  # one more may have been on its way
    said = " ".join(capsys.readouterr().out.split())
    assert said.count(f" {ended} of 4 trials") == 2
    result = json.loads(Path("run/result.json").read_text())
    assert (result["trials"], result["ended"], result["interrupted"]) == (4, ended, True)


@pytest.mark.parametrize(
    ("body", "status"), [("raise ValueError", "failed"), ("__import__('time').sleep(99)", "hung")]
)
def test_a_study_of_which_no_trial_has_a_result_ends_with_2(body: str, status: str) -> None:
    own = f"def trial(config, seed):\n    {body}\n"
    code, rows = study(own, 2, "--trial-timeout", "0.2")
    assert (code, [row["status"] for row in rows]) == (2, [status, status])


def test_a_trial_that_leaves_the_working_folder_spoils_no_other() -> None:
    own = "import os\ndef trial(config, seed):\n    os.chdir('/')\n    return {'value': 1.0}\n"
    _, rows = study(own, 3, "--no-figures")
    assert [row["status"] for row in rows] == ["ok"] * 3


def test_a_worker_that_dies_while_its_child_lives_is_noticed() -> None:
    """The child holds all files of the worker open; nothing tells of the death but the system."""
    own = (
        "import os, signal, time\n"
        "def trial(config, seed):\n"
        "    if seed == 0:\n"
        "        if os.fork() == 0:\n"
        "            time.sleep(60)\n"
        "            os.kill(os.getpid(), signal.SIGKILL)\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
        "    return {'value': 1.0}\n"
    )
    start = time.monotonic()
    _, rows = study(own, 2, "--no-figures", "--trial-timeout", "600")
    assert [row["status"] for row in rows] == ["crashed", "ok"]
    assert time.monotonic() - start < 55.0


def test_a_study_does_not_go_on_with_other_code_beside_its_file(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Of a module that the named file imports, and of one that this one imports."""
    Path("helper.py").write_text("import constant\n")
    Path("constant.py").write_text("VALUE = 1.0\n")
    own = "import helper\ndef trial(config, seed):\n    return {'value': helper.constant.VALUE}\n"
    assert study(own, 1, "--no-figures")[0] == 0
    Path("constant.py").write_text("VALUE = 2.0\n")
    assert study(own, 1, "--no-figures")[0] == 2
    assert "the file constant.py changed" in capsys.readouterr().err


def test_trials_of_which_nobody_knows_what_was_run_are_not_run_again_in_silence(
    capsys: pytest.CaptureFixture[str],
) -> None:
    own = "def trial(config, seed):\n    return {'value': 1.0}\n"
    assert study(own, 3, "--no-figures")[0] == 0
    path = Path("run", TRIALS)
    path.write_bytes(path.read_bytes().replace(b"identity", b"identify", 1))
    assert study(own, 3, "--no-figures")[0] == 2
    assert "found that damaged, and 3 sound trials" in capsys.readouterr().err
