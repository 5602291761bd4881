"""Where a climbing body points: turns of known size, tilted heads, gyroscopes that are wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from antennate.control.climbing.heading import Heading, direction, steer
from antennate.control.registry import make_controller
from antennate.params.climb import HeadingParams
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Floats, joint_angles

PERIOD = 0.01
PARAMS = HeadingParams()
AHEAD = np.array([[1.0, 0.0, 0.0]])
BIAS = np.array([0.02, -0.015, 0.0175])
"""Errors of three gyroscopes [rad/s]: 1 deg/s and about."""
GRAVITY = 9.81


def frame(rate: Floats, up: Floats) -> AntennaFrame:
    """What a head feels that turns so [rad/s] where the vertical is this in its axes."""
    return AntennaFrame(
        np.zeros(1),
        np.full((1, 2), 1870.0),
        angular_velocity=rate[None] + BIAS,
        linear_acceleration=GRAVITY * up[None],
    )


def turned(pitch: float, rate: float, seconds: float) -> float:
    """What it tells of a head pitched up by an angle [rad] that turns about the vertical."""
    heading = Heading(PARAMS, 1, PERIOD)
    up = np.array([math.sin(pitch), 0.0, math.cos(pitch)])
    for _ in range(400):
        heading.step(frame(np.zeros(3), up), AHEAD, np.array([True]))
    heading.mark(np.array([True]))
    for _ in range(round(seconds / PERIOD)):
        heading.step(frame(rate * up, up), AHEAD, np.array([False]))
    return float(heading.turned[0])


@pytest.mark.parametrize("pitch", [0.0, 0.9, -0.5])
@pytest.mark.parametrize("rate", [0.3, -0.2])
def test_a_turn_about_the_vertical_is_told_however_the_head_is_pitched(
    pitch: float, rate: float
) -> None:
    assert turned(pitch, rate, 3.0) == pytest.approx(3.0 * rate, abs=0.01)


def test_beyond_half_a_turn_the_shorter_way_is_told() -> None:
    assert turned(0.0, 1.0, 4.0) == pytest.approx(4.0 - 2.0 * math.pi, abs=0.02)


def test_without_a_rest_the_error_of_the_gyroscope_counts() -> None:
    heading = Heading(PARAMS, 1, PERIOD)
    heading.mark(np.array([True]))
    for _ in range(1000):
        heading.step(frame(np.zeros(3), np.array([0.0, 0.0, 1.0])), AHEAD, np.array([False]))
    assert heading.turned[0] == pytest.approx(10.0 * BIAS[2], abs=0.01)


def test_a_head_that_rocks_is_not_at_rest() -> None:
    """Half a second of 0.3 rad/s, while its joints are told to stand, is a turn and no error."""
    heading = Heading(PARAMS, 1, PERIOD)
    up = np.array([0.0, 0.0, 1.0])
    for _ in range(200):
        heading.step(frame(np.zeros(3), up), AHEAD, np.array([True]))
    heading.mark(np.array([True]))
    for _ in range(50):
        heading.step(frame(0.3 * up, up), AHEAD, np.array([True]))
    assert heading.turned[0] == pytest.approx(0.15, abs=0.005)


@pytest.mark.parametrize(("missing", "told"), [(0.04, 0.48), (0.5, 0.0)])
def test_a_moment_without_a_reading_is_no_turn_and_a_longer_one_ends_the_mark(
    missing: float, told: float
) -> None:
    """Half a second at 0.5 rad/s, then nothing, then half a second more."""
    heading, up = Heading(PARAMS, 1, PERIOD), np.array([0.0, 0.0, 1.0])
    moves = np.array([False])
    sound, silent = frame(0.5 * up - BIAS, up), frame(np.full(3, math.nan), np.full(3, math.nan))
    heading.mark(np.array([True]))
    for reading, seconds in ((sound, 0.5), (silent, missing), (sound, 0.46)):
        for _ in range(round(seconds / PERIOD)):
            heading.step(reading, AHEAD, moves)
    assert heading.turned[0] == pytest.approx(told, abs=0.01)
    heading.mark(np.array([True]))
    heading.step(sound, AHEAD, moves)
    assert heading.turned[0] == pytest.approx(told + 0.005, abs=0.01)


def test_a_joint_that_is_not_told_ends_the_mark() -> None:
    heading, up = Heading(PARAMS, 1, PERIOD), np.array([0.0, 0.0, 1.0])
    heading.mark(np.array([True]))
    for body in (AHEAD, np.full((1, 3), math.nan)):
        for _ in range(10):
            heading.step(frame(up - BIAS, up), body, np.array([False]))
    assert heading.turned[0] == 0.0


def test_rows_are_their_own_and_reset_alone() -> None:
    heading = Heading(PARAMS, 2, PERIOD)
    heading.mark(np.array([True, True]))
    rates = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, -0.2]])
    forces = np.array([[0.0, 0.0, GRAVITY], [0.0, 0.0, GRAVITY]])
    reading = AntennaFrame(
        np.zeros(2), np.zeros((2, 2)), angular_velocity=rates, linear_acceleration=forces
    )
    for _ in range(100):
        heading.step(reading, np.repeat(AHEAD, 2, axis=0), np.zeros(2, dtype=bool))
    assert heading.turned == pytest.approx([0.5, -0.2], abs=0.01)
    heading.reset(np.array([0]))
    assert heading.turned == pytest.approx([0.0, -0.2], abs=0.01)


def test_a_force_straight_down_leaves_the_vertical_where_it_was() -> None:
    heading = Heading(HeadingParams(level_time=2.0 * PERIOD), 1, PERIOD)
    heading.mark(np.array([True]))
    for up in (-1.0, 1.0, 1.0):
        vertical = np.array([0.0, 0.0, up])
        heading.step(frame(np.array([0.0, 0.0, 1.0]) - BIAS, vertical), AHEAD, np.array([False]))
    assert heading.turned[0] == pytest.approx(0.03, abs=0.001)


def test_a_later_rest_does_not_undo_a_longer_one() -> None:
    """Ten seconds at rest, then it is pushed round at 3 deg/s for a second."""
    heading, up = Heading(PARAMS, 1, PERIOD), np.array([0.0, 0.0, 1.0])
    for rate, seconds in ((0.0, 10.0), (1.0, 0.1), (0.05, 1.0)):
        for _ in range(round(seconds / PERIOD)):
            heading.step(frame(rate * up, up), AHEAD, np.array([True]))
    heading.mark(np.array([True]))
    for _ in range(1000):
        heading.step(frame(np.zeros(3), up), AHEAD, np.array([False]))
    assert abs(heading.turned[0]) < 0.05


def rotation(axis: int, angle: float) -> Floats:
    """Matrix that turns about an axis of x, y, z."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[[i, j], [i, j]] = math.cos(angle)
    matrix[j, i], matrix[i, j] = math.sin(angle), -math.sin(angle)
    return matrix


