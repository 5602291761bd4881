"""docs/bench.md as it stands, by processes; and a bench where robots that walk are wanted."""

from __future__ import annotations

import json
import re
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
from first_hour import Command, OrderedTwin, connect_each, move_each
from pages import Script

from antennate.cli import main
from antennate.cli.terminal import BAD_INPUT
from antennate.control.registry import make_controller
from antennate.errors import BadInputError, ConfigError
from antennate.hardware.config import DoctorConfig
from antennate.params.gaits import GaitParams
from antennate.robots.parts import bill
from antennate.robots.spec import RobotSpec
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import draw_trial, scene_of
from antennate.twin.config import TwinConfig, watched
from antennate.types import JointCommand

BASE = "antenna_l_base"


def act(command: Command, script: Script) -> None:
    """What the hands of the person do, by what is asked."""
    assert script.twin is not None
    order = script.twin.order
    if command.words[0] == "record":
        for _ in range(6 * 5):
            mark = command.until(r"hold at (\d+) mm")[1]
            order(f"touch left:{mark}mm")
            time.sleep(0.3)  # the bend has to arrive before it is confirmed
            command.type()
        order("touch left:0mm")
    elif command.words[:2] == ["setup", "zero"]:
        move_each(command, order, [BASE])
        with pytest.raises(AssertionError, match="with legs, found a bench on its clamp"):
            order("hang")  # the twin says why it does not
    elif command.words[:2] == ["setup", "jog"]:
        command.until(rf"{BASE}: ")
        command.type("++q")
    else:
        connect_each(command, order, [BASE])


@pytest.mark.ci
def test_a_new_servo_becomes_a_calibrated_antenna_by_the_commands_of_the_page(
    tmp_path: Path,
) -> None:
    with Script("bench.md", tmp_path, {"setup": act, "record": act}) as script:
        script.run()
    made = tomllib.loads((tmp_path / "robot.toml").read_text())["robot"]
    assert made["base"] == "bench"
    assert made["antennae"]["directions"] == [-1]  # as the twin was told
    assert abs(made["antennae"]["zeros"][0] - 2090) <= 1
    assert made["antennae"]["ids"] == [1]
    assert "left antenna" in script.said
    assert "hold the antenna at its mounting angle; then Enter" in script.said
    assert "The bench may be moved" in script.said
    assert not any(word in script.said for word in ("lithium", "robot may", "mid-stance"))
    assert "it takes 3 or more" not in script.said  # pushes for an interval
    assert re.search(r"left +[\d.]+ ± +[\d.]+ +[\d.]+ Hz", script.said)  # no right antenna
    assert not any(f"right {what}" in script.said for what in ("antenna", "noise", "calibration"))
    curve = json.loads((tmp_path / "left" / "calibration.json").read_text())
    assert curve["polarity"] == -1  # resistance rises with the bend, the fixed one leads to ground


@pytest.mark.ci
def test_setup_and_doctor_take_a_bench_by_its_name_and_record_needs_none(tmp_path: Path) -> None:
    """Before there is a robot.toml, which `setup zero` leaves."""
    with OrderedTwin(["twin", "--robot", "bench", "--orders", "-"], tmp_path) as twin:
        board, bus = ["--esp32", twin.paths["esp32"]], ["--bus", twin.paths["bus"]]
        doctor = Command(["doctor", "--robot", "bench", *board, *bus], tmp_path)
        assert doctor.end() == 2
        assert "antennate setup zero`" in doctor.output  # behind `uv run` if that ran the tests
        jog = Command(["setup", "jog", "--robot", "bench", "--joint", BASE, *bus], tmp_path)
        jog.until(rf"{BASE}: ")
        jog.type("++q")
        assert jog.end() == 0
        assert "torque is off, verified" in jog.text
        words = ["record", "--side", "left", "--duration", "1", "--out", "left.csv", *board]
        record = Command(words, tmp_path)
        assert record.end() == 0
        assert len((tmp_path / "left.csv").read_text().splitlines()) > 50
        zero = Command(["setup", "zero", "--robot", "bench", *bus], tmp_path)
        move_each(zero, twin.order, [BASE])
        assert zero.end() == 0, zero.text
        made = tomllib.loads((tmp_path / "robot.toml").read_text())["robot"]
        assert (made["base"], len(made["antennae"]["zeros"])) == ("bench", 1)
        again = Command(["doctor", *board, *bus], tmp_path)
        assert again.end() == 0, again.output
        assert "right" not in again.output


