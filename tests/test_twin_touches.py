"""Hands on the twin's antennae, one twin for many drives, and one that is asked to end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from test_drive_processes import ANTENNATE
from twin_rig import rig

from antennate.antenna.sensor import counts
from antennate.errors import BadInputError
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.params.safety import TouchCheckParams
from antennate.robots.antenna import AntennaSpec
from antennate.twin.board import TouchStimulus
from antennate.twin.config import TwinConfig, watched
from dynamixel_bus import packets

ANTENNA = AntennaSpec()
REST = float(counts(ANTENNA.sensor, np.array(0.0)))


def reading(flex: float) -> float:
    """Change of a reading [counts] by a flex [rad]."""
    return float(counts(ANTENNA.sensor, np.array(flex))) - REST


def test_a_tip_pushed_a_little_aside_bends_as_the_springs_say() -> None:
    """y = F sum(a^2 / k) and flex = F sum(a / k), a the distance of a hinge from the tip."""
    stiffness = np.array(ANTENNA.hinge_stiffness())
    arms = ANTENNA.length - ANTENNA.link_length * np.arange(len(stiffness))
    under = slice(ANTENNA.sensed_hinges)  # the flex sensor
    flex = 0.010 * (arms / stiffness)[under].sum() / (arms**2 / stiffness).sum()
    touch = TouchStimulus(["left:10mm@0s"], ANTENNA)
    assert touch.change(1.0, begun=0.0) == pytest.approx([reading(flex), 0.0], abs=1.0)


def test_touches_begin_with_each_client_and_last_a_second() -> None:
    touch = TouchStimulus(["left@2s", "right:60deg@4s", "right:0deg@6s"], ANTENNA)
    for begun in (10.0, 50.0):
        for t, left, right in ((1.9, 0, 0), (2.5, 1.0, 0), (3.1, 0, 0), (5.0, 0, np.pi / 3)):
            assert touch.change(begun + t, begun).tolist() == [reading(left), reading(right)]
        assert touch.change(begun + 6.5, begun).tolist() == [0, 0]


def test_right_flex_sensor_feels_its_own_share_of_a_touch() -> None:
    """A bend of 60 degrees is felt as one of 48 by a sensor of 0.8; the left one is as it was."""
    touch = TouchStimulus(["left:60deg@0s", "right:60deg@0s"], ANTENNA, right_gain=0.8)
    felt = [reading(np.pi / 3), reading(0.8 * np.pi / 3)]
    assert touch.change(1.0, begun=0.0).tolist() == felt


def test_twin_that_stands_knows_the_gain_of_its_right_flex_sensor() -> None:
    """Its `--touch` and its orders alike."""
    robot = {"antennae": {"right_gain": 0.8}}
    config = TwinConfig.model_validate({"robot": robot, "touch": ["right:60deg@0s"]})
    for touch in (
        watched(config)[0].touch,
        watched(TwinConfig.model_validate({"robot": robot}))[0].touch,
    ):
        touch.order("right:60deg")
        assert touch.change(1.0, begun=0.0)[1] == reading(0.8 * np.pi / 3)


def test_touches_can_be_ordered_and_the_next_client_finds_none_of_them() -> None:
    touch = TouchStimulus(["left@2s"], ANTENNA)
    assert touch.change(1.0, begun=0.0).tolist() == [0, 0]
    touch.order("left:60deg")
    touch.order("right")
    assert touch.change(1.5, begun=0.0).tolist() == [reading(np.pi / 3), reading(1.0)]
    assert touch.change(2.6, begun=0.0).tolist() == [reading(np.pi / 3), 0]
    touch.order("left:0mm")
    assert touch.change(2.7, begun=0.0).tolist() == [0, 0]
    assert touch.change(22.5, begun=20.0).tolist() == [reading(1.0), 0]


@pytest.mark.parametrize(
    "text", ["", "left:5", "left:5mm", "left:5cm@1s", "up@1s", "left:900mm@1s"]
)
def test_other_orders_are_refused(text: str) -> None:
    with pytest.raises(BadInputError, match="--touch: expected"):
        TouchStimulus([text], ANTENNA)
    with pytest.raises(BadInputError, match="--touch: expected"):
        TouchStimulus([], ANTENNA).order("left@1s")


@pytest.mark.ci
def test_one_twin_serves_many_drives_each_with_its_touches_from_the_same_start() -> None:
    config = TwinConfig(touch=("left@1s", "right@3s"))
    made = rig(config, touch=TouchCheckParams())
    starts = list[list[float]]()
    for _ in range(2):
        again = rig(config, touch=TouchCheckParams())
        made.session.quality, made.session.supervisor = (
            again.session.quality,
            again.session.supervisor,
        )
        made.session.outputs = None
        made.clock.sleep(1.0)  # the time in which another program starts
        made.robot.bus.receive(made.clock.now(), packets.ping(1))
        made.clock.sleep(0.1)
        starts.append([servo.get("present_position") % 4096 for servo in made.robot.servos])
        plan = DriveConfig(dry_run=0.5, duration=1.0, touch=TouchCheckParams(patience=10.0))
        report = drive(made.session, plan, arm=True)
        assert report.refusal == ""
        assert report.walk.time == pytest.approx(1.0, abs=0.3)
    assert starts[0] == starts[1]


def test_an_order_to_touch_a_robot_that_has_walked_puts_it_back_and_is_read() -> None:
    made = rig(TwinConfig())
    before = made.session.board.wait(0.1, made.clock.now)[-1].sample.left
    drive(made.session, DriveConfig(dry_run=0.5, duration=2.0, touch_check=False), arm=True)
    told: list[float] = []
    made.robot.on_return = lambda: told.append(made.clock.now())
    made.robot.order_touch("left:60deg")
    made.clock.sleep(1.0)
    bent = made.session.board.wait(0.1, made.clock.now)[-1].sample.left
    assert len(told) == 1
    assert bent == pytest.approx(before + reading(np.pi / 3), abs=1.0)


@contextmanager
def typing_twin(*words: str) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A twin whose standard input takes orders, and the path of its board."""
    with subprocess.Popen(
        [*ANTENNATE, "twin", "--orders", "-", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        try:
            yield process, json.loads(process.stdout.readline())["esp32"]
        finally:
            process.terminate()


@pytest.mark.ci
def test_the_shipped_twin_takes_typed_touches_and_answers_others(tmp_path_factory) -> None:
    with typing_twin() as (process, board):
        assert process.stdin is not None
        assert process.stderr is not None
        process.stdin.write(b"touch left:20mm\ntouch up\nfault servo:40=silent\n")
        process.stdin.flush()
        said = [process.stderr.readline().decode() for _ in range(3)]
        path = tmp_path_factory.mktemp("record") / "left.csv"
        record = ["record", "--esp32", board, "--duration", "0.3", "--out", str(path)]
        subprocess.run([*ANTENNATE, *record], check=True, capture_output=True)
        rows = [line.split(",") for line in path.read_text().splitlines()[1:]]
    assert said[0] == "touch left:20mm\n"
    assert said[1].startswith("not done: --touch: expected left or right")
    assert said[2].startswith("not done: --fault: expected a servo of 1, 2")
    left, right = (np.median([float(row[i]) for row in rows]) for i in (1, 2))
    assert left < right - 50


PROGRAM = "import sys; from antennate.cli import main; sys.exit(main())"
INT, TERM, HUP = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@pytest.mark.ci
@pytest.mark.parametrize("pair", [(INT, TERM), (TERM, TERM), (HUP, HUP)])
def test_a_twin_ends_in_order_however_often_it_is_asked_to(pair: tuple[int, int]) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "twin"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as twin:
        assert twin.stdout is not None
        assert set(json.loads(twin.stdout.readline())) == {"esp32", "bus"}
        os.kill(twin.pid, signal.SIGSTOP)  # so that both wait for it
        for number in pair:
            os.kill(twin.pid, number)
        os.kill(twin.pid, signal.SIGCONT)
        while twin.poll() is None:
            for number in pair:
                twin.send_signal(number)
            try:
                twin.wait(0.001)
            except subprocess.TimeoutExpired:
                continue
        said = twin.communicate()[1]
    assert twin.returncode == 130
    *_, last, interrupted = said.splitlines()
    assert last.startswith("The twin has ended: ")
    assert "late" in last
    assert interrupted == "antennate twin: interrupted"
    assert "Traceback" not in said