def test_the_direction_of_a_body_is_that_of_its_links_one_after_the_other() -> None:
    """A pitch joint lifts what is before it, so what is behind it points down."""
    yaw, pitch = np.array([[0.3, -0.2, 0.5]]), np.array([[0.4, 0.1, -0.3]])
    attitude, expected = np.eye(3), AHEAD[0].copy()
    for a, b in zip(yaw[0], pitch[0], strict=True):
        attitude = attitude @ rotation(2, a) @ rotation(1, b)
        expected += attitude[:, 0]
    assert direction(yaw, pitch)[0] == pytest.approx(expected)


def test_who_was_turned_to_the_left_steers_to_the_right_up_to_a_limit() -> None:
    offsets = steer(PARAMS, np.array([0.1, -0.1, 2.0]))
    assert offsets.tolist() == pytest.approx([PARAMS.gain * 0.1, -PARAMS.gain * 0.1, 0.3])


def walked(sensor: str) -> Floats:
    """Yaw joints of `rhythm` at last, which is turned while it climbs [rad], shape (Y,).

    Its joints are where they were told to be.
    """
    scuttle3d = RobotSpec.named("scuttle3d").model_dump()
    kind = "none" if sensor == "none" else "head"
    robot = RobotSpec.model_validate(scuttle3d | {"imu": {"kind": kind}})
    control = ControlParams()
    controller = make_controller("rhythm", control, robot, 1)
    controller.reset(np.array([0]))
    climb = control.climb
    begins = climb.walk_time + climb.retreat_time + climb.lift_time + climb.come_time
    up, angles, yaw = np.array([0.0, 0.0, 1.0]), np.zeros((1, len(robot.joint_names))), np.zeros(0)
    for tick in range(round((begins + 2.0) / PERIOD)):
        now = tick * PERIOD
        rate = (0.2 if now > begins else 0.0) * up - BIAS
        reading = frame(rate if sensor == "sound" else np.full(3, math.nan), up)
        if sensor == "none":
            reading = AntennaFrame(reading.t, reading.counts)
        command = controller.step(replace(reading, t=np.array([now]), positions=angles.copy()))
        angles, yaw = joint_angles(command, robot.command_shapes()), command.yaw[0]
    return yaw


def test_a_robot_that_climbs_steers_back_where_it_feels_that_it_is_turned() -> None:
    """A silent sensor lets it alone, as none does."""
    alone = walked("none")
    assert walked("sound") - alone == pytest.approx(0.3, abs=0.1)
    assert walked("silent").tolist() == alone.tolist()
