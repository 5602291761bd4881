"""What a user's words may not make a command do: wait for a pipe, follow a link, run code."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from antennate.cli import main
from antennate.errors import OutputError
from antennate.studies.run_directory import RunDirectory

SOON = 5.0
"""Time in which a refusal comes on a busy machine [s]; an open of a pipe would wait for ever."""
PORTS = ["--esp32", "left", "--bus", "right"]


pytestmark = pytest.mark.usefixtures("there")


@pytest.mark.parametrize("device", ["pipe", "/dev/zero", "."])
@pytest.mark.parametrize(
    "words",
    [
        ["log", "replay"],
        ["calibrate", "--recording"],
        ["tunnel", "--config"],
        ["tunnel", "--robot"],
        ["drive", *PORTS, "--calibration"],
        ["drive", *PORTS, "--config"],
        ["drive", "--esp32", "udp://127.0.0.1:9", "--bus", "right", "--key"],
    ],
    ids=" ".join,
)
def test_what_is_no_regular_file_is_refused_at_once(
    words: list[str], device: str, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo("pipe")
    ended = threading.Event()

    def rescue() -> None:  # if it waits, a writer lets it go on, and the test fails
        if not ended.wait(SOON):
            os.close(os.open("pipe", os.O_RDWR))

    threading.Thread(target=rescue, daemon=True).start()
    assert main([*words, device]) == 2
    ended.set()
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert device in error
    of_folder = "expected a run with a log, found none; --log keeps those of a simulation\n"
    known = (words, device) == (["log", "replay"], ".")  # the folder of a run stands for its log
    assert error.endswith(of_folder if known else ": it is a folder, a pipe or a device\n")
    assert not Path("runs").exists()


def test_a_run_is_not_written_through_a_link(tmp_path: Path) -> None:
    elsewhere, run = tmp_path / "elsewhere", tmp_path / "run"
    elsewhere.mkdir()
    run.mkdir()
    (run / "figures").symlink_to(elsewhere)
    with pytest.raises(OutputError, match="figures within its run, found a link"):
        RunDirectory.create("replay", run)
    assert not list(elsewhere.iterdir())
    assert [path.name for path in run.iterdir()] == ["figures"]


@pytest.mark.parametrize("name", ["controller", "controllers", "scene"])
def test_code_that_a_file_names_runs_only_if_a_flag_names_it_too(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], refused: Callable[..., str]
) -> None:
    command = ["drive", *PORTS] if name == "controller" else ["tunnel", "--trials", "1"]
    code, file = tmp_path / "theirs.py", tmp_path / "theirs.toml"
    code.write_text("open('it_ran', 'w').close()\n")
    value = ["theirs.py:It"] if name == "controllers" else "theirs.py:It"
    file.write_text(f"{name} = {value!r}\n")
    error = refused(*command, "--config", "theirs.toml")
    assert f"if you trust that code, add --{name} theirs.py:It\n" in error
    assert not Path("it_ran").exists()
    assert main([*command, "--config", "theirs.toml", f"--{name}", "theirs.py:It"]) == 2
    assert Path("it_ran").exists()  # it ran, and has no class It
    assert "no It in theirs.py" in capsys.readouterr().err
