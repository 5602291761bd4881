"""Antennae that rise and lower: axes and signs, mirrored sides, and what a planar robot keeps."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from antennate import simulate
from antennate.control.gait import Gait
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.spec import ANTENNA_PREFIXES, RobotSpec
from antennate.sim.parts import GROUND_BIT
from antennate.sim.scenes.registry import make_scene
from antennate.sim.world import PREFIX, World, compile_world
from antennate.testing import check_robot
from antennate.types import Floats, Maneuver

ROBOT = RobotSpec.named("scuttle3d")


def rolled(roll: float) -> RobotSpec:
    """The robot with antennae of another roll [rad]."""
    antenna = AntennaSpec.model_validate({**ROBOT.antenna.model_dump(), "roll": roll})
    return ROBOT.model_copy(update={"antenna": antenna})


LEVEL, UPRIGHT = rolled(0.0), rolled(math.pi / 2)


def tips(robot: RobotSpec, **angles: float) -> Floats:
    """Place of the last hinge of each antenna in the frame of the head [m], shape (2, 3).

    Args:
        robot: The robot.
        angles: Of joints of both antennae, by the end of their names [rad].
    """
    world = World(compile_world(PhysicsParams(), robot), robot)
    for prefix in ANTENNA_PREFIXES:
        for name, angle in angles.items():
            world.data.joint(PREFIX + prefix + name).qpos[0] = angle
    mujoco.mj_kinematics(world.model, world.data)
    head = world.data.body(PREFIX + "link0")
    turn = head.xmat.reshape(3, 3)
    last = f"hinge{robot.antenna.hinges - 1}"
    places = [world.data.body(PREFIX + prefix + last).xpos for prefix in ANTENNA_PREFIXES]
    return np.array([turn.T @ (place - head.xpos) for place in places])


def reach(robot: RobotSpec, first: float) -> Floats:
    """Direction of the straight left antenna at an elevation [rad], times its length [m]."""
    spec = robot.antenna
    flat, length = spec.base_angle, (spec.hinges - 1) * spec.link_length
    out = length * math.cos(first)
    return np.array([out * math.cos(flat), out * math.sin(flat), length * math.sin(first)])


def mirrored(places: Floats) -> bool:
    return bool(np.allclose(places[0], places[1] * [1.0, -1.0, 1.0], atol=1e-12))


def test_it_is_a_robot_with_26_servos_that_releases_what_carries_it_last() -> None:
    check_robot(ROBOT)
    assert ROBOT.ids == tuple(range(1, 27))
    assert ROBOT.joint_names[-2:] == ("antenna_l_elevation", "antenna_r_elevation")
    antennae, elevation, yaw, pitch, legs = ROBOT.in_order_of_release
    assert (antennae, elevation) == ((18, 19), (25, 26))
    assert (yaw, pitch, legs) == (tuple(range(1, 6)), tuple(range(20, 25)), tuple(range(6, 18)))


@pytest.mark.parametrize("elevation", [-0.5, 0.2, 1.2])
@pytest.mark.parametrize("robot", [ROBOT, LEVEL], ids=["roll 45", "roll 0"])
def test_elevation_raises_a_straight_antenna_by_its_sine(
    robot: RobotSpec, elevation: float
) -> None:
    flat, raised = tips(robot), tips(robot, elevation=elevation)
    assert raised[0] - flat[0] == pytest.approx(
        reach(robot, elevation) - reach(robot, 0.0), abs=1e-9
    )
    assert mirrored(raised)


@pytest.mark.parametrize(
    ("robot", "outwards", "upwards"),
    [(LEVEL, True, False), (ROBOT, True, True), (UPRIGHT, False, True)],
    ids=["roll 0", "roll 45", "roll 90"],
)
def test_a_positive_bend_is_outwards_and_upwards_on_both_sides(
    robot: RobotSpec, outwards: bool, upwards: bool
) -> None:
    """What is bent is all beyond the first hinge, whose axis is turned by the roll."""
    spec, bend = robot.antenna, 0.3
    moved = tips(robot, hinge0=bend) - tips(robot)
    across = moved[0] @ [-math.sin(spec.base_angle), math.cos(spec.base_angle), 0.0]
    length = (spec.hinges - 1) * spec.link_length * math.sin(bend)
    assert across == pytest.approx(length * math.cos(spec.roll), abs=1e-6)
    assert moved[0, 2] == pytest.approx(length * math.sin(spec.roll), abs=1e-6)
    assert (across > 0.01, moved[0, 2] > 0.01) == (outwards, upwards)
    assert mirrored(tips(robot, hinge0=bend))


def test_a_sweep_of_the_base_goes_outwards_in_the_plane_of_the_raised_antenna() -> None:
    for robot in (ROBOT, LEVEL):
        swept = tips(robot, base=0.4)
        assert swept[0, 1] > tips(robot)[0, 1]
        assert swept[:, 2] == pytest.approx(tips(robot)[:, 2], abs=1e-12)
        assert mirrored(swept)
        assert mirrored(tips(robot, base=0.4, elevation=-0.3))


@pytest.mark.parametrize("name", ["scuttle", "hexapod"])
@pytest.mark.parametrize("scene", ["flat", "tunnel", "corridors", "wall", "room"])
def test_ground_is_nothing_to_a_planar_robot(name: str, scene: str) -> None:
    """No geom has the bit by which bodies and antennae feel ground, and no axis is turned."""
    robot = RobotSpec.named(name)
    drawn = make_scene(scene).draw(robot, np.random.default_rng(2))
    model = compile_world(PhysicsParams(), robot, drawn)
    assert not (model.geom_contype & GROUND_BIT).any()
    names = [model.joint(i).name for i in range(model.njnt)]
    axes = [model.jnt_axis[i].tolist() for i, name in enumerate(names) if "hinge" in name]
    assert len(axes) == robot.antenna_count * robot.antenna.hinges
    assert all(repr(axis) == "[0.0, 0.0, 1.0]" for axis in axes)


def test_every_maneuver_keeps_pitch_and_elevation_level() -> None:
    gait = Gait(GaitParams(), ROBOT, 2, 0.01)
    for maneuver in Maneuver:
        command = gait.step(np.full(2, int(maneuver)))
        assert (command.pitch.shape, command.elevation.shape) == ((2, 5), (2, 2))
        assert not command.pitch.any()
        assert not command.elevation.any()


def test_a_time_series_holds_the_elevation() -> None:
    series = simulate("open", robot=ROBOT, scene="flat", time_limit=0.2)
    assert (series.pitch.shape[1], series.elevation.shape[1]) == (5, 2)
    assert {"elevation_left", "elevation_right", "pitch_4"} <= set(series.columns())
    planar = simulate("open", scene="flat", time_limit=0.2)
    assert planar.elevation.shape == (len(planar.t), 0)
