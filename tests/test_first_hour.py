"""docs/drive.md, run from its box of servos on, until the robot has crossed the tunnel."""

from __future__ import annotations

import json
import time
import tomllib
from pathlib import Path

import pytest
from first_hour import Command, OrderedTwin, connect_each, move_each, plug_in
from pages import blocks, commands

from antennate.robots.spec import RobotSpec

PAGE, BEGIN = "drive.md", "\n## From a box of servos\n"
NAMES = RobotSpec().joint_names
STEPS = ["twin", "setup", "setup zero", "doctor", "drive", "setup jog", "drive teleop"]


def name(words: list[str]) -> str:
    """A command's name, and that of its action if it has one."""
    return " ".join(word for word in words[:2] if not word.startswith("-"))


def assembled(folder: Path) -> dict:
    """The robot as it is built, in the page's file."""
    (text,) = (block.text for block in blocks(PAGE) if block.kind == "toml")
    (folder / "assembled.toml").write_text(text)
    return tomllib.loads(text)


def links(folder: Path, twin: OrderedTwin) -> dict[str, tuple[Path, str]]:
    """Links to the twin's ports, as `plug_in` takes them."""
    (folder / "ports").mkdir()
    made = {name: folder / "ports" / name for name in ("bus", "esp32")}
    for name, link in made.items():
        link.symlink_to(twin.paths[name])
    return {
        "adapter of the servo bus": (made["bus"], twin.paths["bus"]),
        "antenna board": (made["esp32"], twin.paths["esp32"]),
    }


@pytest.mark.slow
def test_a_box_of_servos_becomes_a_robot_that_crosses_the_tunnel(tmp_path: Path) -> None:
    page = {name(words): words for words in commands(PAGE, BEGIN)}
    truth = assembled(tmp_path)
    assert list(page) == STEPS
    with OrderedTwin(page["twin"], tmp_path) as twin:
        setup = Command(page["setup"], tmp_path)
        plug_in(setup, links(tmp_path, twin))
        connect_each(setup, twin.order, NAMES)
        assert setup.end() == 0, setup.text
        assert setup.output.count("answers") == 19

        zero = Command(page["setup zero"], tmp_path)
        move_each(zero, twin.order, NAMES)
        assert zero.end() == 0, zero.text
        made = tomllib.loads((tmp_path / "robot.toml").read_text())
        for group, there in truth.items():
            assert made["robot"][group]["directions"] == there["directions"]
            measured = zip(made["robot"][group]["zeros"], there["zeros"], strict=True)
            assert all(abs(one - other) <= 1 for one, other in measured)

        time.sleep(13.0)  # the touches that the twin plans for whoever began last, `zero`, are over
        doctor = Command(page["doctor"], tmp_path)
        assert doctor.end() == 0, doctor.output
        said = " ".join(doctor.output.split())
        assert "no check is bad, 2 of 44 warn; numbers assumed: 2" in said, said
        assert "measured on 20" in said, said

        time.sleep(3.0)  # the twin takes who comes later for a new client
        drive = Command([*page["drive"], "--duration", "120", "--out", "run"], tmp_path)
        code = drive.end(240.0)
        result = json.loads((tmp_path / "run" / "result.json").read_text())
        assert result["torque_off"] is True, drive.text[-2000:]
        assert code == 0, (result["why"], drive.text[-2000:])
    assert result["ended"] == "arrival"
    assert result["worst_state"] in ("OK", "DEGRADED", "HOLD")
    assert "the head passed the exit" in twin.said
