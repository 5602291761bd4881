"""`setup`, `zero`, `jog` and `teleop` as processes: keys from a terminal, scripts, and no input."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from first_hour import ANTENNATE, OrderedTwin

from antennate.messages import command_words

pytestmark = pytest.mark.ci

SMALL = ["--robot.links", "2"]
"""Seven servos: one yaw joint, four legs, two antennae."""


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OrderedTwin]:
    words = ["twin", *SMALL, "--scene", "flat", "--orders", "-"]
    with OrderedTwin(words, tmp_path_factory.mktemp("twin")) as made:
        yield made


def ran(words: list[str], folder: Path, said: str = "") -> subprocess.CompletedProcess[str]:
    """A command whose standard input holds this and no more."""
    return subprocess.run(
        [*ANTENNATE, *words], input=said, capture_output=True, text=True, check=False, cwd=folder
    )


@pytest.mark.parametrize("command", ["setup", "zero", "teleop"])
def test_without_input_it_ends_with_one_plain_line(
    command: str, twin: OrderedTwin, tmp_path: Path
) -> None:
    ports = ["--bus", twin.paths["bus"]] if command != "setup" else ["--among", "none/*"]
    ports += ["--esp32", twin.paths["esp32"]] if command == "teleop" else []
    run = ran([*command_words(command).split(), *ports, *SMALL], tmp_path)
    assert run.returncode == 2
    *_, last = run.stderr.strip().splitlines()
    assert re.match(
        rf"antennate {command_words(command)}: error: expected .*found the end of the input", last
    )
    assert "Traceback" not in run.stderr
    assert not (tmp_path / "robot.toml").exists()


@pytest.mark.parametrize("of_the_file", [False, True])
def test_a_pattern_of_ports_is_refused_where_both_are_known(
    of_the_file: bool, tmp_path: Path
) -> None:
    if of_the_file:
        (tmp_path / "robot.toml").write_text('[ports]\nbus = "one"\nesp32 = "two"\n')
    known = [] if of_the_file else ["--bus", "one", "--esp32", "two"]
    run = ran(["setup", *known, "--among", "ports/*"], tmp_path)
    assert run.returncode == 2
    *said, line = run.stderr.splitlines()
    assert len(said) == of_the_file  # that the file is read
    assert "--among: expected a port that is to be found" in line
    assert "bus one and esp32 two" in line


@pytest.mark.slow
def test_zero_takes_a_script_and_keeps_what_else_is_in_the_file(
    twin: OrderedTwin, tmp_path: Path
) -> None:
    file = tmp_path / "robot.toml"
    file.write_text(f'# mine\n[ports]\nbus = "{twin.paths["bus"]}"\n[robot]\nlinks = 2\n')
    twin.order("push all=0deg")
    time.sleep(0.8)
    run = ran(["setup", "zero"], tmp_path, "\nr\n")
    assert run.returncode == 0, run.stderr
    text = file.read_text()
    assert text.startswith("# mine\n[ports]\n")
    robot = tomllib.loads(text)["robot"]
    assert [abs(zero - 2048) <= 1 for zero in robot["yaw"]["zeros"]] == [True]
    assert robot["legs"]["directions"] == [1, 1, 1, 1]
    assert "yaw 2048  legs" in run.stderr
    assert run.stdout.count("direction not measured") == 7
    assert len(tomllib.loads(text)["zeros"]["missing"]) == 7


@pytest.mark.ci
def test_zero_without_a_file_keeps_what_was_said_of_the_robot(
    twin: OrderedTwin, tmp_path: Path
) -> None:
    (tmp_path / "mine.toml").write_text(
        "links = 2\nbody_radius = 0.018\n[antenna]\nranges = [1.2, 1.3, 1.3, 1.3, 1.3, 1.3]\n"
        '[imu]\nkind = "head"\n'
    )
    words = ["--bus", twin.paths["bus"], "--robot", "mine.toml", "--robot.legs.fastest", "5"]
    twin.order("push all=0deg")
    time.sleep(0.8)
    run = ran(["setup", "zero", "--keep-directions", *words], tmp_path, "\n")
    assert run.returncode == 0, run.stderr
    made = tomllib.loads((tmp_path / "robot.toml").read_text())["robot"]
    assert (made["links"], made["body_radius"], made["legs"]["fastest"]) == (2, 0.018, 5)
    assert len(made["legs"]["zeros"]) == 4
    assert made["antenna"] == {"ranges": [1.2, 1.3, 1.3, 1.3, 1.3, 1.3]}
    assert ("base" not in made, made["imu"]) == (True, {"kind": "head"})


def test_jog_takes_keys_from_a_terminal_and_gives_it_back(twin: OrderedTwin) -> None:
    master, slave = pty.openpty()
    words = ["setup", "jog", "--bus", twin.paths["bus"], *SMALL, "--joint", "antenna_l_base"]
    with subprocess.Popen(
        [*ANTENNATE, *words], stdin=slave, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        os.close(slave)
        assert process.stderr is not None
        text = process.stderr.readline().decode()
        for key in (b"+", b"\x1b[C", b"+", b"+"):
            os.write(master, key)
        end = time.monotonic() + 30.0
        while "goal   +11.5 deg" not in text or not re.search(r"base:   \+1[01]\.\d deg", text):
            assert time.monotonic() < end, text
            text = process.stderr.readline().decode()
        os.write(master, b"q")
        assert process.wait(30) == 0
        assert process.stderr.read().decode().endswith("torque is off, verified\n")
    os.close(master)


@pytest.mark.slow
def test_jog_takes_a_script_and_refuses_a_joint_that_is_none(
    twin: OrderedTwin, tmp_path: Path
) -> None:
    bus = ["--bus", twin.paths["bus"], *SMALL]
    run = ran(["setup", "jog", *bus, "--joint", "antenna_r_base"], tmp_path, "+++")
    assert run.returncode == 0
    assert re.search(r"goal    \+8\.6 deg", run.stderr)
    run = ran(["setup", "jog", *bus, "--joint", "yaw2"], tmp_path)
    assert run.returncode == 2
    assert "expected a joint of the robot (did you mean yaw1?), one of yaw1, leg_l0" in run.stderr
