"""Tunnels as drawn, and cylinders as the engine moves them."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from antennate.errors import SceneError
from antennate.params.scene import PhysicsParams, TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes import geometry
from antennate.sim.scenes.tunnel import Tunnel, TunnelScene
from antennate.sim.world import World, compile_world

MU, G, RADIUS = 0.4, 9.81, 0.07
STRAIGHT = TunnelParams(segments=(2.0,), turns_deg=(), mirror="never")
BENT = TunnelParams(segments=(1.0, 0.8, 1.2), turns_deg=(60.0, -90.0), mirror="never")
ROBOT = RobotSpec()


def draw(params: TunnelParams, seed: int = 0, **changes: object) -> Tunnel:
    return TunnelScene(params.model_copy(update=changes)).draw(ROBOT, np.random.default_rng(seed))


def gap_to_line(point: np.ndarray, line: np.ndarray) -> float:
    """Distance of a point from a polyline."""
    start, along = line[:-1], np.diff(line, axis=0)
    s = np.clip(((point - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return float(np.linalg.norm(point - start - s[:, None] * along, axis=1).min())


def pushed(velocity: tuple[float, float], spin: float) -> np.ndarray:
    """Way (x, y) [m] and turn [rad] of a lone cylinder until it rests."""
    lone = Tunnel(
        params=STRAIGHT,
        centre=np.array([[0.0, 0.0], [1.0, 0.0]]),
        walls=(np.array([[0.0, 5.0], [1.0, 5.0]]), np.array([[0.0, -5.0], [1.0, -5.0]])),
        cylinders=np.array([[3.0, 3.0]]),
    )
    model = compile_world(PhysicsParams(), ROBOT, lone)
    world = World(model, ROBOT)
    world.step(20)
    first = {axis: model.joint(f"cylinder0_{axis}") for axis in ("x", "y", "spin")}
    before = np.array([world.data.qpos[j.qposadr[0]] for j in first.values()])
    for joint, v in zip(first.values(), (*velocity, spin), strict=True):
        world.data.qvel[joint.dofadr[0]] = v
    world.step(700)
    assert all(abs(world.data.qvel[j.dofadr[0]]) < 1e-3 for j in first.values())
    return np.array([world.data.qpos[j.qposadr[0]] for j in first.values()]) - before


@pytest.mark.parametrize("direction_deg", [0, 45, 90, 200])
@pytest.mark.parametrize("v", [0.3, 0.8])
def test_a_sliding_cylinder_stops_where_coulomb_says_in_any_direction(
    v: float, direction_deg: float
) -> None:
    heading = np.array(
        [math.cos(math.radians(direction_deg)), math.sin(math.radians(direction_deg))]
    )
    way = pushed((v * heading[0], v * heading[1]), 0.0)[:2]
    assert float(way @ heading) == pytest.approx(v**2 / (2 * MU * G), rel=0.05)
    assert float(np.cross([*heading, 0], [*way, 0])[2]) == pytest.approx(0, abs=1e-4)


@pytest.mark.parametrize("spin", [3.0, -6.0])
def test_a_spinning_tube_stops_where_friction_at_its_rim_says(spin: float) -> None:
    deceleration = MU * G / RADIUS  # (mu m g r) / (m r^2)
    turn = pushed((0.0, 0.0), spin)[2]
    assert turn == pytest.approx(math.copysign(spin**2 / (2 * deceleration), spin), rel=0.1)


def test_a_spinning_cylinder_slides_further_than_one_that_does_not() -> None:
    assert pushed((0.5, 0.0), 6.0)[0] > 1.1 * pushed((0.5, 0.0), 0.0)[0]


def test_an_inset_lining_stands_in_by_as_much_as_it_may() -> None:
    """Uniform from 0 to 5 cm, so in a straight corridor the quartiles are 1.25 and 3.75 cm."""
    params = TunnelParams(segments=(20.0,), turns_deg=(), strewn=0, lining_inset=0.05)
    tunnel = draw(params, 3)
    inset = 0.5 * params.free_width + RADIUS - np.abs(tunnel.cylinders[:, 1])
    assert len(inset) > 200
    assert 0.0 <= inset.min() < 0.003
    assert 0.047 < inset.max() <= 0.0521  # cylinders begin 2 mm off the lining
    assert np.quantile(inset, [0.25, 0.75]) == pytest.approx([0.0125, 0.0375], abs=0.006)
    with pytest.raises(SceneError, match=r"robot's width of 0\.2 m, found 0\.4 m, less twice"):
        draw(TunnelParams(lining_inset=0.11), 3)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("params", [STRAIGHT, BENT, TunnelParams(corner_radius=0.15)])
def test_cylinders_stand_clear_of_one_another_and_of_the_walls(
    params: TunnelParams, seed: int
) -> None:
    tunnel = draw(params, seed)
    apart = np.linalg.norm(tunnel.cylinders[:, None] - tunnel.cylinders[None], axis=2)
    assert apart[np.triu_indices(len(apart), 1)].min() >= 2 * RADIUS
    for wall in tunnel.walls:
        assert min(gap_to_line(c, wall) for c in tunnel.cylinders) >= RADIUS


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("params", [BENT, TunnelParams()])
def test_nothing_in_a_tunnel_touches_at_the_start(params: TunnelParams, seed: int) -> None:
    model = compile_world(PhysicsParams(), ROBOT, draw(params, seed))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    names = [(model.geom(c.geom1).name, model.geom(c.geom2).name) for c in data.contact]
    assert [pair for pair in names if "cylinder" in "".join(pair) and "floor" not in pair] == []


def test_the_corridor_between_the_linings_is_forty_centimetres_wide() -> None:
    lateral = draw(STRAIGHT, strewn=0).cylinders[:, 1]
    inner = np.abs(lateral).min() - RADIUS
    assert 2 * inner == pytest.approx(0.40, abs=0.005)
    assert {math.copysign(1, y) for y in lateral} == {1.0, -1.0}


def test_a_tunnel_narrower_than_the_robot_is_refused_with_both_widths() -> None:
    with pytest.raises(SceneError, match=r"0\.2 m.*0\.15 m"):
        draw(STRAIGHT, free_width=0.15)


def test_more_strewn_cylinders_than_find_room_are_refused() -> None:
    with pytest.raises(SceneError, match="strewn asks for 40"):
        draw(STRAIGHT, strewn=40)


def test_as_many_cylinders_are_strewn_as_asked() -> None:
    assert len(draw(STRAIGHT, strewn=3).cylinders) == len(draw(STRAIGHT, strewn=0).cylinders) + 3


def test_the_same_seed_draws_the_same_tunnel_and_another_seed_another() -> None:
    assert np.array_equal(draw(BENT, 4).cylinders, draw(BENT, 4).cylinders)
    assert not np.array_equal(draw(BENT, 4).cylinders[:3], draw(BENT, 5).cylinders[:3])


def test_a_mirrored_tunnel_is_the_exact_mirror() -> None:
    here, there = draw(BENT, 2), draw(BENT, 2, mirror="always")
    flip = np.array([1.0, -1.0])
    assert np.array_equal(there.cylinders, here.cylinders * flip)
    assert np.array_equal(there.centre, here.centre * flip)
    assert np.array_equal(there.walls[0], here.walls[1] * flip)
    assert np.array_equal(there.walls[1], here.walls[0] * flip)


def test_about_half_of_all_tunnels_are_mirrored_by_chance() -> None:
    left = sum(draw(BENT, seed, mirror="random", strewn=0).centre[2, 1] > 0 for seed in range(60))
    assert 15 <= left <= 45  # outside with a chance of 3e-5


def test_the_centre_line_turns_left_by_its_angles() -> None:
    corner = geometry.centre_line(TunnelParams(segments=(1.0, 2.0), turns_deg=(90.0,)))
    assert corner == pytest.approx(np.array([[0, 0], [1, 0], [1, 2]]))


@pytest.mark.parametrize("distance", [0.2, -0.3])
def test_every_point_of_a_moved_line_keeps_its_distance(distance: float) -> None:
    line = geometry.centre_line(BENT)
    moved = np.concatenate(geometry.offset_corners(line, distance))
    dense = geometry.resample(moved, np.linspace(0.0, 2.5, 60))
    gaps = np.array([gap_to_line(p, line) for p in dense])
    assert gaps.min() == pytest.approx(abs(distance), abs=1e-9)
    assert gaps.max() <= abs(distance) / math.cos(math.radians(45)) + 1e-9  # at the mitre of 90 deg


def test_the_left_line_lies_on_the_left() -> None:
    moved = np.concatenate(geometry.offset_corners(np.array([[0.0, 0.0], [1.0, 0.0]]), 0.2))
    assert moved == pytest.approx(np.array([[0.0, 0.2], [1.0, 0.2]]))


def test_a_rounded_corner_touches_both_walls_and_keeps_its_radius() -> None:
    line = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    outer = np.concatenate(geometry.offset_corners(line, -0.2, corner_radius=0.15))
    centre = np.array([1.2 - 0.15, -0.2 + 0.15])
    assert np.linalg.norm(outer[1:-1] - centre, axis=1) == pytest.approx(
        np.full(len(outer) - 2, 0.15)
    )
    assert outer[1] == pytest.approx([1.05, -0.2])
    assert outer[-2] == pytest.approx([1.2, -0.05])


def test_the_inner_corner_is_never_rounded() -> None:
    line = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    inner = np.concatenate(geometry.offset_corners(line, 0.2, corner_radius=0.15))
    assert inner[1] == pytest.approx([0.8, 0.2])


@pytest.mark.parametrize(
    ("where", "expected"),
    [
        ((0.3, 0.1), 0.3),
        ((1.1, 0.7), 1.7),
        ((-0.4, 0.2), -0.4),
        ((1.0, 2.5), 3.5),
        ((1.2, -0.2), 1.0),
    ],
)
def test_progress_runs_along_the_line_and_straight_on_past_its_ends(
    where: tuple[float, float], expected: float
) -> None:
    line = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.5]])
    assert geometry.progress(line, np.array(where)) == pytest.approx(expected)
