"""Robots as data: other numbers of links and hinges walk and are driven, bad files refused."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from driven_rig import driven, simulated_alike
from twin_rig import on_twin, simulated

from antennate.cli import main
from antennate.cli.terminal import BAD_INPUT
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.config import RobotFile
from antennate.hardware.joints import Joints
from antennate.params.base import read_file
from antennate.params.scene import PhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.spec import ROBOTS, RobotSpec
from antennate.sim.world import PREFIX, World, compile_world
from antennate.studies.formats import to_toml
from antennate.testing import check_robot
from dynamixel_bus.models import MODELS

EXAMPLES = Path(__file__).parent.parent / "examples"


def robot_of(links: int, hinges: int) -> RobotSpec:
    coils = tuple(np.linspace(3.0, 9.0, hinges).tolist())
    return RobotSpec(links=links, mass=links / 3, antenna=AntennaSpec(active_coils=coils))


SIZES = [(4, 4), (8, 10)]
"""Fewer links and hinges than ours, and more."""
DRIVEN = [
    *(robot_of(*size) for size in SIZES),
    RobotSpec.model_validate({"pitch": {"kind": "actuated"}}),
    RobotSpec.named("scuttle3d"),
]


@pytest.mark.parametrize(("links", "hinges"), SIZES)
def test_a_robot_of_any_size_stands_and_obeys(links: int, hinges: int) -> None:
    robot = robot_of(links, hinges)
    check_robot(robot)
    model = compile_world(PhysicsParams(), robot)
    joints = [model.joint(i).name for i in range(model.njnt)]
    assert sum("hinge" in name for name in joints) == 2 * hinges
    assert (model.nu, len(robot.ids)) == (3 * links + 1, 3 * links + 1)


@pytest.mark.parametrize(("links", "hinges"), SIZES)
def test_a_robot_of_any_size_is_decided_alike_in_simulation_and_through_bytes(
    links: int, hinges: int
) -> None:
    config = TunnelConfig(time_limit=1.0, robot=robot_of(links, hinges))
    assert on_twin(config, "closed", 0) == simulated(config, "closed", 0)


@pytest.mark.parametrize("robot", DRIVEN, ids=["4", "8", "pitch", "scuttle3d"])
def test_a_robot_of_any_size_is_driven_as_in_simulation(robot: RobotSpec) -> None:
    config = TunnelConfig(robot=robot)
    one = driven(config, "closed", 0, 60)
    other = simulated_alike(config, "closed", 0, one.start, 60)
    assert len(one.walk.maneuvers) == 60
    assert one.walk.maneuvers == other.maneuvers
    assert one.walk.commands == other.commands
    assert one.walk.readings == other.readings


@pytest.mark.ci
@pytest.mark.parametrize(("links", "hinges"), SIZES)
def test_a_robot_of_any_size_goes_through_the_commands(
    links: int, hinges: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(to_toml(robot_of(links, hinges)))
    out = ["--robot", str(file), "--no-figures", "--workers", "1", "--out"]
    short = ["--trials", "1", "--time-limit", "0.5", "--controllers", "closed"]
    assert main(["tunnel", *short, *out, str(tmp_path / "tunnel")]) == 0
    short = ["--cycles", "2", "--settling-cycles", "0", "--sweep-points", "2"]
    assert main(["gait", *short, *out, str(tmp_path / "gait")]) == 0
    assert f"links = {links}" in (tmp_path / "gait" / "config.toml").read_text()


@pytest.mark.parametrize("name", ["eight_links.toml", "four_hinges.toml"])
def test_the_examples_are_robots_and_come_back_from_toml(name: str, tmp_path: Path) -> None:
    robot = RobotSpec.named(EXAMPLES / name)
    assert robot != RobotSpec()
    check_robot(robot)
    (tmp_path / "again.toml").write_text(to_toml(robot))
    assert RobotSpec.named("again.toml", tmp_path) == robot


def test_ids_and_the_order_of_release_follow_from_the_joints() -> None:
    robot = RobotSpec.model_validate({"links": 3, "pitch": {"kind": "actuated"}})
    assert robot.joint_names[-4:] == ("antenna_l_base", "antenna_r_base", "pitch1", "pitch2")
    assert robot.ids == tuple(range(1, 13))
    assert robot.in_order_of_release == ((9, 10), (1, 2), (3, 4, 5, 6, 7, 8), (11, 12))
    assert set(robot.modes.values()) == {3, 4}
    assert [servo for servo, mode in robot.modes.items() if mode == 4] == [3, 4, 5, 6, 7, 8]
    check_robot(robot)


def test_a_lifting_leg_rises_on_its_own_side_and_does_not_turn_without_end() -> None:
    robot = RobotSpec.model_validate({"links": 3, "legs": {"kind": "lifting"}})
    assert not Joints(robot).turning.size
    world = World(compile_world(PhysicsParams(), robot), robot)
    for name in robot.leg_names:
        foot = world.data.geom(PREFIX + name)
        before = float(foot.xpos[2])
        world.data.joint(PREFIX + name).qpos[0] = 0.3
        mujoco.mj_kinematics(world.model, world.data)
        lateral = robot.width / 2 - robot.leg_width / 2 - robot.body_radius
        drop = robot.leg_eccentricity
        rise = lateral * math.sin(0.3) + drop * (1 - math.cos(0.3))
        assert float(foot.xpos[2]) - before == pytest.approx(rise, abs=1e-9)


GAIN = "servos.xc430_w240.gain_divisor"


def interval(low: float, high: float, name: str = GAIN) -> str:
    """A table [[fitted]]; the gain divisor of a new robot is 128 (data sheet)."""
    return f'[[fitted]]\nname = "{name}"\nlow = {low}\nhigh = {high}\n'


BAD = [
    (interval(0.0, 130.0), f"fitted: {GAIN}: expected low above 0, found 0"),
    (interval(-5.0, 130.0), f"fitted: {GAIN}: expected low above 0, found -5"),
    (interval(130.0, 126.0), f"fitted: {GAIN}: expected low of at most high, found 130 and 126"),
    (interval(100.0, 110.0), f"fitted: {GAIN}: expected its value within 100 to 110, found 128"),
    (interval(126.0, 130.0) * 2, f"fitted: expected each name once, found {GAIN} more than once"),
    (
        interval(0.0, 1.0, "servos.ax12.friction"),
        "fitted: expected names of numbers of this robot, found 'servos.ax12.friction'",
    ),
    (
        interval(0.0, 0.1, "yaw.backlash[5]"),
        "fitted: expected names of numbers of this robot, found 'yaw.backlash[5]'",
    ),
    ("[legs]\nids = [6, 7, 8]", "legs.ids: expected one for each of the 12 joints, found 3"),
    ("[yaw]\nids = [1, 2, 3, 4, 4]", "ids: expected each once, found 4 more than once"),
    ("[yaw]\ndirections = [1, -1]", "yaw.directions: expected one for each of the 5 joints"),
    ("[antenna]\nactive_coils = []", "antenna.active_coils: expected at least 1 value"),
    ("links = 1", "links: expected at least 2, or 1 of a bench (legs.kind none), found 1"),
    ("links = 0", "links: expected a number of at least 1, found 0"),
    ("links = 'six'", "links: expected a whole number, found 'six'"),
    ("lynks = 8", "lynks: expected a known key (did you mean links?)"),
    (
        "[yaw]\nservo = 'ax12'",
        "yaw.servo: expected one of xc430_w240, xl330_m288, xl430_w250, xl330_m077, ",
    ),
    (
        "[yaw]\nservo = 'xl320'",
        "yaw.servo: expected a servo of the X series, found xl320: the XL-320 has another control",
    ),
    ("[antennae]\nfastest = 11.0", "antennae.fastest"),
    ("links =", "expected TOML"),
]


@pytest.mark.parametrize("command", ["tunnel", "gait", "drive", "doctor", "twin"])
@pytest.mark.parametrize(("text", "said"), BAD)
def test_a_bad_robot_file_is_refused_in_one_line(
    text: str, said: str, command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(text)
    assert main([command, "--robot", str(file)]) == BAD_INPUT
    told = capsys.readouterr().err
    assert f"{file}: {said}" in told
    assert told.count("\n") == 1


@pytest.mark.parametrize("name", MODELS)
def test_a_joint_has_any_model_that_the_bus_speaks_with(name: str) -> None:
    """With the numbers of its file, which a run writes down too; another's are written changed."""
    key = name.replace("-", "_")
    robot = RobotSpec.model_validate({"antennae": {"servo": key, "fastest": 1.0}})
    servo = robot.servo_of(robot.antennae)
    rating = MODELS[name].rating
    assert (servo.product, servo.model_number) == (MODELS[name].name, MODELS[name].number)
    assert (servo.stall_torque, servo.no_load_speed) == (rating.stall_torque, rating.no_load_speed)
    assert (servo.gain_divisor, servo.armature) == (rating.gain_divisor, rating.armature)
    assert servo.p_gain == MODELS[name]["position_p_gain"].default
    written = robot.model_dump()["servos"]
    assert set(written) == {"xc430_w240", "xl330_m288", "xl430_w250", key}
    slow = {"xm540_w270": {"friction": 0.2}}
    changed = RobotSpec.model_validate({"servos": slow})
    again = RobotSpec.model_validate(changed.model_dump())
    assert again == changed
    assert again.servos.xm540_w270.friction == 0.2
    assert again.servos.xm540_w270.stall_torque == 10.0  # its datasheet at 11.1 V


