"""An experiment of another package: one object and an entry point, and every command knows it."""

from __future__ import annotations

import re
import sys
from dataclasses import MISSING, Field, fields
from importlib.metadata import EntryPoints
from pathlib import Path
from typing import Any

import pytest

import antennate
from antennate import experiments
from antennate.cli import main
from antennate.errors import BadInputError
from antennate.studies.experiment import Experiment
from antennate.studies.run_directory import RunDirectory
from antennate.studies.trials import Batches, Trials

PAGE = Path(__file__).parents[1] / "docs" / "experiments.md"
DICE, PROCEDURE = (
    each.split("```")[0] for each in PAGE.read_text(encoding="utf-8").split("```python\n")[1:]
)
"""The example of the documentation, and the function that runs the whole."""
TRIALS = "Trials(throw, Row, lambda found: pooled(Result, found.frame))"
ONE = ("--workers", "1")
WHOLE = f"""
from antennate.studies.experiment import Done
from antennate.studies.pooling import frame
{PROCEDURE}

EXPERIMENT ="""


@pytest.fixture
def dice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which a package with an experiment is installed."""
    site = tmp_path / "site"
    about = site / "dice_study-1.0.dist-info"
    about.mkdir(parents=True)
    (site / "dice_study.py").write_text(DICE)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: dice-study\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[antennate.experiments]\ndice = dice_study:EXPERIMENT\nbroken = dice_study:NOTHING\n"
        "module = dice_study\n--help = dice_study:EXPERIMENT\nwe ird = dice_study:EXPERIMENT\n"
    )
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "dice_study", raising=False)
    return tmp_path


def test_it_runs_and_leaves_a_directory_like_ours(
    dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert sum(bool(line.strip()) for line in DICE.splitlines()) <= 40
    assert main(["dice", "--trials", "3", *ONE, "--seed", "7", "--out", "run"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("Dice show ")  # the sentence first, then the table
    assert "eyes, mean" in out
    assert err.endswith("written to run\n")
    run = RunDirectory.open(dice / "run")
    assert [(row["seed"], row["trial"]) for row in run.rows()] == [(7, 0), (7, 1), (7, 2)]
    assert run.result()["eyes"] == pytest.approx(sum(r["eyes"] for r in run.rows()) / 3)
    assert "trials = 3" in (dice / "run" / "config.toml").read_text()


def test_a_column_is_one_line(dice: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is in the result and in the table."""
    line = '    sixes: int = column("sixes", "", lambda rows, _: int((rows.eyes == 6).sum()))'
    (dice / "site" / "dice_study.py").write_text(
        DICE.replace("    schema: int = 1\n", f"{line}\n    schema: int = 1\n")
    )
    assert main(["dice", "--trials", "40", *ONE, "--seed", "7", "--out", "run"]) == 0
    run = RunDirectory.open(dice / "run")
    thrown = sum(row["eyes"] == 6 for row in run.rows())
    assert thrown > 0
    assert run.result()["sixes"] == thrown
    assert f"sixes {thrown}.00" in " ".join(capsys.readouterr().out.split())


