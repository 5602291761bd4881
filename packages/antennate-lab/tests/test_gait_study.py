"""The gait study, against closed forms and the symmetry of the gait."""

import math

import numpy as np
import pytest

from antennate.params.control import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.types import Maneuver
from antennate_lab.gait import experiment as study
from antennate_lab.gait.physics import Walk, measure, rolling_speed
from antennate_lab.gait.result import summarise

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
    assert pace.speed_m_s == pytest.approx(speed, rel=1e-9)
    assert pace.body_lengths_per_cycle == pytest.approx(speed / (0.5 * 0.6), rel=1e-9)
    assert pace.yaw_deg_per_cycle == pytest.approx(0.0, abs=1e-10)
    assert pace.cost_of_transport == pytest.approx(1.5 / (20.0 * abs(speed)), rel=1e-6)


@pytest.mark.parametrize("yaw_rate", [0.3, -0.3])
def test_circle_has_the_chord_of_one_cycle(yaw_rate):
    pace = measure(drawn_walk(0.1, yaw_rate, power=1.0), settling_cycles=1, cycles=5)
    turn = yaw_rate * 2.0
    chord = 2 * (0.1 / yaw_rate) * math.sin(turn / 2)
    assert pace.yaw_deg_per_cycle == pytest.approx(math.degrees(turn), rel=1e-9)
    assert pace.speed_m_s == pytest.approx(chord / 2.0, rel=1e-3)


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
    assert list(result.maneuvers) == ["forward", "turn_l", "turn_r", "reverse"]
    forward, left, right, back = result.maneuvers.values()
    assert abs(forward.yaw_deg_per_cycle) < 1.0
    assert abs(back.yaw_deg_per_cycle) < 1.0
    assert back.speed_m_s < -0.8 * forward.speed_m_s < 0.0
    assert left.yaw_deg_per_cycle > 15.0
    assert left.yaw_deg_per_cycle == pytest.approx(-right.yaw_deg_per_cycle, rel=0.05)
    assert left.speed_m_s == pytest.approx(right.speed_m_s, rel=0.05)
    assert result.wave_off.ratio == pytest.approx(1.0, abs=0.05)
    assert [point.body_phase_rad for point in result.phase_sweep] == [0.0, math.pi]
    assert result.best_body_phase_rad == math.pi
    assert result.cost_of_phase.worst_over_best < 0.5


def test_walks_by_name_become_the_result_that_the_tables_show():
    """Speeds are drawn, so all that follows from them is known."""
    config = study.GaitStudyConfig(
        sweep_points=2,
        settling_cycles=1,
        cycles=4,
        gait=GaitParams(frequency=0.5),
        unknown=("robot.leg_friction=0.18:0.25",),
        draws=3,
        measured=0.7,
        optimise="speed",
    )
    speeds = {"forward": 0.2, "turn_l": 0.1, "turn_r": 0.1, "reverse": -0.15, "wave_off": 0.1}
    speeds |= {"sweep0": 0.05, "sweep1": 0.25, "optimised": 0.3}
    speeds |= {"draw0": 0.15, "draw1": 0.3, "draw2": 0.21}
    speeds |= {"robot.leg_friction:low": 0.18, "robot.leg_friction:high": 0.24}
    walks = {name: drawn_walk(speed, 0.0, power=1.5) for name, speed in speeds.items()}
    result = summarise(config, walks)
    assert result.wave_off.ratio == pytest.approx(0.1 / (math.pi * 0.033))
    cost = result.cost_of_phase
    assert (cost.chosen_over_best, cost.worst_over_best) == pytest.approx((0.8, 0.2))
    assert result.optimised.gaits["optimised"].cost_of_transport == pytest.approx(1.5 / 6.0)
    found, alone = result.unknown, result.unknown.parameters["robot.leg_friction"]
    assert (found.median, *found.range) == pytest.approx((0.7, 0.5, 1.0))  # over 0.5 Hz x 0.6 m
    assert (*alone.body_lengths_per_cycle, alone.change) == pytest.approx((0.6, 0.8, 0.2))
    maneuvers, best, one, every = study.tables(result)
    assert maneuvers.rows[0] == ("speed [m/s]", ["+0.200", "+0.100", "+0.100", "-0.150"])
    assert best.columns == ["forward", "optimised"]
    assert dict(best.rows)["body lengths a cycle"] == ["+0.67", "+1.00"]
    assert dict(best.rows)["yaw offset [deg]"] == ["-", "-"]
    assert one.rows == [("robot.leg_friction", ["0.18", "0.25", "0.60", "0.80"])]
    assert [name for name, _ in every.rows] == [
        *("median", "95 % of the draws", "all draws"),
        *("measured on a robot", "draws below that"),
    ]
    assert dict(every.rows)["all draws"] == ["0.50 to 1.00"]
    assert dict(every.rows)["draws below that"] == ["1 of 3"]
    assert "the measured 0.70 is inside" in study.sentence(result)


@pytest.mark.slow
def test_chosen_lead_is_near_the_best():
    config = study.GaitStudyConfig(cycles=2, sweep_points=12)
    assert study.run(config).result().cost_of_phase.chosen_over_best > 0.95
