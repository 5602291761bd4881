"""The distribution of corridors and the hard set: what is drawn can stand."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from antennate import simulate
from antennate.cli import main
from antennate.control.registry import make_controller
from antennate.errors import ConfigError, SceneError
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.params.control import ControlParams
from antennate.params.scene import CorridorsParams, VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.episode import Judge, time_limit_of
from antennate.sim.scenes import geometry
from antennate.sim.scenes.corridors import CorridorsScene
from antennate.sim.scenes.geometry import Arm, Plan, Room
from antennate.sim.scenes.registry import SHIPPED, make_scene
from antennate.sim.scenes.tunnel import HARD, Tunnel
from antennate.sim.trial import (
    TrialConfig,
    draw_scene,
    draw_trial,
    make_world,
    scene_of,
    variation_of,
)
from antennate.sim.warp.robot import PaddedTunnels
from antennate.testing import check_scene
from antennate.types import AntennaFrame, Floats, Maneuver

ROBOT = RobotSpec()
DRAWS = 60


def draws(params: CorridorsParams | None = None, count: int = DRAWS) -> list[Tunnel]:
    scene = CorridorsScene(params)
    return [scene.draw(ROBOT, np.random.default_rng(seed)) for seed in range(count)]


DRAWN = draws()


def turns(route: Floats) -> Floats:
    """Turns of a polyline [deg], shape (n - 2,)."""
    headings = np.arctan2(*np.diff(route, axis=0).T[::-1])
    return np.degrees((np.diff(headings) + math.pi) % (2 * math.pi) - math.pi)


def test_draws_keep_to_the_ranges_and_fill_them() -> None:
    pieces = [len(scene.route) - 1 for scene in DRAWN]
    lengths = np.concatenate([np.hypot(*np.diff(scene.route, axis=0).T) for scene in DRAWN])
    angles = np.concatenate([turns(scene.route) for scene in DRAWN])
    widths = np.array([scene.params.free_width for scene in DRAWN])
    masses = np.array([scene.params.cylinder.mass for scene in DRAWN])
    assert set(pieces) == {1, 2, 3, 4}
    assert (lengths.min() >= 0.5, lengths.max() <= 3.0) == (True, True)
    assert np.abs(angles).max() <= 120.0 + 1e-9
    assert np.abs(angles).min() < 1e-9, "straight ones too"
    assert (angles.min() < -60, angles.max() > 60) == (True, True)
    for found, low, high in ((widths, 0.36, 0.6), (masses, 0.05, 0.5)):
        assert (low <= found).all()
        assert (found <= high).all()
        assert found.min() < low + 0.2 * (high - low)
        assert found.max() > high - 0.2 * (high - low)


def test_the_limit_is_proportional_to_the_way() -> None:
    """Paper: 100 s for 2 m."""
    for scene in DRAWN:
        assert scene.time_limit == pytest.approx(100.0 * scene.length / 2.0, abs=0.051)
        assert time_limit_of(scene, None) == scene.time_limit
        assert time_limit_of(scene, 7.0) == 7.0
    short = draws(CorridorsParams(pace=10.0), 3)
    assert [s.time_limit for s in short] == pytest.approx([10 * s.length for s in short], abs=0.051)


def apart(points: Floats, others: Floats) -> float:
    """Least distance between two sets of points [m]."""
    return float(np.hypot(*(points[:, None] - others[None]).transpose(2, 0, 1)).min())


def dense(line: Floats) -> Floats:
    """Points every 2 cm of a polyline."""
    length = np.hypot(*np.diff(line, axis=0).T).sum()
    return geometry.resample(line, np.arange(0.0, length, 0.02))


def test_no_wall_stands_in_the_way() -> None:
    """All along the centre line, and 0.8 m before the entrance, walls are half a width away."""
    for scene in DRAWN:
        behind = np.array([[-0.8, 0.0], [0.0, 0.0]])
        away = scene.params.wall_distance - 0.011  # half a step of the points
        for wall in scene.walls:
            assert apart(dense(wall), dense(scene.route)) > away
            assert apart(dense(wall), dense(behind)) > away


def test_left_and_right_walls_never_meet() -> None:
    for scene in DRAWN:
        left, right = map(dense, scene.walls)
        assert apart(left, right) > 0.3, "narrowest: the exit, 0.36 m and more with its lining"
        assert not any(scene.left(point) for point in dense(scene.route)[:-1])


def test_some_have_a_room_or_a_blind_arm() -> None:
    """A corridor without either has as many corners in its walls as in its centre line."""
    many = draws(count=150)
    more = [len(s.walls[0]) + len(s.walls[1]) - 2 * len(s.route) for s in many]
    rooms, arms = (np.mean([extra == points for extra in more]) for points in (8, 2))
    params = CorridorsParams()
    half = 1.96 * math.sqrt(0.2 * 0.8 / len(many)) + 0.02
    assert abs(rooms - params.room_share) < half
    assert abs(arms - params.arm_share * 3 / 4) < half, "one draw in four has no turn"
    assert set(more) == {0, 2, 8}
    assert not any(
        len(s.walls[0]) - len(s.route)
        for s in draws(CorridorsParams(room_share=0.0, arm_share=0.0), 9)
    )


def test_a_room_and_an_arm_by_hand() -> None:
    """Drawn on paper: a corridor 0.4 m wide along x, which turns to the left at 2 m."""
    centre = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
    room = Plan(centre, 0.4, rooms=(Room(1, 0.5, 1.5, 1.2, gap=0.5),))
    left = [(0, 0.2), (1.8, 0.2), (1.8, 0.5), (1.4, 0.5), (1.4, 1.5), (1.75, 1.5), (1.75, 2)]
    assert room.line(0.2) == pytest.approx(np.array(left, float))
    arm = Plan(centre, 0.4, arms=(Arm(0, 1.0),))
    right = [(0, -0.2), (3, -0.2), (3, 0.2), (2.2, 0.2), (2.2, 2)]
    assert arm.line(-0.2) == pytest.approx(np.array(right, float))
    assert arm.line(0.2) == pytest.approx(np.array([(0, 0.2), (1.8, 0.2), (1.8, 2)], float))
    lined = arm.line(-0.3)
    assert lined[1].tolist() == pytest.approx([3.1, -0.3]), "walls stand behind the free floor"


@pytest.mark.parametrize(
    ("centre", "sound"),
    [
        ([(0, 0), (2, 0)], True),
        ([(0, 0), (1, 0), (1, 1), (0, 1)], True),
        ([(0, 0), (1, 0), (1, 0.5), (0, 0.5)], False),  # narrower than two half widths
        ([(0, 0), (2, 0), (2, 1.5), (1, 1.5), (1, -1)], False),  # through itself
        ([(0, 0), (2, 0), (2, 1.5), (1, 1.5), (1, 0.6)], False),  # onto its own wall
        ([(0, 0), (1, 0), (1, 1), (-1, 1), (-1, -1)], False),  # before its own entrance
    ],
)
def test_a_passage_that_runs_into_itself_is_known(centre: Any, sound: bool) -> None:
    plan = Plan(np.array(centre, float), 0.4)
    assert plan.is_sound(0.35, behind=0.8, ahead=0.4) is sound


@pytest.mark.parametrize("name", ["corridors", "room", "deadend"])
def test_named_scenes_keep_the_protocol(name: str) -> None:
    check_scene(make_scene(name))


@pytest.mark.parametrize("name", HARD)
def test_a_fixed_first_turn_cannot_win(name: str) -> None:
    """Mirrored at random: each side in about half of the draws."""
    scene = make_scene(name)
    sides = [turns(scene.draw(ROBOT, np.random.default_rng(s)).route)[0] > 0 for s in range(40)]  # type: ignore[attr-defined]
    assert 10 <= sum(sides) <= 30


def test_all_scenes_that_are_shipped_have_a_route() -> None:
    for name in SHIPPED:
        scene = make_scene(name).draw(ROBOT, np.random.default_rng(1))
        route: Floats = scene.route  # type: ignore[attr-defined]
        assert route[0].tolist() == pytest.approx(list(scene.start[:2]))
        assert route[-1].tolist() == pytest.approx(scene.exit.mean(axis=0).tolist())
        assert np.hypot(*np.diff(route, axis=0).T).sum() == pytest.approx(scene.length)


def test_the_hard_set_is_what_it_says() -> None:
    drawn = {name: HARD[name]().draw(ROBOT, np.random.default_rng(0)) for name in HARD}
    assert np.abs(turns(drawn["corner"].route)).tolist() == pytest.approx([120.0])
    one, other = turns(drawn["uturn"].route)
    assert (abs(one), one) == pytest.approx((90.0, other)), "both to one side"
    width, depth = np.ptp(np.concatenate(drawn["room"].walls)[:, 0]), drawn["room"].route[-1]
    assert width > 1.2
    assert abs(depth[1]) > 1.6
    assert np.hypot(*np.diff(drawn["room"].exit, axis=0)[0]) == pytest.approx(0.5)
    walls = np.concatenate(drawn["deadend"].walls)
    assert walls[:, 0].max() == pytest.approx(1.8 + 0.14), "its lining ends at 1.8 m"
    assert drawn["heavy"].params.cylinder.mass == 0.5


def trial_of(name: str, seed: int = 0, **changes: Any) -> Any:
    config = TunnelConfig(scene=name, seed=seed, **changes)
    return draw_trial(config, scene_of(config), 0, config.control.gait, config.control.period)


def test_a_noisy_scene_has_three_times_the_noise_and_no_other_change() -> None:
    plain, noisy = trial_of("tunnel"), trial_of("noisy")
    assert (plain.scene.cylinders == noisy.scene.cylinders).all()
    assert (plain.chance.joint_bias == noisy.chance.joint_bias).all()
    assert noisy.chance.noise_block() == pytest.approx(3.0 * plain.chance.noise_block())


def test_a_broken_scene_draws_the_side() -> None:
    sides = [trial_of("broken", seed).chance.bends.tolist() for seed in range(12)]
    assert {tuple(side) for side in sides} == {(0.0, 1.0), (1.0, 0.0)}
    assert trial_of("tunnel").chance.bends.tolist() == [1.0, 1.0]
    left = trial_of("tunnel", variation=VariationParams(broken="left"))
    assert left.chance.bends.tolist() == [0.0, 1.0]


def test_what_a_scene_sets_cannot_be_set_otherwise() -> None:
    config = TrialConfig(scene="noisy", variation=VariationParams(reading_noise=2.0))
    with pytest.raises(SceneError, match=r"variation\.reading_noise.*'noisy' sets it, found 2"):
        variation_of(config, scene_of(config))
    config = TrialConfig(scene="noisy", variation=VariationParams(start_lateral=0.0))
    assert variation_of(config, scene_of(config)).start_lateral == 0.0


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"pieces": (3, 1)}, "pieces must rise"),
        ({"free_width": (0.4, 9.0)}, "free_width must rise"),
        ({"room_share": 0.7, "arm_share": 0.6}, "exceed 1 together"),
        ({"largest_turn": 30.0}, "at least arm_turn"),
    ],
)
def test_ranges_that_make_no_sense_are_refused(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        CorridorsParams(**changes)


def test_what_cannot_be_drawn_is_said() -> None:
    tight = CorridorsParams(pieces=(4, 4), length=(0.3, 0.3), free_width=(1.0, 1.0))
    with pytest.raises(SceneError, match="does not run into itself, found none"):
        draws(tight, 1)
    with pytest.raises(ConfigError, match=r"corridors\.pieces.*belongs to the scene 'corridors'"):
        TrialConfig(corridors=CorridorsParams(pieces=(1, 1)))
    with pytest.raises(ConfigError, match=r"corridors\.free_width must be at least robot\.width"):
        TrialConfig(scene="corridors", corridors=CorridorsParams(free_width=(0.15, 0.4)))


def test_a_run_shows_shares_of_each_limit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["tunnel", "--scene", "corridors", "--trials", "3", "--controllers", "open", "closed"]
    words += [
        "--corridors.room-share",
        "0",
        "--corridors.pieces",
        "1",
        "1",
        "--corridors.length",
        "0.5",
        "1.5",
    ]
    words += ["--corridors.pace", "0.3", "--no-figures", "--workers", "1"]
    assert main([*words, "--out", str(tmp_path / "run")]) == 0
    printed = capsys.readouterr().out
    assert "% of limit" in printed
    with (tmp_path / "run" / "trials.csv").open() as file:
        rows = list(csv.DictReader(file))
    limits = {row["trial"]: float(row["limit_s"]) for row in rows}
    assert len(set(limits.values())) > 1
    assert all(float(row["limit_s"]) == limits[row["trial"]] for row in rows), "paired"
    assert all(float(row["time_s"]) == float(row["limit_s"]) for row in rows), "all too slow"
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["time_limit_s"] is None
    assert result["controllers"]["open"]["restricted_mean_share"] == 1.0
    assert result["controllers"]["open"]["restricted_mean_time_s"] is None
    assert result["paired"]["open-closed"]["share_difference"] == 0.0
    assert result["paired"]["open-closed"]["time_difference_s"] is None


def test_shares_are_of_the_limit_of_each_trial() -> None:
    from antennate.experiments.tunnel import result as measures
    from antennate.experiments.tunnel.physics import TrialResult
    from antennate.studies.pooling import frame

    def row(name: str, trial: int, time: float, limit: float) -> TrialResult:
        ended = "success" if time < limit else "timeout"
        how: Any = {"outcome": ended, "time_s": time, "limit_s": limit}
        return TrialResult(seed=0, trial=trial, controller=name, **how)

    slow = [row("slow", 0, 80.0, 100.0), row("slow", 1, 50.0, 50.0)]
    fast = [row("fast", 0, 40.0, 100.0), row("fast", 1, 15.0, 50.0)]
    assert measures.limit_of(frame([*slow, *fast]), None) is None
    assert measures.limit_of(frame([slow[0], fast[0]]), None) == 100.0
    assert measures.summary(frame(slow), None).restricted_mean_share == pytest.approx(0.9)
    pair = measures.paired({"slow": frame(slow), "fast": frame(fast)}, None)["slow-fast"]
    assert pair.share_difference == pytest.approx((0.4 + 0.7) / 2)
    assert (pair.both, pair.both_time_s) == (1, (80.0, 40.0))


@pytest.mark.parametrize("controller", ["open", "paper", "closed"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_robot_with_an_open_wire_stands_in_simulation_too(controller: str, side: str) -> None:
    """An open flex sensor is the upper half of a divider: its pin reads 0, which says nothing."""
    made = make_controller(controller, ControlParams(), ROBOT, 2)
    made.reset(np.arange(2), 0.0)
    counts = np.full((2, 2), 1800.0)
    counts[1, ["left", "right"].index(side)] = 0.0
    for tick in range(300):
        command = made.step(AntennaFrame(np.full(2, 0.01 * tick), counts))
    assert made.maneuver.tolist() == [Maneuver.FORWARD, Maneuver.HOLD]  # type: ignore[attr-defined]
    assert np.abs(np.diff(command.leg, axis=0)).max() > 1.0, "only the first has walked"


def test_no_trial_is_crossed_on_open_wires() -> None:
    """A flex sensor of 1 GOhm is as good as none."""
    robot = {"antenna": {"sensor": {"flat_resistance": 1e9}}}
    series = simulate("closed", robot=robot, time_limit=6.0)
    assert set(series.maneuver.tolist()) == {Maneuver.HOLD}
    assert series.meta["outcome"] == "timeout"


def test_a_batch_on_a_gpu_gets_corridors_of_one_structure_and_judges_them_alike() -> None:
    """Walls and cylinders that a draw lacks are parked far away; who crosses its exit succeeds."""
    config = TunnelConfig(scene="corridors", corridors=CorridorsParams(length=(0.5, 1.5)))
    scene = scene_of(config)
    plain = [draw_scene(config, scene, trial) for trial in range(3)]
    padded = PaddedTunnels(scene, plain)
    drawn = [draw_scene(config, padded, trial) for trial in range(3)]
    models = [make_world(config.physics, config.robot, each).model for each in drawn]
    assert len({(model.ngeom, model.nbody, bytes(model.names)) for model in models}) == 1
    for alone, filled in zip(plain, drawn, strict=True):
        assert time_limit_of(filled, None) == time_limit_of(alone, None)
        assert (filled.exit == alone.exit).all()
        end, before = alone.exit.mean(axis=0), alone.route[-2]  # type: ignore[attr-defined]
        past = end + 0.01 * (end - before) / np.hypot(*(end - before))
        for one in (alone, filled):
            judge = Judge(one)
            assert [judge.look(head) for head in (before, end - (past - end), past)][
                -1
            ] == "success"
