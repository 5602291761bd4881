"""The robot with pitch servos and antennae that rise, before bytes: goals, positions, faults, logs.

Its 26 servos are set up, driven and recorded as the 19 of the planar one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from driven_rig import driven
from setup_rig import Box, Script
from twin_rig import rig

from antennate import simulate
from antennate.cli import main
from antennate.control.loop import run_loop
from antennate.control.registry import CONTROLLERS
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.report import Report, link_heights
from antennate.hardware.joints import CommandError, Joints
from antennate.hardware.setup.servos import Assembly, ServoSetup, joints_of
from antennate.hardware.setup.zeros import Positions, Zeroing
from antennate.params.control import ControlParams
from antennate.params.hardware import SetupParams
from antennate.params.scene import GRAVITY
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.view.player import LogScene
from antennate.twin.config import TwinConfig
from antennate.twin.faults import Faults, read
from antennate.types import AntennaFrame, JointCommand, State
from dynamixel_bus.bus import Bus

ROBOT = RobotSpec.named("scuttle3d")
PITCH, ELEVATION = ROBOT.places("pitch"), ROBOT.places("elevation")
TICK = math.tau / 4096


class Nodding:
    """Stands, raises the head and both antennae, each its own way, and lowers them again."""

    def __init__(self, control: object, robot: RobotSpec, batch: int) -> None:
        self._robot, self._batch, self._ticks = robot, batch, 0
        self.maneuver = np.zeros(batch, dtype=int)
        self.contact = np.zeros((batch, 2), dtype=int)
        self.level = np.zeros((batch, 2))
        self.frames: list[AntennaFrame] = []

    def reset(self, rows: object, phase: float = 0.0) -> None:
        self._ticks = 0

    def step(self, frame: AntennaFrame) -> JointCommand:
        self.frames.append(frame)
        shapes = self._robot.command_shapes(self._batch).items()
        command = JointCommand(**{name: np.zeros(shape) for name, shape in shapes})
        swing = 0.5 - 0.5 * math.cos(math.pi * 0.01 * self._ticks)
        command.pitch[:, 0] = 0.3 * swing
        command.elevation[:] = 0.9 * swing, -0.45 * swing
        self._ticks += 1
        return command


@pytest.fixture(autouse=True)
def nodding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CONTROLLERS.added, "nodding", Nodding)


def test_goals_of_pitch_and_elevation_go_through_bytes() -> None:
    goals = np.array(driven(TunnelConfig(robot=ROBOT), "nodding", 0, 120).walk.goals) - 2048
    pitch, left, right = (goals[-10:, at] for at in (PITCH.start, ELEVATION.start, -1))
    assert pitch.min() > 20
    assert left == pytest.approx(3 * pitch, abs=2.5)
    assert right == pytest.approx(-left / 2, abs=1.5)
    assert not goals[:, PITCH.start + 1 : PITCH.stop].any()


def test_frames_carry_pitch_and_elevation_as_measured() -> None:
    """The servos follow a slow swing within what a load and a loop without integral leave."""
    made = rig(TwinConfig(robot=ROBOT, scene="flat"), "nodding")
    control = made.session.control.controller
    assert isinstance(control, Nodding)
    ticks: list[tuple[np.ndarray, np.ndarray]] = []

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        made.session.orders.arm = made.clock.now() > 0.5
        if made.session.tally.sent:
            goals = [servo.get("goal_position") for servo in made.robot.servos]
            ticks.append((frame.positions[0].copy(), (np.array(goals) - 2048) * TICK))
        return len(ticks) < 260

    run_loop(made.session, made.session.control, made.session.period, go_on)
    made.session.release()
    assert control.frames[-1].positions.shape == (1, 26)
    found, asked = (np.array(each)[20:] for each in zip(*ticks, strict=True))
    for place, most in ((PITCH.start, 0.3), (ELEVATION.start, 0.9), (ELEVATION.start + 1, 0.45)):
        assert np.ptp(asked[:, place]) == pytest.approx(most, rel=0.05)
        assert np.ptp(found[:, place]) == pytest.approx(most, rel=0.2)
        assert np.corrcoef(found[:, place], asked[:, place])[0, 1] > 0.9
    right, left = found[:, ELEVATION.start + 1], found[:, ELEVATION.start]
    assert np.corrcoef(left, right)[0, 1] < -0.9


def faulty(fault: str, duration: float = 3.0, **limits: object) -> Report:
    """How a drive of the swinging robot goes with a fault from 1.5 s on."""
    made = rig(TwinConfig(robot=ROBOT, scene="flat"), "nodding")
    faults = Faults([read(f"{fault}@1.5s")], ROBOT.ids)
    config = DriveConfig(robot=ROBOT, dry_run=0.3, duration=duration, touch_check=False)
    return drive(
        made.session,
        config,
        arm=True,
        on_tick=lambda session, t: faults.apply(made.robot, made.robot.t),
    )


@pytest.mark.ci
@pytest.mark.parametrize("name", ["pitch1", "pitch5", "antenna_l_elevation"])
def test_a_silent_servo_of_the_new_joints_ends_in_a_fault_that_names_it(name: str) -> None:
    servo = ROBOT.ids[ROBOT.joint_names.index(name)]
    report = faulty(f"servo:{servo}=silent")
    assert report.worst == State.FAULT
    assert f"servos do not answer (servo {servo})" in report.why
    assert report.on == [servo]  # it cannot confirm that its torque is off


@pytest.mark.parametrize(
    "name", ["pitch1", pytest.param("antenna_l_elevation", marks=pytest.mark.slow)]
)
def test_a_joint_that_does_not_follow_is_named(name: str) -> None:
    servo = ROBOT.ids[ROBOT.joint_names.index(name)]
    report = faulty(f"servo:{servo}=goal_pwm:0", duration=6.0)
    assert report.worst == State.FAULT
    assert name in report.why
    assert report.on == []


@pytest.mark.parametrize(("links", "share"), [(1, 0.14), (2, 0.54), (3, 1.22)])
def test_links_in_the_air_take_their_share_of_the_stall_torque(links: int, share: float) -> None:
    """Weights at half a pitch, one and a half and so on; figures of docs/robots.md."""
    mass = ROBOT.link_mass + 2 * ROBOT.leg_mass
    torque = mass * GRAVITY * sum((i + 0.5) * ROBOT.link_pitch for i in range(links))
    stall = ROBOT.servos.of(ROBOT.pitch.servo).stall_torque
    assert torque / stall == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize(("name", "servo"), [("pitch", 20), ("elevation", 25)])
def test_a_command_beyond_a_right_angle_is_refused_with_its_servo(name: str, servo: int) -> None:
    shapes = ROBOT.command_shapes().items()
    command = JointCommand(**{part: np.zeros(shape) for part, shape in shapes})
    getattr(command, name)[0, 0] = 1.6
    with pytest.raises(CommandError, match=rf"within 1\.571 rad for servo {servo}, found 1\.6"):
        Joints(ROBOT).ticks(command)


def test_a_box_of_26_new_servos_becomes_the_robot() -> None:
    box = Box(ROBOT)
    assembly = Assembly(
        ServoSetup(box.opener, ROBOT, 0.1, box.wire.now), (), lambda names: None, id
    )
    states = assembly.look()
    steps = [(rf"servo of {name} ", lambda name=name: box.plug(name), "") for name in box.servos]
    assembly.run(Script(steps), states)
    assert [servo for servo, _ in box.found().values()] == list(range(1, 27))
    modes = [servo.get("operating_mode") for servo in box.servos.values()]
    assert modes == [3] * 5 + [4] * 12 + [3] * 9


def test_zeros_and_directions_are_asked_for_by_their_sense() -> None:
    """In somebody's hands: positive is where the antenna rises, and the part behind a joint."""
    box = Box(ROBOT)
    for joint in joints_of(ROBOT):
        box.plug(joint.name)
        ServoSetup(box.opener, ROBOT, 0.02, box.wire.now).set_up(joint, ())
    box.plug_all()
    box.bus.master_baud = ROBOT.baud
    bus = Bus(box.wire, clock=box.wire.now)
    zeroing = Zeroing(ROBOT, SetupParams(), Positions(bus, ROBOT, box.wire.sleep))
    zeroing.zeros(Script([("hold the robot straight", None, "")]))
    signs = [1] * 24 + [1, -1]  # the right servo sits mirrored

    def turned(name: str, sign: int) -> Callable[[], None]:
        servo = box.servos[name]
        return lambda: servo.place(servo.position + 200 * sign)

    senses = {"pitch5": "lift the part behind it", "elevation": "lift the antenna"}
    steps: list[tuple[str, Callable[[], object] | None, str | None]] = [
        (
            rf": {name}: .*{senses.get(name, senses['elevation'] if 'elev' in name else '')}",
            turned(name, sign),
            None,
        )
        for name, sign in zip(ROBOT.joint_names, signs, strict=True)
    ]
    assert zeroing.directions(Script(steps)) == signs


