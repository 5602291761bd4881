"""Worlds behind the wall: rows are independent, failures and empty rows read NaN."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from antennate.control.loop import run_loop
from antennate.control.registry import make_controller
from antennate.params.control import ControlParams
from antennate.params.scene import PhysicsParams, VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.scene import Route
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.world import PREFIX, World, compile_world
from antennate.types import AntennaFrame, JointCommand, Maneuver

ROBOT, MIND = RobotSpec(), ControlParams()
PERIOD = MIND.period
QUIET = VariationParams(joint_bias=0.0, slip_log_sd=0.0)


@pytest.fixture(autouse=True)
def _engine_log_goes_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def chance(seed: int, variation: VariationParams | None = None) -> Disturbance:
    rng = np.random.default_rng(seed)
    return Disturbance(rng, variation or VariationParams(), ROBOT, PERIOD)


def body_of(*seeds: int | None) -> SimRobot:
    """A batch on flat floors, one row a seed, empty where there is none."""
    body = SimRobot(len(seeds), ROBOT, PERIOD, PhysicsParams().timestep)
    for row, seed in enumerate(seeds):
        if seed is not None:
            body.load(row, World(compile_world(PhysicsParams(), ROBOT), ROBOT), chance(seed))
    return body


def run(body: SimRobot, batch: int, ticks: int, spoil_at: int | None = None) -> list[AntennaFrame]:
    """Frames of some ticks; at one tick the world of row 0 is broken."""
    control, frames = make_controller("closed", MIND, batch=batch), []

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        frames.append(frame)
        if len(frames) == spoil_at:
            body.world(0).data.qvel[0] = math.nan
        return len(frames) < ticks

    run_loop(body, control, PERIOD, go_on)
    return frames


def counts(frames: list[AntennaFrame], row: int) -> np.ndarray:
    return np.array([f.counts[row] for f in frames])


def test_rows_say_the_same_alone_and_together() -> None:
    together = run(body_of(1, 2, 3), 3, 60)
    for row, seed in enumerate((1, 2, 3)):
        assert np.array_equal(counts(run(body_of(seed), 1, 60), 0), counts(together, row))


def test_rows_of_different_seeds_differ() -> None:
    frames = run(body_of(1, 2), 2, 60)
    assert not np.array_equal(counts(frames, 0), counts(frames, 1))


def test_a_row_that_fails_reads_nan_and_the_others_go_on_as_if_alone() -> None:
    body = body_of(1, 2)
    frames = run(body, 2, 60, spoil_at=20)
    assert np.isfinite(counts(frames[:20], 0)).all()
    assert np.isnan(counts(frames[20:], 0)).all()
    assert np.array_equal(counts(frames, 1), counts(run(body_of(2), 1, 60), 0))
    failure = body.failures.get(0)
    assert failure is not None
    assert failure.step == 100
    assert body.failures.get(1) is None


def test_an_empty_row_reads_nan_and_makes_the_mind_hold() -> None:
    body, control = body_of(1, None), make_controller("closed", MIND, batch=2)
    frame = body.read()
    control.step(frame)
    assert np.isnan(frame.counts[1]).all()
    assert np.isnan(frame.t[1])
    assert control.maneuver.tolist() == [Maneuver.FORWARD, Maneuver.HOLD]


def test_a_row_goes_on_from_a_state_whenever_it_is_put_back() -> None:
    """Its time goes back, which is no fault of the engine."""
    body = body_of(1, 2)
    begin = body.world(0).state()
    run(body, 2, 6)
    command = make_controller("open", MIND, batch=2).step(body.read())
    body.write(command)
    body.sleep_until(body.now() + 10 * PERIOD)
    body.put_back(0, begin)
    frame = body.read()
    assert not body.failures
    assert np.isfinite(frame.counts).all()
    assert frame.t.tolist() == pytest.approx([0.0, 15 * PERIOD])


class Balls(Route):
    """A floor with loose balls far from the robot."""

    def __init__(self, count: int) -> None:
        super().__init__(np.array([[0.0, 0.0], [2.0, 0.0]]))
        self.count = count

    def build(self, spec: mujoco.MjSpec) -> None:
        super().build(spec)
        for i in range(self.count):
            ball = spec.worldbody.add_body(pos=[1.0 + 0.3 * i, 1.0, 0.05])
            ball.add_freejoint()
            ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0.0, 0.0])


def test_worlds_of_any_size_share_a_batch() -> None:
    """A larger one that comes later makes room for itself, and changes nothing for the others."""

    def with_balls(count: int) -> World:
        return World(compile_world(PhysicsParams(), ROBOT, Balls(count)), ROBOT)

    body, alone, other = body_of(1, None, None), body_of(1), body_of(None)
    early, early_alone = run(body, 3, 20), run(alone, 1, 20)
    body.load(1, with_balls(4), chance(7))
    body.load(2, with_balls(1), chance(8))
    other.load(0, with_balls(4), chance(7))
    late, late_alone, late_other = run(body, 3, 20), run(alone, 1, 20), run(other, 1, 20)
    assert np.array_equal(counts(early + late, 0), counts(early_alone + late_alone, 0))
    assert np.array_equal(counts(late, 1), counts(late_other, 0))
    assert np.isfinite(counts(late, 2)).all()


def test_a_row_can_be_emptied_and_filled_again() -> None:
    body = body_of(1)
    body.unload(0)
    assert np.isnan(body.read().counts).all()
    body.load(0, World(compile_world(PhysicsParams(), ROBOT), ROBOT), chance(1))
    assert np.array_equal(body.read().counts, body_of(1).read().counts)


def test_the_world_of_an_empty_row_is_refused() -> None:
    with pytest.raises(IndexError, match="row 1 holds no world"):
        body_of(1, None).world(1)


def test_a_world_that_was_never_commanded_does_not_move_on() -> None:
    body = body_of(1)
    body.sleep_until(0.1)
    assert body.world(0).t == 0.0
    assert body.now() == pytest.approx(0.1)


def test_sleeping_is_what_steps_the_physics() -> None:
    body = body_of(1)
    run(body, 1, 31)
    assert body.now() == pytest.approx(0.3)
    assert body.world(0).t == pytest.approx(0.3)


def test_a_command_that_is_no_number_fails_its_row_only() -> None:
    body = body_of(1, 2)
    body.read()
    yaw = np.zeros((2, 5))
    yaw[0, 2] = math.nan
    body.write(JointCommand(yaw=yaw, leg=np.zeros((2, 6, 2)), antenna=np.zeros((2, 2))))
    assert "yaw3" in str(body.failures.get(0))
    assert body.failures.get(1) is None
    assert np.isnan(body.read().counts).tolist() == [[True, True], [False, False]]


def test_straight_antennae_read_the_divider_at_ten_kiloohms() -> None:
    readings = []
    body = SimRobot(1, ROBOT, PERIOD, PhysicsParams().timestep)
    for seed in range(50):
        body.load(0, World(compile_world(PhysicsParams(), ROBOT), ROBOT), chance(seed))
        readings.append(body.read().counts[0])
    assert np.mean(readings) == pytest.approx(1872, abs=1.0)
    assert np.std(readings) == pytest.approx(2.5, rel=0.3)


def test_flex_and_pose_reach_the_frame_and_the_joints_in_their_order() -> None:
    world = World(compile_world(PhysicsParams(), ROBOT), ROBOT)
    body = SimRobot(1, ROBOT, PERIOD, PhysicsParams().timestep)
    body.load(0, world, chance(0, QUIET))
    world.data.joint(PREFIX + "antenna_l_hinge0").qpos[0] = math.pi / 4
    left, right = body.read().counts[0]
    assert left < 1700 < right
    leg = np.arange(12.0).reshape(1, 6, 2)
    body.write(JointCommand(yaw=np.full((1, 5), 0.1), leg=leg, antenna=np.array([[0.2, 0.3]])))
    drive = world.data.actuator
    assert drive(PREFIX + "yaw4").ctrl[0] == pytest.approx(0.1)
    assert drive(PREFIX + "leg_l3").ctrl[0] == 6.0
    assert drive(PREFIX + "leg_r3").ctrl[0] == 7.0
    assert drive(PREFIX + "antenna_r_base").ctrl[0] == pytest.approx(0.3)


def test_chance_draws_joint_zeros_and_leg_slip_of_the_spread_it_is_given() -> None:
    draws = [chance(seed) for seed in range(200)]
    assert np.std([d.joint_bias for d in draws]) == pytest.approx(0.02, rel=0.1)
    slip = np.array([d.leg_friction(0) for d in draws])
    assert np.std(np.log(slip / 0.6)) == pytest.approx(0.3, rel=0.1)


def test_leg_slip_is_drawn_anew_after_its_time_only() -> None:
    draw = chance(0)
    drawn = [tick for tick in range(600) if draw.leg_friction(tick) is not None]
    assert drawn == [0, 250, 500]


def test_joint_zeros_are_added_to_the_commanded_yaw_angles() -> None:
    draw = chance(0)
    assert draw.joint_bias.all()
    body = SimRobot(1, ROBOT, PERIOD, PhysicsParams().timestep)
    body.load(0, World(compile_world(PhysicsParams(), ROBOT), ROBOT), draw)
    yaw = np.full((1, 5), 0.1)
    body.write(JointCommand(yaw=yaw, leg=np.zeros((1, 6, 2)), antenna=np.zeros((1, 2))))
    ctrl = [body.world(0).data.actuator(f"{PREFIX}yaw{j}").ctrl[0] for j in range(1, 6)]
    assert ctrl == pytest.approx(0.1 + draw.joint_bias)
