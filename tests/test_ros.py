"""Topics of ROS 2 live, read and written by a client that is not ours, on this computer alone."""

from __future__ import annotations

import json
import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from subprocess import PIPE
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.topic import Topic
from ros_peer import JointState, String, TFMessage, reader, rubbish, state, taken
from scipy.spatial.transform import Rotation
from stated import STATED
from test_drive_cases import was_late
from test_drive_processes import NO_SERVO, twin
from view_rig import ANTENNATE, PATIENCE, Shown, share_cores, shown

from antennate.errors import BadInputError
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.sim.export.urdf import to_urdf
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick
from antennate.telemetry.view.channel import HEADER, TICK, Channel
from antennate.telemetry.view.goals import ReceivedGoals
from antennate.telemetry.view.process import Place
from antennate.telemetry.view.ros import RosSink
from antennate.types import Contact, Maneuver

ROBOT = RobotSpec()
NAMES = ROBOT.joint_names
PEER = [sys.executable, str(Path(__file__).with_name("ros_peer.py"))]
DOMAIN = 100 + os.getpid() % 100
"""A domain of this process."""
SECONDS = 20.0


def until(found: Callable[[], Any]) -> Any:
    """What is found in the end."""
    end = time.monotonic() + SECONDS
    while not (it := found()):
        assert time.monotonic() < end
        time.sleep(0.01)
    return it


def tick(number: int, positions: Sequence[float]) -> Tick:
    return Tick(
        number=number,
        t=0.01 * number,
        now=0.01 * number,
        counts=(1850.0, 1840.0),
        reading=(1850.0, 1840.0),
        level=(0.0, 0.0),
        contact=(Contact.FREE, Contact.FREE),
        maneuver=Maneuver.FORWARD,
        phase=0.0,
        angles=(0.0,) * len(NAMES),
        positions=tuple(positions),
    )


@pytest.fixture
def live() -> Iterator[tuple[RosSink, ReceivedGoals, Any]]:
    """A sink that accepts goals, the drive's end, and a participant of somebody else."""
    near, far = map(Channel, Channel.pair())
    sink = RosSink(Place(DOMAIN, accept=True), far, lambda line: None)
    header = Header(controller="closed", params=ControlParams(), robot=ROBOT, start=7 * 10**9)
    sink.take(HEADER, header.pack())
    yield sink, ReceivedGoals(near), DomainParticipant(DOMAIN)
    near.close()
    far.close()


def test_joints_and_links_come_as_messages_of_ros_2(
    live: tuple[RosSink, ReceivedGoals, Any],
) -> None:
    """Each link is where the URDF has it: at the joint's origin, turned about its axis."""
    sink, _, other = live
    joints = reader(other, "rt/joint_states", JointState)
    tf = reader(other, "rt/tf", TFMessage)
    positions = np.linspace(-0.3, 0.3, len(NAMES)).tolist()
    states, moved = list[Any](), list[Any]()

    def both() -> bool:
        sink.take(TICK, tick(150, positions).pack())
        states.extend(taken(joints))
        moved.extend(taken(tf))
        return bool(states and moved)

    until(both)
    message = states[-1]
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (8, 500_000_000)
    assert (tuple(message.name), list(message.position)) == (NAMES, positions)
    found = {each.child_frame_id: each for each in moved[-1].transforms}
    angles = dict(zip(NAMES, positions, strict=True))
    urdf = ElementTree.fromstring(to_urdf(ROBOT, "robot"))
    seen = 0
    for joint in urdf.findall("joint"):
        if (name := joint.get("name")) not in angles:
            continue
        each = found[joint.find("child").get("link")]  # type: ignore[union-attr,index]
        assert each.header.frame_id == joint.find("parent").get("link")  # type: ignore[union-attr]
        origin, axis = (
            np.array(joint.find(what).get(key).split(), float)  # type: ignore[union-attr]
            for what, key in (("origin", "xyz"), ("axis", "xyz"))
        )
        rpy = joint.find("origin").get("rpy", "0 0 0").split()  # type: ignore[union-attr]
        place, turn = each.transform.translation, each.transform.rotation
        np.testing.assert_allclose([place.x, place.y, place.z], origin, atol=1e-5)
        at_zero = Rotation.from_euler("xyz", np.array(rpy, float))
        turned = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])
        wanted = at_zero * Rotation.from_rotvec(axis * angles[str(name)])
        assert (turned * wanted.inv()).magnitude() < 1e-5
        seen += 1
    assert seen == len(NAMES)


