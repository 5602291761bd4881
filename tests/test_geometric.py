"""`geometric`: escapes in metres and degrees, a gait that changes smoothly, and what it refuses."""

import math

import numpy as np
import pytest

from antennate.control.registry import make_controller
from antennate.errors import ConfigError
from antennate.params.control import ControlParams, GeometricParams
from antennate.params.gaits import GaitParams
from antennate.robots.joints import LegParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Maneuver

PRESSED, FREE = 1420.0, 1800.0
"""Readings of an antenna that is fully bent, and of a straight one [counts]."""


def walked(control, counts, seconds):
    """Maneuvers and yaw targets under constant readings [counts], a row each tick."""
    controller = make_controller("geometric", control)
    controller.reset(np.array([0]))
    maneuvers, yaw = [], []
    for tick in range(round(seconds / control.period)):
        frame = AntennaFrame(t=np.array([tick * control.period]), counts=np.array([counts]))
        yaw.append(controller.step(frame).yaw[0])
        maneuvers.append(int(controller.maneuver[0]))
    return np.array(maneuvers), np.array(yaw)


def first(maneuvers, wanted, period):
    """How long the first stretch of these maneuvers lasts [s]."""
    inside = np.isin(maneuvers, wanted)
    begin = int(np.argmax(inside))
    assert inside[begin]
    after = ~inside[begin:]
    return period * (int(np.argmax(after)) if after.any() else len(after))


@pytest.mark.parametrize("frequency", [0.4, 0.6])
def test_an_escape_lasts_as_long_as_its_size_takes_at_the_speed_of_the_engine(frequency):
    """`swift` walks 0.274 m/s at 0.6 Hz, and a turn is 60° in 2.6 s (both by the engine)."""
    control = ControlParams(gait=GaitParams(frequency=frequency))
    maneuvers, _ = walked(control, [PRESSED, PRESSED], 40.0)
    back = first(maneuvers, [int(Maneuver.REVERSE)], control.period)
    assert back * 0.274 * frequency / 0.6 == pytest.approx(0.5, rel=0.05)
    turns = [int(Maneuver.TURN_L), int(Maneuver.TURN_R)]
    turn = first(maneuvers, turns, control.period)
    assert turn * 60.0 / 2.6 * frequency / 0.6 == pytest.approx(60.0, rel=0.1)


def test_sizes_can_be_set():
    own = GeometricParams(reverse_distance=0.25, turn_angle=math.radians(30.0))
    usual, short = (
        walked(ControlParams(geometric=g), [PRESSED, PRESSED], 30.0)[0]
        for g in (GeometricParams(), own)
    )
    for wanted in ([int(Maneuver.REVERSE)], [int(Maneuver.TURN_L), int(Maneuver.TURN_R)]):
        ratio = first(short, wanted, 0.01) / first(usual, wanted, 0.01)
        assert ratio == pytest.approx(0.5, abs=0.02)


def test_no_joint_target_jumps_between_walking_backing_off_and_turning():
    """A tick moves a joint by less than wave and changes can: 0.05 rad, a jump would be 0.5."""
    maneuvers, yaw = walked(ControlParams(), [PRESSED, PRESSED], 40.0)
    assert {int(Maneuver.FORWARD), int(Maneuver.REVERSE)} < set(maneuvers.tolist())
    assert abs(np.diff(yaw, axis=0)).max() < 0.05


def test_a_bent_antenna_softens_the_wave():
    soft = ControlParams(geometric=GeometricParams(soften=0.5))
    free, bent = (walked(soft, [r, FREE], 3.5)[1][150:] for r in (FREE, PRESSED))
    assert np.ptp(bent, axis=0).max() < 0.65 * np.ptp(free, axis=0).max()


@pytest.mark.parametrize(("forward", "crest"), [("swift", 29.0), ("gait", 25.0)])
def test_it_walks_by_the_gait_that_is_named(forward, crest):
    control = ControlParams(geometric=GeometricParams(forward=forward))
    _, yaw = walked(control, [FREE, FREE], 5.0)
    assert math.degrees(abs(yaw[100:]).max()) == pytest.approx(crest, abs=0.1)


def test_lifting_legs_are_refused():
    robot = RobotSpec(legs=LegParams(kind="lifting"))
    with pytest.raises(ConfigError, match="rolling legs, found lifting"):
        make_controller("geometric", robot=robot)
