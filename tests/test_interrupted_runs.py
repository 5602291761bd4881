"""What an interrupted run says: the whole command that goes on with it."""

import json
import shlex

import pytest

from antennate.cli import main
from antennate.sim.world import World
from antennate.studies.run_directory import RunDirectory

TUNNEL = ["tunnel", "--controllers", "open", "--time-limit", "0.2", "--trials", "3"]


def interrupted(capsys, monkeypatch, *words):
    """Interrupt a run after its first trial; the words of the command that it names."""
    kept = RunDirectory.append

    def append(self, row):
        kept(self, row)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(RunDirectory, "append", append)
        assert main([*words]) == 130
    (line,) = [a for a in capsys.readouterr().err.splitlines() if a.startswith("to go on: ")]
    return shlex.split(line.removeprefix("to go on: "))


def test_nothing_stays_of_a_run_that_is_interrupted_before_its_first_trial(
    capsys, tmp_path, monkeypatch
):
    """So the same command runs again, with --resume as well."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()

    def advance(self, count):
        raise KeyboardInterrupt

    words = [*TUNNEL, "--log", "--workers", "1", "--no-figures", "--out"]
    for folder in ("new", "there"):
        with monkeypatch.context() as patched:
            patched.setattr(World, "advance", advance)
            assert main([*words, folder]) == 130
    assert [path.name for path in tmp_path.rglob("*")] == ["there"]
    (tmp_path / "there" / "logs").mkdir()
    (tmp_path / "there" / "logs" / "a.mcap").write_bytes(b"of somebody")
    capsys.readouterr()
    assert main([*words, "there", "--resume"]) == 2
    assert "expected an unfinished run, found there/logs/a.mcap" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("out", "folder"),
    [(["--out", "a run", "--overwrite"], "a run"), (["--out=mine"], "mine"), ([], "runs/tunnel-1")],
)
def test_an_interrupted_run_names_the_whole_command_that_goes_on(
    capsys, tmp_path, monkeypatch, out, folder
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("UV", raising=False)
    told = interrupted(capsys, monkeypatch, *TUNNEL, *out, "--workers", "1", "--no-figures")
    assert told[0] == "antennate"
    assert told[-3:] == ["--out", folder, "--resume"]
    assert "--overwrite" not in told
    assert main(told[1:]) == 0
    result = json.loads((tmp_path / folder / "result.json").read_text())
    assert result["controllers"]["open"]["trials"] == 3


def test_an_interrupted_run_within_uv_names_the_command_of_uv(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("UV", "/usr/bin/uv")
    told = interrupted(capsys, monkeypatch, *TUNNEL, "--out", "run", "--workers", "1")
    assert told[:4] == ["uv", "run", "antennate", "tunnel"]
    assert told[4:10] == TUNNEL[1:]