@pytest.mark.parametrize(("pitch", "heights"), [((0.35, 0, 0, 0, 0), 1), ((0, 0.2, 0, 0, 0), 2)])
def test_of_joints_alone_the_robot_is_drawn_on_its_tail_with_its_head_raised(
    pitch: tuple[float, ...], heights: int
) -> None:
    """Links on a line of the slope of the joint: 0.06 m to the first middle, then 0.12 m each."""
    scene = LogScene(Header(controller="open", params=ControlParams(), robot=ROBOT), None)
    angles = np.zeros(26)
    angles[PITCH] = pitch
    tick: Any = SimpleNamespace(positions=tuple(angles.tolist()))
    for _ in range(2):  # what was drawn before changes nothing
        scene.place_joints(tick)
    z = scene.world.link_places()[:, 2]
    axle = ROBOT.leg_radius + ROBOT.leg_eccentricity
    rise = [ROBOT.link_pitch * (0.5 + i) * math.sin(max(pitch)) for i in range(heights)]
    assert z - axle == pytest.approx([*reversed(rise), *[0.0] * (6 - heights)], abs=1e-9)


def test_heights_of_links_told_after_a_drive_are_those_of_the_model() -> None:
    scene = LogScene(Header(controller="open", params=ControlParams(), robot=ROBOT), None)
    angles = np.zeros(26)
    angles[PITCH] = [0.1, -0.6, 0.2, 0.5, 0.15]
    tick: Any = SimpleNamespace(positions=tuple(angles.tolist()))
    scene.place_joints(tick)
    z = scene.world.link_places()[:, 2]
    heights = link_heights(angles[PITCH].tolist(), ROBOT.link_pitch)
    assert heights == pytest.approx(z - z[-1], abs=1e-9)


def test_a_log_names_its_joints_and_is_replayed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "walk.mcap"
    series = simulate("nodding", robot=ROBOT, scene="flat", time_limit=0.5, log=log)
    with LogReader(log) as reader:
        assert reader.header.robot == ROBOT
        ticks = [tick for _, tick in reader.groups() if tick is not None]
    angles = np.array([tick.angles for tick in ticks])
    assert angles.shape == (len(series.t), 26)
    np.testing.assert_allclose(angles[:, ELEVATION], series.elevation, atol=1e-12)
    np.testing.assert_allclose(angles[:, PITCH], series.pitch, atol=1e-12)
    table = tmp_path / "walk.csv"
    assert main(["log", "export", str(log), "--out", str(table)]) == 0
    head = table.read_text().splitlines()[0]
    assert all(name in head for name in ROBOT.joint_names)
    capsys.readouterr()
