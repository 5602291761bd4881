"""What a shell offers after `source <(antennate --completion bash)`."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from antennate.cli import main

ASK = """\
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
_antennate
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The script for bash."""
    path = tmp_path_factory.mktemp("completion") / "antennate.bash"
    with pytest.MonkeyPatch.context() as patch, path.open("w") as file:
        patch.setattr("sys.stdout", file)
        assert main(["--completion", "bash"]) == 0
    return path


def offered(script: Path, *words: str) -> list[str]:
    """What bash offers for the last word."""
    done = subprocess.run(
        ["bash", "-c", ASK, "bash", script, "antennate", *words],
        capture_output=True, text=True, check=True, timeout=30,
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout.split()


@pytest.mark.ci
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["tu"], ["tunnel"]),
        (["--comp"], ["--completion"]),
        (["tunnel", "--sce"], ["--scene"]),
        (["tunnel", "--contr"], ["--controllers"]),
        (["tunnel", "--trials", "3", "--tunnel.mir"], ["--tunnel.mirror"]),
        (["tunnel", "--tunnel.mirror", ""], ["random", "never", "always"]),
        (["bench", "wall", "--wall.gravity", "o"], ["off"]),
        (["tunnel", "--controllers", "open", "cl"], ["closed"]),
        (["tunnel", "--controllers", "m"], ["map"]),
        (["drive", "--controller", "m"], []),  # a robot has none
        (["tunnel", "--engine", ""], ["local", "dask", "slurm", "slurm-local", "warp"]),
        (["drive", "--robot", ""], ["scuttle", "hexapod"]),
        (["robot", ""], ["scuttle", "hexapod", "--robot", "--out"]),
        (["robot", "--robot", ""], ["scuttle", "hexapod"]),
        (["gait", "--gait", "b"], ["b11bl0"]),
        (["tunnel", "--control.gait", "b"], ["b11bl0"]),
        (["drive", "--control", "pa"], []),
        (["drive", "--controller", "pa"], ["paper"]),
        (["drive", "--bu"], ["--bus"]),
        (["nothing", "--a"], []),
        (["ben"], ["bench"]),
        (["zer"], []),
        (["bench", "w"], ["wall"]),
        (["setup", "z"], ["zero"]),
        (["log", "re"], ["recover", "replay"]),
        (["setup", "--on"], ["--only"]),
        (["setup", "jog", "--on"], []),
        (["setup", "jog", "--jo"], ["--joint"]),
    ],
)
def test_bash_offers(script: Path, words: list[str], expected: list[str]) -> None:
    found = offered(script, *words)
    assert set(expected) <= set(found)
    assert all(word.startswith(words[-1]) for word in found)
    assert expected or not found


@pytest.mark.smoke
def test_every_flag_of_a_command_is_offered(script: Path) -> None:
    flags = offered(script, "antenna", "--")
    assert {"--seed", "--out", "--wire", "--wanted-n-mm-per-deg", "--help-all"} <= set(flags)
    assert len(flags) == len(set(flags))


def test_fish_gets_a_line_for_each_flag(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--completion", "fish"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert all(line.startswith("complete -c antennate ") for line in lines)
    wire = "seen_subcommand_from antenna' -l wire -xa 'stainless_302 music_wire"
    assert sum(wire in line for line in lines) == 1
    for name in ("", " -l robot"):
        robot = f"seen_subcommand_from robot'{name} -xa 'scuttle "
        assert sum(robot in line for line in lines) == 1


def test_zsh_reads_the_script_of_bash(script: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--completion", "zsh"]) == 0
    assert capsys.readouterr().out.endswith(script.read_text())