BENCH = RobotSpec.named("bench")


def test_its_right_channel_is_absent_in_the_frame_and_its_clamp_holds_it() -> None:
    """NaN, never 0; the base follows its goal within the servo's droop, the link stays for 20 s."""
    assert BENCH.joint_names == (BASE,)
    config = TwinConfig(robot=BENCH, seed=5)
    assert config.scene == "flat"
    start = draw_trial(config, scene_of(config), 0, GaitParams(), 0.01)
    body = SimRobot(1, BENCH, 0.01, config.physics.timestep)
    body.load(0, start.world, start.chance)
    head = start.world.head.copy()
    none = np.zeros((1, 0))
    for tick in range(2000):
        goal = 1.2 if tick % 400 < 200 else -1.2
        body.write(JointCommand(none, np.zeros((1, 0, 2)), np.full((1, 1), goal)))
        body.clock.sleep_until(0.01 * (tick + 1))
        if tick % 200 == 199:
            frame = body.read()
            assert frame.counts.shape == (1, 2)
            assert np.isnan(frame.counts[0]).tolist() == [False, True]
            assert frame.positions[0, 0] == pytest.approx(goal, abs=0.01)
    assert not body.failures
    assert np.abs(start.world.head - head).max() < 1e-6


WALKS = [
    *("tunnel", "gait", "geometry", "climb", "dataset", "drive", "drive teleop"),
    "robot --export mjcf",
]


@pytest.mark.parametrize("command", WALKS)
def test_what_walks_a_robot_refuses_a_bench_in_one_line(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*command.split(), "--robot", "bench"]) == BAD_INPUT
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "expected a robot that walks" in err
    assert "found one without legs (legs.kind)" in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["open", "closed", "climb"])
def test_no_controller_is_made_for_a_bench(name: str) -> None:
    with pytest.raises(ConfigError, match=f"walks for the controller '{name}', found one without"):
        make_controller(name, robot=BENCH)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"links": 1}, "links: expected at least 2, or 1 of a bench"),
        ({"legs": {"kind": "none"}}, "links: expected 1 of a bench"),
        ({"antennae": {"kind": "left"}}, "antennae.kind: expected pair or none with legs"),
        (
            {"links": 1, "legs": {"kind": "none"}, "antennae": {"kind": "none"}},
            "antennae.kind: expected left or pair of a bench, found none",
        ),
    ],
)
def test_what_is_neither_robot_nor_bench_is_refused(values: dict, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        RobotSpec(**values)


def test_nothing_is_said_of_a_right_antenna_that_is_not_there() -> None:
    with pytest.raises(ConfigError, match="reach_right: expected none for a robot with one"):
        DoctorConfig(robot=BENCH, reach_right=0.5)
    with pytest.raises(BadInputError, match="expected left, the only antenna, found 'right@2s'"):
        watched(TwinConfig(robot=BENCH, touch=("right@2s",)))


def test_its_bill_is_for_one_antenna() -> None:
    """One strip, resistor and capacitor; as many springs as the antenna has (paper: 1, 2 and 3)."""
    count = {part.item: part.count for part in bill(BENCH)}
    assert (count["flex sensor"], count["resistor"], count["capacitor"]) == (1, 1, 1)
    springs = [count[f"torsion spring of {n} coils"] for n in (3, 6, 9)]
    assert springs == [1, 2, 3]
    assert count["DYNAMIXEL XL330-M288-T"] == 1
    assert not any("leg" in item or "battery" in item for item in count)