def test_a_listener_that_comes_late_gets_the_configuration(
    live: tuple[RosSink, ReceivedGoals, Any],
) -> None:
    source = reader(live[2], "rt/config", String, Policy.Durability.TransientLocal)
    message = until(lambda: taken(source))[-1]
    assert json.loads(message.data)["controller"] == "closed"


def test_goals_of_this_robot_are_taken_and_rubbish_is_counted(
    live: tuple[RosSink, ReceivedGoals, Any],
) -> None:
    sink, goals, other = live
    writer = DataWriter(other, Topic(other, "rt/joint_goals", JointState))
    limits = dict(zip(NAMES, ROBOT.limits, strict=True))
    beyond = state(NAMES, [limits[n] + 0.1 if n == "yaw1" else 0.0 for n in NAMES])
    endless = state(NAMES, [math.nan if n == "yaw1" else 0.0 for n in NAMES])
    twice = state([NAMES[0], *NAMES[:-1]], [0.0] * len(NAMES))
    for number, message in enumerate([*rubbish(), beyond, endless, twice], 1):

        def refused(message: Any = message, number: int = number) -> bool:
            if goals.counts["refused"] < number:
                writer.write(message)
                time.sleep(0.02)
            sink.draw(0.0)
            assert goals.newest() is None
            return goals.counts["refused"] >= number

        until(refused)
    assert goals.counts["taken"] == 0
    angles = np.linspace(-0.2, 0.2, len(NAMES)).tolist()

    def came() -> Any:
        writer.write(state(NAMES[::-1], angles[::-1]))
        time.sleep(0.02)
        sink.draw(0.0)
        return goals.newest()

    found, age = until(came)
    assert list(found) == angles
    assert 0 <= age < 1


def test_a_domain_without_room_is_told() -> None:
    """Its ports are those of the standard (DDSI-RTPS 9.6.1.1), two a participant."""
    domain = 99
    with ExitStack() as stack:
        for port in range(7400 + 250 * domain + 10, 7400 + 250 * domain + 10 + 2 * 33, 2):
            taken = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            taken.bind(("", port))
        near, far = Channel.pair()
        stack.enter_context(near)
        channel = Channel(stack.enter_context(far))
        with pytest.raises(BadInputError, match="--ros-domain"):
            RosSink(Place(domain), channel, lambda line: None)


@contextmanager
def driven(folder: Path, *words: str) -> Iterator[tuple[Shown, Callable[[], dict[str, Any]]]]:
    """A drive with its topics before a twin: the command, and its result once it has ended."""
    own = ["--no-touch-check", *STATED, "--ros", "--ros-domain", str(DOMAIN), "--out", "run"]
    with twin() as (ports, _), shown("drive", *ports, *own, *words, folder=folder) as command:
        command.said("ros: topics in domain")

        def result() -> dict[str, Any]:
            assert command.process.wait(PATIENCE) == 0, command.lines
            return json.loads((folder / "run" / "result.json").read_text())

        yield command, result