def test_a_configuration_names_its_robot_and_changes_it(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("links = 4\n[yaw]\nlimit = 0.4\n")
    config = tmp_path / "config.toml"
    config.write_text('robot = "mine.toml"\n')
    assert read_file(config, TunnelConfig).robot == RobotSpec.named("mine.toml", tmp_path)
    config.write_text('[robot]\nbase = "mine.toml"\nmass = 1.5\n[robot.yaw]\nfastest = 2.0\n')
    found = read_file(config, TunnelConfig).robot
    assert (found.links, found.mass, found.yaw.limit, found.yaw.fastest) == (4, 1.5, 0.4, 2.0)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("other", ROBOTS)
def test_the_robot_of_a_flag_replaces_the_one_of_the_file(
    name: str, other: str, tmp_path: Path
) -> None:
    """As a whole: nothing is left of the other one, also of one with an inertial sensor."""
    config = tmp_path / "config.toml"
    config.write_text(f'robot = "{other}"\n')
    words = [name, "--config", str(config), "--out", str(tmp_path / "run")]
    assert main(["robot", *words]) == 0
    made = read_file(tmp_path / "run" / "config.toml", RobotFile)
    assert made.robot == RobotSpec.named(name)


@pytest.mark.parametrize("other", ["scuttle", RobotSpec, None])
def test_what_is_no_robot_is_said_so(other: object) -> None:
    with pytest.raises(AssertionError, match="expected a RobotSpec, found"):
        check_robot(other)  # type: ignore[arg-type]
