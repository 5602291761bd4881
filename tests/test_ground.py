"""Ground that is not flat: heights, starts, exits, refused sizes, and robots on their backs."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from antennate.cli import main
from antennate.cli.terminal import BAD_INPUT
from antennate.errors import SimulationError
from antennate.experiments.tunnel.experiment import EXPERIMENT
from antennate.experiments.tunnel.physics import TrialMonitor, TunnelConfig
from antennate.params.gaits import GaitParams
from antennate.params.scene import GroundParams, PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.episode import LOOK_EVERY, Episode, Judge
from antennate.sim.places import HEIGHT_LIMIT
from antennate.sim.scenes.ground import Edge, Ground, GroundScene
from antennate.sim.scenes.registry import make_scene
from antennate.sim.scenes.scene import FlatScene
from antennate.sim.trial import draw_trial, make_world, place_at_start, scene_of
from antennate.sim.world import World, new_spec
from antennate.testing import check_scene
from antennate.types import Floats

ROBOT = RobotSpec.named("scuttle3d")
NAMES = ("step_up", "step_down", "stairs", "gap", "ramp", "rubble")
AXLE = ROBOT.leg_radius + ROBOT.leg_eccentricity
"""Height of the head above level ground [m]: of the axles of legs that are at their longest."""
HIGHEST = 2.0
"""Height from which rays are cast [m]."""


def drawn(name: str, seed: int = 0, **sizes: Any) -> Ground:
    scene = GroundScene(name, GroundParams(**sizes))
    return scene.draw(ROBOT, np.random.default_rng(seed))


def heights(scene: Ground, places: Floats) -> Floats:
    """What a ray that falls at places x, y [m] of shape (n, 2) meets [m]."""
    spec = new_spec(PhysicsParams())
    scene.build(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom, down = np.zeros(1, np.int32), np.array([0.0, 0.0, -1.0])
    rays = (np.array([x, y, HIGHEST]) for x, y in places.tolist())
    lengths = [mujoco.mj_ray(model, data, ray, down, None, 1, -1, geom) for ray in rays]
    return HIGHEST - np.array(lengths)


def test_all_of_them_keep_the_protocol_for_both_robots() -> None:
    for name in NAMES:
        check_scene(make_scene(name))
        check_scene(make_scene(name), robot=ROBOT)


PROFILES: dict[str, list[tuple[float, float]]] = {
    "step_up": [(-1.0, 0.0), (-0.01, 0.0), (0.01, 0.1), (1.0, 0.1)],
    "step_down": [(-1.0, 0.1), (-0.01, 0.1), (0.01, 0.0), (1.0, 0.0)],
    "stairs": [(-0.01, 0.0), (0.01, 0.1), (0.29, 0.1), (0.31, 0.2), (0.61, 0.3), (1.5, 0.3)],
    "gap": [(-1.0, 0.35), (-0.01, 0.35), (0.01, 0.0), (0.09, 0.0), (0.11, 0.35), (1.0, 0.35)],
}
"""Heights [m] by distance from the first edge [m], of the sizes that are the default."""


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("y", [-1.1, 0.0, 0.7])
def test_rays_that_fall_meet_the_ground_at_its_height(name: str, y: float) -> None:
    scene = drawn(name, seed=4)
    x, expected = np.array(PROFILES[name]).T
    x += scene.edges[0].x
    found = heights(scene, np.column_stack([x, np.full_like(x, y)]))
    assert found == pytest.approx(expected, abs=1e-9)
    assert [scene.height(at) for at in x] == pytest.approx(expected)
    assert (scene.ground, scene.top) == pytest.approx((expected[0], expected.max()))


@pytest.mark.parametrize("slope", [5.0, 15.0, 40.0])
def test_a_ramp_rises_as_its_slope_says_and_meets_the_level_behind_it(slope: float) -> None:
    scene = drawn("ramp", slope=slope, height=0.12)
    end = scene.edges[0].x
    way = 0.12 / math.tan(math.radians(slope))
    x = np.array([end - way - 0.05, end - 0.75 * way, end - 0.25 * way, end - 1e-4, end + 0.3])
    found = heights(scene, np.column_stack([x, np.zeros(5)]))
    assert found == pytest.approx([0.0, 0.03, 0.09, 0.12, 0.12], abs=1e-4)


def test_rubble_covers_its_share_of_the_field_with_blocks_of_its_height() -> None:
    """Blocks at random: of a field a share 1 - exp(-density × area of one) is covered."""
    scene = drawn("rubble", density=100.0, block=0.03)
    first, last = 0.95, 1.7  # all draws of the first edge have begun by then
    grid = np.stack(np.meshgrid(np.linspace(first, last, 80), np.linspace(-1, 1, 80)), axis=-1)
    found = heights(scene, grid.reshape(-1, 2))
    assert found.min() == 0.0
    assert found.max() <= 0.03 + 1e-9
    lower = found[found > 0]
    assert lower.min() >= 0.015 - 1e-9
    area = (2 * (0.015 + 0.04) / 2) ** 2
    assert (found > 0).mean() == pytest.approx(1 - math.exp(-100.0 * area), abs=0.05)
    assert scene.top == pytest.approx(0.03, abs=0.001)
    assert not heights(drawn("rubble", density=0.0), grid.reshape(-1, 2)).any()


@pytest.mark.parametrize("name", [name for name in NAMES if name != "rubble"])
def test_the_first_edge_is_within_its_range_and_the_exit_a_body_length_behind_the_last(
    name: str,
) -> None:
    scenes = [drawn(name, seed) for seed in range(200)]
    first = [edge.edges[0].x for edge in scenes]
    if name == "ramp":
        first = [x - 0.1 / math.tan(math.radians(15.0)) for x in first]
    assert GroundParams().start == (0.35, 0.95)
    assert min(first) >= 0.35
    assert max(first) <= 0.95
    assert np.mean(first) == pytest.approx(0.65, abs=0.05)  # uniform: 0.17 / √200 = 0.012
    for scene in scenes[:5]:
        last = scene.edges[-1].x
        assert scene.length == pytest.approx(last + ROBOT.length)
        judge = Judge(scene)
        assert judge.look(np.array([scene.length - 0.01, 0.0])) is None
        assert judge.look(np.array([scene.length + 0.01, 0.0])) == "success"


@pytest.mark.parametrize("name", NAMES)
def test_a_robot_stands_at_the_start_and_touches_nothing_but_the_ground_under_it(
    name: str,
) -> None:
    config = TunnelConfig(scene=name, robot=ROBOT)
    for trial in range(3):
        start = draw_trial(config, scene_of(config), trial, GaitParams(), 0.01)
        world: World = start.world
        scene: Any = start.scene
        assert world.height_limit == pytest.approx(scene.top + HEIGHT_LIMIT)
        assert world.head[2] == pytest.approx(scene.ground + AXLE, abs=1e-9)
        world.step(500)
        assert world.head[2] == pytest.approx(scene.ground + AXLE, abs=1e-3)
        bodies = world.model.geom_bodyid[world.data.contact.geom]
        touching = {world.model.body(i).name for i in bodies.ravel() if i}
        assert touching
        assert all("leg" in body for body in touching)


def test_a_lowered_antenna_touches_the_floor_and_bends_upwards() -> None:
    scene = FlatScene().draw(ROBOT, np.random.default_rng(0))
    world = make_world(PhysicsParams(), ROBOT, scene)
    place_at_start(world, scene, GaitParams())
    drive = np.zeros(len(ROBOT.ids))
    drive[-2:] = -0.6
    world.command(drive)
    world.step(1500)
    bends = world.bends().reshape(2, -1)[:, :-1].sum(axis=1)
    assert (bends > 0.1).all()


def test_the_height_that_no_head_has_counts_from_the_highest_ground() -> None:
    robot, scene = ROBOT, drawn("stairs")
    for x, raised, sound in ((0.0, 0.5, True), (0.0, 0.7, False)):
        world = make_world(PhysicsParams(), robot, scene)
        world.place(x, 0.0, 0.0, np.zeros(5), np.zeros((6, 2)), raised)
        if sound:
            world.step(1)
            continue
        with pytest.raises(SimulationError, match=r"the head is at a height of 0\.7"):
            world.step(1)


REFUSED = [
    (["--scene", "step_up", "--ground.height", "0"], "ground.height: expected"),
    (["--scene", "step_up", "--ground.height", "0.6"], "ground.height: expected"),
    (["--scene", "stairs", "--ground.steps", "0"], "ground.steps: expected"),
    (["--scene", "stairs", "--ground.tread", "0.04"], "ground.tread: expected"),
    (["--scene", "ramp", "--ground.slope", "50"], "ground.slope: expected"),
    (["--scene", "rubble", "--ground.block", "-0.01"], "ground.block: expected"),
    (["--scene", "gap", "--ground.start", "0.2", "0.5"], "start must rise from at least 0.25"),
    (["--scene", "gap", "--ground.start", "0.9", "0.5"], "found 0.9 and 0.5"),
    (["--scene", "gap", "--ground.width", "nan"], "ground.width: expected"),
    (["--scene", "step_up", "--ground.width", "0.2"], "it belongs to the scenes gap"),
    (["--scene", "gap", "--ground.height", "0.2"], "step_up, step_down, stairs, ramp"),
    (["--ground.height", "0.2"], "step_up, step_down, stairs, ramp"),
]


@pytest.mark.parametrize(("words", "said"), REFUSED)
@pytest.mark.parametrize("command", ["tunnel", "twin"])
def test_a_size_that_is_bad_or_not_read_is_refused_in_one_line(
    words: list[str], said: str, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, *words]) == BAD_INPUT
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1


def on_its_back(world: World, share: float = 1.0) -> Any:
    """A world whose first links, such a share of them, have their undersides up."""
    world.data.xmat[world.places.links[: round(share * 6)], 8] = -0.7
    return world


def looked(monitor: TrialMonitor, world: Any) -> Any:
    """How a trial has ended for a robot that stands so until it is looked at."""
    return [monitor.tick(world, 0) for _ in range(LOOK_EVERY)][-1]


def watched(name: str) -> tuple[World, TrialMonitor]:
    """A robot at the start of a scene, and who says how its trial ends: not yet."""
    scene = make_scene(name).draw(ROBOT, np.random.default_rng(0))
    world = make_world(PhysicsParams(), ROBOT, scene)
    place_at_start(world, scene, GaitParams())
    mujoco.mj_kinematics(world.model, world.data)
    monitor = TrialMonitor(Episode(scene, 10.0), "open")
    assert looked(monitor, world) is None
    return world, monitor


@pytest.mark.parametrize(
    ("name", "share", "outcome"),
    [
        ("step_up", 1.0, "overturned"),
        ("rubble", 0.7, "overturned"),
        ("step_up", 0.5, None),
        ("flat", 1.0, None),
        ("tunnel", 1.0, None),
    ],
)
def test_robots_on_their_backs_have_overturned_where_the_ground_is_not_flat(
    name: str, share: float, outcome: str | None
) -> None:
    world, monitor = watched(name)
    assert looked(monitor, on_its_back(world, share)) == outcome


@pytest.mark.parametrize(
    ("name", "lower", "outcome"),
    [
        ("gap", 0.15, None),  # as low as after a step that is walked down
        ("gap", 0.18 + AXLE, "fell"),
        ("step_down", 0.18 + AXLE, "fell"),
        ("flat", 0.3, None),
        ("tunnel", 0.3, None),
    ],
)
def test_a_robot_with_one_link_far_below_the_ground_where_it_began_has_fallen(
    name: str, lower: float, outcome: str | None
) -> None:
    """The criterion, on its tail that is lowered by hand; flat floors have nothing below them."""
    world, monitor = watched(name)
    world.data.xpos[world.places.links[-1], 2] -= lower
    assert looked(monitor, world) == outcome


def test_who_walks_into_a_wide_gap_falls_and_that_is_a_failure_of_the_table() -> None:
    config = TunnelConfig(
        scene="gap",
        robot=ROBOT,
        trials=2,
        controllers=("open",),
        time_limit=30.0,
        ground=GroundParams(width=0.5),
    )
    result = EXPERIMENT.run(config).result()
    row = result.controllers["open"]
    assert (row.fell, row.successes, row.success_share) == (2, 0, 0.0)
    assert row.restricted_mean_time_s == 30.0
    assert ("fell", ["2"]) in EXPERIMENT.tables(result)[0].rows


def test_who_is_out_has_succeeded_on_its_back_too() -> None:
    scene = Ground([Edge(0.4, 0.1)], 0.72)
    monitor = TrialMonitor(Episode(scene, 10.0), "open")
    world: Any = SimpleNamespace(t=0.1, overturned=True, obstacle_force=lambda: 0.0)
    world.head, world.bends = np.array([1.13, 0.0, 0.1]), lambda: np.zeros(0)
    assert looked(monitor, world) == "success"