@contextmanager
def peer(*words: str) -> Iterator[subprocess.Popen[str]]:
    """A program of somebody else."""
    with subprocess.Popen([*PEER, str(DOMAIN), *words], stdout=PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.ci
def test_a_client_reads_joints_a_hundred_times_a_second(tmp_path: Path) -> None:
    """They are those of the log. A listener that stands still costs nothing, goals move nothing."""
    with driven(tmp_path, "--dry-run", "9") as (command, result):
        share_cores(command)
        with (
            peer("listen", "60") as stuck,
            peer("goals", "60", "0.1", *NAMES),
            peer("listen", "4") as listener,
        ):
            time.sleep(1.0)
            stuck.send_signal(signal.SIGSTOP)
            lines = [json.loads(line) for line in listener.stdout or ()]
            end = result()
    assert (end["commands_sent"], end["unlogged"]) == (0, 0)
    assert "goals" not in end
    with LogReader(tmp_path / "run" / "drive.mcap") as log:
        found = [(1e-9 * log.header.start + one.now, one.positions) for one in log]
    stamps, angles = np.array([t for t, _ in found]), [a for _, a in found]
    logged = [int(np.argmin(np.abs(stamps - t))) for t, *_ in lines]
    assert logged[-1] - logged[0] > 200
    assert len(lines) >= 0.95 * (logged[-1] - logged[0] + 1)
    for number, (t, _, names, positions) in zip(logged, lines, strict=True):
        assert t == pytest.approx(stamps[number], abs=1e-5)
        assert tuple(names) == NAMES
        np.testing.assert_array_equal(positions, angles[number])


@pytest.mark.ci
def test_a_robot_walks_by_goals_and_holds_without_them(tmp_path: Path) -> None:
    """Rubbish between them is counted."""
    words = ["--arm", "--accept", "--dry-run", "1", "--duration", "18", *NO_SERVO]
    for number in range(3):
        (folder := tmp_path / str(number)).mkdir()
        with (
            driven(folder, *words) as (command, _),
            peer("goals", "16", "0.1", *NAMES),
            peer("rubbish", "16"),
        ):
            code = command.process.wait(PATIENCE)
        end = json.loads((folder / "run" / "result.json").read_text())
        if not was_late(end):
            break
    assert code == 0, end
    with LogReader(folder / "run" / "drive.mcap") as log:
        ticks = [one for one in log if one.sent]
    walked = [one for one in ticks if one.maneuver == Maneuver.FORWARD]
    assert end["controller"] == "goals"
    assert end["goals"]["refused"] > 100
    assert end["torque_off"] is True
    assert walked
    np.testing.assert_allclose(walked[-1].angles, 0.1)
    assert ticks[-1].maneuver == Maneuver.HOLD
    np.testing.assert_allclose(ticks[-1].angles, 0.1)


@pytest.mark.ci
@pytest.mark.parametrize(
    ("words", "domain", "told"),
    [
        (
            ["tunnel", "--trials", "1", "--ros"],
            "x",
            "ROS_DOMAIN_ID: expected a number from 0 to 232",
        ),
        (["tunnel", "--trials", "1", "--ros"], "233", "ROS_DOMAIN_ID: expected a number"),
        (["tunnel", "--trials", "1", "--ros", "--ros-domain", "233"], "", "--ros-domain: "),
        (["drive", "--accept"], "", "--accept: expected --ros beside it"),
        (["drive", "--ros", "--accept", "--controller", "open"], "", "--controller: expected"),
        (["drive", "teleop", "--ros", "--accept"], "", "--accept"),
    ],
)
def test_bad_words_are_told_in_one_line(
    words: list[str], domain: str, told: str, tmp_path: Path
) -> None:
    run = subprocess.run(
        [*ANTENNATE, *words],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"ROS_DOMAIN_ID": domain},
        timeout=PATIENCE,
        check=False,
    )
    assert run.returncode == 2
    (line,) = run.stderr.splitlines()
    assert told in line


@pytest.mark.ci
def test_a_simulation_publishes_its_joints(tmp_path: Path) -> None:
    words = "tunnel --controllers open --trials 1 --scene flat --time-limit 60 --ros --ros-domain"
    with shown(*words.split(), str(DOMAIN), folder=tmp_path) as command:
        command.said("ros: topics in domain")
        with peer("listen", "3") as listener:
            lines = [json.loads(line) for line in listener.stdout or ()]
    assert len(lines) > 50
    stamps = np.array([line[0] for line in lines])
    assert np.median(np.diff(stamps)) == pytest.approx(0.01, abs=1e-6)
    assert set(lines[-1][2]) == set(NAMES)
    assert np.ptp([line[3] for line in lines], axis=0).max() > 0.5  # legs turn
