"""The robot on a flat floor and in a tunnel: speeds, turns and mirror symmetry."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from antennate.control.gait import Gait, targets
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams, TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.tunnel import TunnelScene
from antennate.sim.world import World, compile_world
from antennate.types import Maneuver

PERIOD, SUBSTEPS = 0.01, 5
CYCLE = 200
GAIT = GaitParams(frequency=0.5)
MIRROR = np.array([1.0, -1.0, 1.0, -1.0])


@pytest.fixture(scope="module")
def floor() -> mujoco.MjModel:
    return compile_world(PhysicsParams(), RobotSpec())


def walk(
    model: mujoco.MjModel,
    maneuver: Maneuver,
    ticks: int,
    gait: GaitParams = GAIT,
    phase: float = 0.0,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[np.ndarray, World]:
    """Head position and unwrapped heading (ticks, 4) under one maneuver, and the world after it."""
    world, control = World(model, RobotSpec()), Gait(gait, RobotSpec(), 1, PERIOD)
    control.reset(np.array([0]), phase)
    command = targets(gait, RobotSpec(), control.phase, control.offset)
    world.place(*start, command.yaw[0], command.leg[0])
    track = []
    for _ in range(ticks):
        command = control.step(np.array([maneuver]))
        world.command(np.concatenate([command.yaw[0], command.leg[0].ravel(), command.antenna[0]]))
        world.step(SUBSTEPS)
        track.append([*world.head, world.heading])
    found = np.array(track)
    found[:, 3] = np.unwrap(found[:, 3])
    return found, world


def speed(track: np.ndarray) -> float:
    """Mean speed of the head over all whole cycles but the first [m/s]."""
    way = track[-1, :2] - track[CYCLE - 1, :2]
    return float(np.linalg.norm(way)) / ((len(track) - CYCLE) * PERIOD)


def yaw_per_cycle(track: np.ndarray) -> float:
    return math.degrees(track[-1, 3] - track[CYCLE - 1, 3]) * CYCLE / (len(track) - CYCLE)


def test_without_a_body_wave_the_rings_roll_at_their_longest_radius(floor: mujoco.MjModel) -> None:
    straight = GAIT.model_copy(update={"amplitude": 0.0})
    track, _ = walk(floor, Maneuver.FORWARD, 3 * CYCLE, straight)
    assert speed(track) == pytest.approx(2 * math.pi * 0.5 * (0.025 + 0.008), rel=0.05)


def test_forward_goes_forward_faster_with_the_wave_than_without(floor: mujoco.MjModel) -> None:
    track, _ = walk(floor, Maneuver.FORWARD, 3 * CYCLE)
    assert track[-1, 0] > 0.5
    assert speed(track) > 2 * math.pi * 0.5 * (0.025 + 0.008)


def test_reverse_goes_backwards_at_four_fifths_of_the_forward_speed(floor: mujoco.MjModel) -> None:
    ahead, _ = walk(floor, Maneuver.FORWARD, 3 * CYCLE)
    back, _ = walk(floor, Maneuver.REVERSE, 3 * CYCLE)
    assert back[-1, 0] < 0
    assert speed(back) >= 0.8 * speed(ahead)


def test_turns_go_to_their_side_and_alike_on_both(floor: mujoco.MjModel) -> None:
    left = yaw_per_cycle(walk(floor, Maneuver.TURN_L, 4 * CYCLE)[0])
    right = yaw_per_cycle(walk(floor, Maneuver.TURN_R, 4 * CYCLE)[0])
    assert left >= 15
    assert right == pytest.approx(-left, rel=0.05)


def test_hold_stands_still(floor: mujoco.MjModel) -> None:
    track, _ = walk(floor, Maneuver.HOLD, CYCLE)
    assert abs(track[-1, :2] - track[49, :2]).max() < 1e-3


def test_legs_sink_less_than_a_millimetre_into_the_floor(floor: mujoco.MjModel) -> None:
    track, _ = walk(floor, Maneuver.HOLD, CYCLE, phase=0.0)
    assert track[-1, 2] > 0.033 - 0.001


@pytest.mark.parametrize(
    ("maneuver", "mirrored"),
    [(Maneuver.FORWARD, Maneuver.FORWARD), (Maneuver.TURN_L, Maneuver.TURN_R)],
)
def test_a_mirrored_gait_walks_the_mirrored_way(
    floor: mujoco.MjModel, maneuver: Maneuver, mirrored: Maneuver
) -> None:
    here, _ = walk(floor, maneuver, 2 * CYCLE, start=(0.0, 0.1, 0.3))
    there, _ = walk(floor, mirrored, 2 * CYCLE, phase=math.pi, start=(0.0, -0.1, -0.3))
    assert abs(there - here * MIRROR).max() < 1e-5


def test_a_mirrored_tunnel_is_walked_the_mirrored_way() -> None:
    tracks, moved = [], []
    for side, mirror, phase in ((1, "never", 0.0), (-1, "always", math.pi)):
        plan = TunnelParams(segments=(1.0,), turns_deg=(), mirror=mirror, strewn=0)
        tunnel = TunnelScene(plan).draw(RobotSpec(), np.random.default_rng(3))
        model = compile_world(PhysicsParams(), RobotSpec(), tunnel)
        track, world = walk(model, Maneuver.FORWARD, 300, phase=phase, start=(0.3, 0.0, side * 0.4))
        tracks.append(track)
        stand = [world.data.body(f"cylinder{i}").xpos[:2] for i in range(len(tunnel.cylinders))]
        moved.append(np.array(stand) - tunnel.cylinders)
    assert abs(moved[0]).max() > 0.005  # the robot did push something
    assert abs(tracks[1] - tracks[0] * MIRROR).max() < 1e-5
    assert abs(moved[1] - moved[0] * MIRROR[:2]).max() < 1e-5
