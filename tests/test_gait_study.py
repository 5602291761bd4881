"""The gait study, against closed forms and the symmetry of the gait."""

import math

import numpy as np
import pytest

from antennate.experiments.gait import experiment as study
from antennate.experiments.gait.physics import Walk, measure, rolling_speed
from antennate.params.control import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.types import Maneuver

SHORT = study.GaitStudyConfig(cycles=2, settling_cycles=1, sweep_points=2)


def drawn_walk(speed: float, yaw_rate: float, power: float, cycles: int = 6) -> Walk:
    """A body that moves on a circle at a steady speed along its axis, with a wobble each cycle."""
    gait = GaitParams(frequency=0.5)
    t = np.arange(round(100 * cycles / gait.frequency) + 1) / 100
    heading = yaw_rate * t
    if yaw_rate:
        radius = speed / yaw_rate
        centre = radius * np.stack([np.sin(heading), 1 - np.cos(heading)], axis=1)
    else:
        centre = np.stack([speed * t, 0 * t], axis=1)
    wobble = 0.02 * np.sin(2 * math.pi * gait.frequency * t)
    side = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    return Walk(
        name="drawn",
        gait=gait,
        t=t,
        head=centre,
        centre=centre + wobble[:, None] * side,
        heading=heading,
        work=power * t,
        weight=20.0,
        length=0.6,
    )


@pytest.mark.parametrize("speed", [0.2, -0.15])
def test_straight_walk_has_its_speed_and_cost(speed):
    pace = measure(drawn_walk(speed, 0.0, power=1.5), settling_cycles=1, cycles=4)
    assert pace.speed == pytest.approx(speed, rel=1e-9)
    assert pace.body_lengths == pytest.approx(speed / (0.5 * 0.6), rel=1e-9)
    assert pace.yaw == pytest.approx(0.0, abs=1e-12)
    assert pace.cost_of_transport == pytest.approx(1.5 / (20.0 * abs(speed)), rel=1e-6)


@pytest.mark.parametrize("yaw_rate", [0.3, -0.3])
def test_circle_has_the_chord_of_one_cycle(yaw_rate):
    pace = measure(drawn_walk(0.1, yaw_rate, power=1.0), settling_cycles=1, cycles=5)
    turn = yaw_rate * 2.0
    chord = 2 * (0.1 / yaw_rate) * math.sin(turn / 2)
    assert pace.yaw == pytest.approx(turn, rel=1e-9)
    assert pace.speed == pytest.approx(chord / 2.0, rel=1e-3)


def test_standing_has_no_cost_of_transport():
    assert measure(drawn_walk(0.0, 0.0, power=1.0), 1, 4).cost_of_transport is None


def test_the_work_of_a_walk_is_that_of_finer_physics():
    coarse, fine = (
        study.walk_flat(
            study.GaitStudyConfig(
                physics=PhysicsParams(timestep=timestep), cycles=2, settling_cycles=0
            ),
            "forward",
            GaitParams(frequency=1.0),
            Maneuver.FORWARD,
        )
        for timestep in (0.002, 0.0005)
    )
    assert coarse.work[0] == 0.0
    assert coarse.work[-1] == pytest.approx(fine.work[-1], rel=0.03)


def test_rolling_speed_is_that_of_the_rim():
    gait, robot = GaitParams(frequency=0.5), RobotSpec()
    assert rolling_speed(gait, robot) == pytest.approx(math.pi * 0.033)


def test_walks_come_out_the_same_twice():
    gait = GaitParams()
    config = study.GaitStudyConfig(cycles=2, settling_cycles=0)
    one, two = (study.walk_flat(config, "forward", gait, Maneuver.FORWARD) for _ in range(2))
    np.testing.assert_array_equal(one.centre, two.centre)
    assert 2 / gait.frequency - 1e-9 < one.t[-1] < 2 / gait.frequency + 1 / config.rate
    assert one.weight == pytest.approx(RobotSpec().mass * 9.81, rel=0.01)


@pytest.mark.slow
def test_study_keeps_its_promises():
    steps = []
    outcome = study.run(SHORT, on_step=lambda done, total: steps.append((done, total)))
    result = outcome.result()
    assert steps == [(i + 1, 7) for i in range(7)]
    four = result["maneuvers"]
    assert list(four) == ["forward", "turn_l", "turn_r", "reverse"]
    forward, left, right = four["forward"], four["turn_l"], four["turn_r"]
    assert abs(forward["yaw_deg_per_cycle"]) < 1.0
    assert abs(four["reverse"]["yaw_deg_per_cycle"]) < 1.0
    assert four["reverse"]["speed_m_s"] < -0.8 * forward["speed_m_s"] < 0.0
    assert left["yaw_deg_per_cycle"] > 15.0
    assert left["yaw_deg_per_cycle"] == pytest.approx(-right["yaw_deg_per_cycle"], rel=0.05)
    assert left["speed_m_s"] == pytest.approx(right["speed_m_s"], rel=0.05)
    assert result["wave_off"]["ratio"] == pytest.approx(1.0, abs=0.05)
    assert [row["body_phase_rad"] for row in result["phase_sweep"]] == [0.0, math.pi]
    assert result["best_body_phase_rad"] == math.pi
    assert result["cost_of_phase"]["worst_over_best"] < 0.5


def test_result_does_not_depend_on_workers():
    config = study.GaitStudyConfig(
        cycles=2,
        settling_cycles=0,
        sweep_points=2,
        rate=50.0,
        gait=GaitParams(frequency=1.0),
        physics=PhysicsParams(timestep=0.004, contact_time=0.008),
    )
    assert study.run(config, workers=1).result() == study.run(config, workers=2).result()


@pytest.mark.slow
def test_chosen_lead_is_near_the_best():
    config = study.GaitStudyConfig(cycles=2, sweep_points=12)
    assert study.run(config).result()["cost_of_phase"]["chosen_over_best"] > 0.95