def test_it_is_told_how_many_workers_are_asked_for(
    dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = DICE.replace("EXPERIMENT =", WHOLE).replace(TRIALS, "procedure")
    (dice / "site" / "dice_study.py").write_text(whole.replace("eyes=int(n)", "eyes=workers.count"))
    assert main(["dice", "--trials", "2", "--workers", "5", "--out", "run"]) == 0
    assert [row["eyes"] for row in RunDirectory.open(dice / "run").rows()] == [5, 5]


@pytest.mark.ci
def test_shards_workers_and_a_run_that_goes_on_give_the_rows_of_one_process(dice: Path) -> None:
    """Nothing but the function of one trial is written for that."""
    alone = ["dice", "--trials", "6", *ONE, "--out", "alone"]
    assert main(alone) == 0
    assert main(["dice", "--trials", "6", "--workers", "2", "--out", "two"]) == 0
    assert main(["dice", "--trials", "4", *ONE, "--out", "more"]) == 0
    assert main(["dice", "--trials", "6", *ONE, "--out", "more", "--resume"]) == 0
    for k in (1, 2):
        assert main(["dice", "--trials", "6", *ONE, "--shard", f"{k}/2", "--out", f"part{k}"]) == 0
    assert main(["study", "merge", "part1", "part2", "--out", "merged"]) == 0
    table = (dice / "alone" / "trials.csv").read_bytes()
    assert table.count(b"\n") == 7
    for name in ("two", "more", "merged"):
        assert (dice / name / "trials.csv").read_bytes() == table


def test_what_the_page_says_an_experiment_needs_is_what_it_has() -> None:
    said = [set(re.findall(r"`(\w+)`", line)) for line in PAGE.read_text().splitlines()]
    for kind, needed in ((Experiment, 7), (Trials, 3), (Batches, 0)):
        names = {field.name for field in fields(kind)}
        assert any(names <= line for line in said), kind
        given = [each for each in fields(kind) if not _has_default(each)]
        assert len(given) <= max(needed, 2)


def _has_default(field: Field[Any]) -> bool:
    return field.default is not MISSING or field.default_factory is not MISSING


def test_help_and_errors_know_it(dice: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "Throw dice" in experiments.load("dice").description
    assert main(["dise"]) == 2
    assert "did you mean dice?" in capsys.readouterr().err
    assert main(["dice", "--trials", "0"]) == 2
    assert "--trials: expected a number of at least 1, found 0" in capsys.readouterr().err


def test_one_that_cannot_be_loaded_is_named_and_does_not_hide_the_others(
    dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(BadInputError, match="dice_study:NOTHING"):
        experiments.load("broken")
    with pytest.raises(BadInputError, match="an experiment at dice_study, found <module 'dice_"):
        experiments.load("module")
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert "dice" in out
    assert "tunnel" in out


@pytest.mark.parametrize("words", [("parameters",), ("--completion", "bash")])
def test_what_lists_all_leaves_out_one_that_cannot_be_loaded_and_says_so(
    words: tuple[str, ...], dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(list(words)) == 0
    out, err = capsys.readouterr()
    assert "controllers" in out
    assert err.count("\n") == 2
    assert "warning: broken: expected an experiment at dice_study:NOTHING" in err
    assert "warning: module: expected an experiment at dice_study, found <module" in err
    assert "we ird" not in out


def test_two_of_one_name_are_refused_with_both_packages(
    dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    about = next((dice / "site").glob("*.dist-info")) / "entry_points.txt"
    about.write_text("[antennate.experiments]\ngait = dice_study:EXPERIMENT\n")
    assert main(["gait", *ONE]) == 2
    err = capsys.readouterr().err
    assert err.startswith("antennate gait: error: expected one experiment gait, found ")
    assert "dice_study:EXPERIMENT of dice-study" in err
    assert "antennate_lab.gait.experiment:EXPERIMENT of antennate-lab" in err
    assert not (dice / "runs").exists()


def test_without_the_laboratory_the_rest_is_there_and_says_what_is_missing(
    there: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("antennate.lookup.entry_points", EntryPoints)
    monkeypatch.setattr(sys, "path", [*sys.path, "another"])  # what is installed is read again
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert "tunnel" in out
    assert "compete" not in out
    missing = (
        "expected the package antennate-lab, which has gait, found none; "
        "install it with `pip install ./antennate/packages/*`"
    )
    assert main(["gait"]) == 2
    assert missing in capsys.readouterr().err
    (there / "plan.toml").write_text('experiment = "gait"\n')
    assert main(["study", "plan.toml", "--out", "study"]) == 2
    assert missing in capsys.readouterr().err
    with pytest.raises(BadInputError, match="which has gait, found none"):
        antennate.run("gait")
    assert main(["tunnell"]) == 2
    assert "did you mean tunnel?" in capsys.readouterr().err


FORMS = "dice: expected tables to return a list of Table and sentence a text, found "
TYPES = "dice: expected values of the types that Result says, found eyes: input should be"


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('[Table.of("Dice", {"throws": result})]', "1 / 0", f"{FORMS}ZeroDivisionError"),
        ('[Table.of("Dice", {"throws": result})]', '["dice"]', f"{FORMS}list and str"),
        ('f"Dice show {result.eyes:.1f} eyes."', "6", f"{FORMS}list and int"),
        ("    result=Result,\n", "", "its class as `result` of the experiment, found Result"),
        ("eyes: float | None =", "eyes: str =", TYPES),
        ("found.frame)", "found.frame, eyes=[])", TYPES),
    ],
)
def test_tables_a_sentence_and_a_result_of_another_form_are_one_line(
    old: str, new: str, told: str, dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The rows are kept."""
    assert old in DICE
    (dice / "site" / "dice_study.py").write_text(DICE.replace(old, new))
    assert main(["dice", "--trials", "2", *ONE, "--out", "run"]) == 2
    err = capsys.readouterr().err
    assert told in err
    assert "Traceback" not in err
    assert len(RunDirectory.open(dice / "run").rows()) == 2


def test_numbers_of_numpy_are_kept_and_other_objects_refused(
    dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drawn = "eyes=int(rng.integers(1, 7))"
    text = DICE.replace(drawn, "eyes=rng.integers(1, 7)").replace("schema: int = 1", "a: Any = 1")
    text = text.replace("found.frame)", "found.frame, a=np.eye(1))")
    (dice / "site" / "dice_study.py").write_text(
        f"{text}\n".replace("import numpy", "from typing import Any\nimport numpy", 1)
    )
    assert main(["dice", "--trials", "2", *ONE, "--out", "run"]) == 0
    run = RunDirectory.open(dice / "run")
    assert {row["eyes"] for row in run.rows()} <= set(range(1, 7))
    assert run.result()["a"] == [[1.0]]
    sys.modules.pop("dice_study")
    (dice / "site" / "dice_study.py").write_text(DICE.replace(drawn, "eyes={trial}"))
    assert main(["dice", "--trials", "2", *ONE, "--out", "other"]) == 2
    err = capsys.readouterr().err
    assert err.endswith("expected a result that can be kept, found set\n")
    assert "Traceback" not in err


def test_a_result_that_holds_itself_is_refused_in_one_line(
    dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = DICE.replace("eyes=int(rng.integers(1, 7))", "eyes=endless()")
    endless = "\n\ndef endless():\n    rows = []\n    rows.append(rows)\n    return rows\n"
    (dice / "site" / "dice_study.py").write_text(text + endless)
    assert main(["dice", "--trials", "2", *ONE, "--out", "run"]) == 2
    err = capsys.readouterr().err
    assert "expected a result that can be kept, found one that holds itself" in err
    assert err.count("\n") == 1, err


def test_a_module_that_ends_the_program_hides_no_other(
    dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (dice / "site" / "dice_study.py").write_text("raise SystemExit('needs a licence')\n")
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert "needs a licence" in out
    assert "tunnel" in out


def test_each_of_ours_has_one_object_of_its_own_name() -> None:
    for name in experiments.names():
        experiment = experiments.load(name)
        assert experiment.name == name
        assert experiment.description.splitlines()[0].endswith(".")


def test_a_directory_is_written_and_read_from_python(tmp_path: Path) -> None:
    config = experiments.load("wall").config(trials=3)
    rows = [{"trial": 0, "force_n": 0.1, "why": "=1+1"}, {"trial": 1, "force_n": None, "why": ""}]
    with RunDirectory.create("wall", tmp_path / "a") as run:
        run.describe(config)
        run.append(rows[0])
        assert RunDirectory.open(run.path).rows() == [rows[0]]
        run.finish({"mean": float("nan")}, rows)
    again = RunDirectory.open(tmp_path / "a")
    assert again.config(type(config)) == config
    assert again.result() == {"mean": None}
    assert again.rows() == [rows[0], {**rows[1], "why": None}]
    assert not (again.path / "command.txt").exists()


@pytest.mark.parametrize(
    ("name", "text", "ask"),
    [
        ("result.json", "{", "result"),
        ("trials.store.jsonl", "", "rows"),
        ("trials.partial.jsonl", '{"a": 1}\n', "rows"),
        ("config.toml", "trials = ", "config"),
        ("config.toml", "no_such_key = 1", "config"),
    ],
)
def test_a_damaged_directory_is_one_line(tmp_path: Path, name: str, text: str, ask: str) -> None:
    (tmp_path / "config.toml").touch()
    (tmp_path / name).write_text(text)
    run = RunDirectory.open(tmp_path)
    wants = (experiments.load("antenna").config,) if ask == "config" else ()
    with pytest.raises(BadInputError, match=name) as error:
        getattr(run, ask)(*wants)
    assert "\n" not in str(error.value)


def test_text_that_looks_like_a_number_stays_text(tmp_path: Path) -> None:
    texts = ["1_000", "007", "1e", "+3", "0x10", "- 1", "infinity", " 1", "1.", "Nan"]
    rows = [{"n": -12, "x": -1.5e-07, "y": 3.0, "z": float("inf"), "t": text} for text in texts]
    with RunDirectory.create("wall", tmp_path / "a") as run:
        run.finish({}, rows)
    assert RunDirectory.open(tmp_path / "a").rows() == rows


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"expected the folder of a run, found no result\.json"):
        RunDirectory.open(tmp_path)
    with pytest.raises(BadInputError, match="path: expected a path, found ''"):
        RunDirectory.create("wall", "")


def test_a_disk_that_is_full_at_the_end_keeps_and_shows_what_was_measured(
    dice: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import antennate.files

    def full(*args: object) -> None:
        raise OSError(28, "No space left on device")

    whole = RunDirectory.write

    def write(self: RunDirectory, name: str, content: str | bytes) -> None:
        if name == "trials.csv":
            monkeypatch.setattr(antennate.files.os, "fsync", full)
        whole(self, name, content)

    monkeypatch.setattr(RunDirectory, "write", write)
    assert main(["dice", "--trials", "2", *ONE, "--out", "run"]) == 2
    out, err = capsys.readouterr()
    assert "eyes, mean" in out
    assert "No space left on device" in err
    assert [row["trial"] for row in RunDirectory.open("run").rows()] == [0, 1]


def test_a_file_that_a_trial_misses_is_told_with_the_line_that_asked(
    dice: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    program = dice / "site" / "dice_study.py"
    text = program.read_text().replace("    rng = ", '    open("missing.csv")\n    rng = ', 1)
    program.write_text(text)
    place = text.splitlines().index('    open("missing.csv")') + 1
    assert main(["dice", "--trials", "1", *ONE, "--out", "run"]) == 2
    (line,) = [each for each in capsys.readouterr().err.splitlines() if "error:" in each]
    assert "missing.csv" in line
    assert f"dice_study.py:{place}" in line
