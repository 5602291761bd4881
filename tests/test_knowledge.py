"""What a simulation knows and gives to controllers: what it is, who takes it, who refuses it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from antennate.control.knowledge import Knowledge
from antennate.control.loop import Retunable
from antennate.control.registry import make_controller
from antennate.errors import ConfigError, LogError, SceneError
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.experiment import EXPERIMENT, check
from antennate.experiments.tunnel.lockstep import Apparatus
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.params.control import ControlParams, GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.knowledge import (
    Truths,
    angle_ahead,
    edges_near,
    is_facing,
    is_free,
    mean_direction,
    side_ahead,
)
from antennate.sim.scenes.registry import SCENES
from antennate.sim.scenes.scene import FlatScene, Route, SceneInstance
from antennate.sim.trial import make_world, place_at_start
from antennate.sim.world import World
from antennate.studies.simulate import simulate
from antennate.telemetry.reader import LogReader
from antennate.telemetry.replay import recorded_controller
from antennate.types import AntennaFrame, Maneuver

CORNER = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
"""A route with a corner of 90 degrees to the left after 1 m."""
SHORT: dict[str, Any] = {"trials": 3, "time_limit": 6.0, "seed": 5}


class Walled(Route):
    """The corner with a box across its first piece, from 0.5 m on."""

    def build(self, spec: Any) -> None:
        super().build(spec)
        spec.worldbody.add_geom(type=6, size=[0.1, 0.5, 0.1], pos=[0.6, 0.0, 0.1])


class Pathless:
    """A scene whose instances have no route."""

    random = False

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Any:
        plain = FlatScene().draw(robot, rng)
        names = ("start", "length", "exit", "build", "progress", "left")
        return type("Bare", (), {name: getattr(plain, name) for name in names})()


class Asked:
    """A controller that uses the side alone, and cannot do without."""

    knows = needs = ("side",)

    def __init__(self, control: Any, robot: RobotSpec, batch: int) -> None:
        self._inner = make_controller("open", control, robot, batch)
        self.got: list[Knowledge] = []
        self.reset = self._inner.reset

    def know(self, knowledge: Knowledge) -> None:
        self.got.append(knowledge)

    def step(self, frame: AntennaFrame) -> Any:
        return self._inner.step(frame)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


@pytest.fixture
def pathless() -> Any:
    SCENES.add("pathless", Pathless)
    yield "pathless"
    SCENES.added.clear()


def placed(scene: SceneInstance, heading: float = 0.0) -> World:
    """The robot at the start of a scene, turned by a heading [rad]."""
    world = make_world(PhysicsParams(), RobotSpec(), scene)
    place_at_start(world, scene, GaitParams(), heading=heading)
    return world


# what is known


def test_the_point_ahead_lies_0_3_m_on_along_the_route() -> None:
    # 0.1 m before the corner the point is 0.2 m up the second piece: atan(0.2 / 0.1)
    assert angle_ahead(CORNER, np.array([0.9, 0.0]), 0.0) == pytest.approx(math.atan2(0.2, 0.1))
    assert angle_ahead(CORNER, np.array([0.2, 0.0]), 0.5) == pytest.approx(-0.5)
    assert angle_ahead(CORNER * [1, -1], np.array([0.9, 0.0]), 0.0) == pytest.approx(
        -math.atan2(0.2, 0.1)
    )
    # past the end it goes on straight
    assert angle_ahead(CORNER, np.array([1.0, 1.5]), math.pi / 2) == pytest.approx(0.0)


def test_the_side_is_that_of_the_corner_ahead() -> None:
    head = np.array([0.7, 0.0])  # the corner is 0.3 m ahead, as far as `map` looks
    assert angle_ahead(CORNER, head, 0.0) == pytest.approx(0.0)
    assert side_ahead(CORNER, head, 0.0) == 1
    assert side_ahead(CORNER * [1, -1], head, 0.0) == -1
    assert side_ahead(CORNER, head, math.pi / 2) == -1  # turned too far
    assert side_ahead(CORNER, np.array([0.2, 0.0]), 0.0) == 0


@pytest.mark.parametrize(
    ("where", "heading_deg", "facing"),
    [
        ((0.2, 0.0), 0.0, False),
        ((0.2, 0.0), 85.0, False),
        ((0.2, 0.0), 180.0, True),
        ((0.2, 0.0), -100.0, True),
        ((1.0, 0.8), 90.0, False),
        ((1.0, 0.8), -90.0, True),
        ((1.1, 0.1), -20.0, False),  # it looks into the outside of the corner
    ],
)
def test_a_head_that_is_turned_back_faces_the_entrance(
    where: tuple[float, float], heading_deg: float, facing: bool
) -> None:
    assert is_facing(CORNER, np.array(where), math.radians(heading_deg)) is facing


def test_the_way_is_free_where_no_obstacle_is_within_reach() -> None:
    scene = Walled(CORNER)
    world = placed(scene)
    assert is_free(world)  # the box begins at 0.5 m, the antennae reach some 0.16 m
    world.data.qpos[world.root] = 0.4
    world.place_drives(world.drives())  # brings the rest to where the head is
    assert not is_free(world)
    world.data.qpos[world.root + 3 : world.root + 7] = 0.0, 0.0, 0.0, 1.0  # about
    world.place_drives(world.drives())
    assert is_free(world)


def looked(world: World, scene: SceneInstance, maneuver: Maneuver, metres: float) -> list[bool]:
    """Whether it is jammed, look by look, over 4 s in which it moves some metres a second."""
    truths = Truths(("jam",), 1, 167.0)
    truths.begin(0, scene)
    found: list[bool] = []
    for _ in range(400):
        world.data.qpos[world.root] += metres * 0.01
        truths.look(0, world, maneuver)
        jam = truths.knowledge().jam
        assert jam is not None
        found.append(bool(jam[0]))
    return found


def test_a_jam_is_walking_for_a_gait_cycle_without_getting_on() -> None:
    scene = Route(CORNER)
    still = looked(placed(scene), scene, Maneuver.FORWARD, 0.0)
    assert not any(still[:160])
    assert all(still[180:])
    assert not any(looked(placed(scene), scene, Maneuver.FORWARD, 0.05))
    assert not any(looked(placed(scene), scene, Maneuver.REVERSE, 0.0))


def test_side_facing_and_map_of_a_robot_in_its_scene() -> None:
    scene = Route(CORNER)
    cases = (0.0, 0, False), (0.6, -1, False), (-0.6, 1, False), (3.0, -1, True)
    for heading, side, facing in cases:
        world, truths = placed(scene, heading), Truths(("side", "facing", "map"), 1, 167.0)
        truths.begin(0, scene)
        truths.look(0, world, Maneuver.FORWARD)
        known = truths.knowledge()
        assert known.side is not None
        assert known.facing is not None
        assert known.map is not None
        assert (known.side[0], known.facing[0]) == (side, facing)
        assert known.map[0] == pytest.approx(-heading, abs=1e-9)
        assert known.jam is None
        assert known.free is None


def test_the_side_does_not_swing_with_the_head() -> None:
    swung = [math.radians(25.0) * math.sin(2 * math.pi * i / 16) for i in range(16)]
    for heading in (0.4, math.pi - 0.01):
        mean = mean_direction([heading + each for each in swung])
        assert mean == pytest.approx(heading, abs=1e-9)


# who takes it


def walked(name: str, knowledge: Knowledge, seconds: float) -> list[int]:
    """The maneuvers of a controller that touches nothing and knows that all the time."""
    made: Any = make_controller(name)
    made.reset(np.array([0]))
    found: list[int] = []
    for tick in range(round(100 * seconds)):
        made.know(knowledge)
        made.step(AntennaFrame(np.array([0.01 * tick]), np.full((1, 2), 1872.0)))
        found.append(int(made.maneuver[0]))
    return found


@pytest.mark.parametrize("name", ["closed-1", "closed"])
def test_an_escape_goes_by_what_is_known(name: str) -> None:
    jam, no = np.array([True]), np.array([False])
    assert set(walked(name, Knowledge(jam=no), 9)) == {Maneuver.FORWARD}
    for side, turn in ((1, Maneuver.TURN_L), (-1, Maneuver.TURN_R)):
        done = walked(name, Knowledge(jam=jam, side=np.array([side])), 12)
        assert [m for m in (Maneuver.REVERSE, turn) if m in done] == [Maneuver.REVERSE, turn]
        assert set(done) <= {Maneuver.FORWARD, Maneuver.REVERSE, turn}
    assert set(walked(name, Knowledge(jam=jam, free=jam), 9)) == {Maneuver.FORWARD}
    assert set(walked(name, Knowledge(facing=jam), 9)) & {Maneuver.TURN_L, Maneuver.TURN_R}
    assert set(walked(name, Knowledge(facing=no), 9)) == {Maneuver.FORWARD}


def test_a_turn_ends_where_the_point_on_the_map_is_ahead() -> None:
    jam = np.array([True])
    # a turn ends where the point is ahead: it was off by a whole turn time otherwise
    ahead = walked("closed-1", Knowledge(jam=jam, map=np.array([0.05])), 4)
    turns = sum(m in (Maneuver.TURN_L, Maneuver.TURN_R) for m in ahead)
    assert turns <= 2


def test_map_turns_to_the_point_and_backs_off_when_jammed() -> None:
    no, yes = np.array([False]), np.array([True])
    assert set(walked("map", Knowledge(jam=no, map=np.array([0.2])), 3)) == {Maneuver.FORWARD}
    assert walked("map", Knowledge(jam=no, map=np.array([1.0])), 3)[-1] == Maneuver.TURN_L
    assert walked("map", Knowledge(jam=no, map=np.array([-1.0])), 3)[-1] == Maneuver.TURN_R
    assert walked("map", Knowledge(jam=yes, map=np.array([0.0])), 1)[-1] == Maneuver.REVERSE
    assert set(walked("map", Knowledge(), 1)) == {Maneuver.HOLD}


def test_a_controller_of_ones_own_gets_what_it_asks_for() -> None:
    made: list[Asked] = []

    def make(name: str, control: Any, robot: RobotSpec, batch: int) -> Any:
        made.append(Asked(control, robot, batch))
        return made[-1]

    config = TunnelConfig(**{**SHORT, "time_limit": 0.2})
    run_trials(config, "open", [0, 1], lambda row: None, apparatus=Apparatus(make))
    assert made[0].got
    for known in made[0].got:
        assert known.side is not None
        assert known.side.shape == (2,)
        assert known.map is None


def test_numbers_that_a_page_changes_leave_a_controller_its_knowledge() -> None:
    by_map = Retunable(lambda values: make_controller("map", values), ControlParams())
    assert by_map.needs == by_map.knows == ("jam", "map")
    by_map.know(Knowledge(jam=np.array([False]), map=np.array([1.0])))
    by_map.step(AntennaFrame(np.array([0.0]), np.full((1, 2), 1872.0)))
    assert by_map.maneuver[0] == Maneuver.TURN_L
    assert Retunable(lambda values: make_controller("open", values), ControlParams()).knows == ()


@pytest.mark.parametrize("knows", [("side", "jam"), ("map", "free")])
@pytest.mark.slow
def test_rows_do_not_depend_on_batch_and_workers(knows: tuple[Any, ...]) -> None:
    config = TunnelConfig(**SHORT, controllers=("closed-1",), knows=knows)
    alone: list[Any] = []
    run_trials(config, "closed-1", [0, 1, 2], lambda found: alone.append(found[0]), batch=1)
    assert EXPERIMENT.run(config).rows == alone
    assert EXPERIMENT.run(config, workers=2).rows == alone


@pytest.mark.slow
def test_map_crosses_tunnels_in_which_open_is_stuck() -> None:
    config = TunnelConfig(trials=6, seed=11, controllers=("open", "map"), time_limit=60.0)
    rows = EXPERIMENT.run(config).rows
    won = [row.controller for row in rows if row.outcome == "success"]
    assert won.count("map") == 6
    assert won.count("open") < 6


# who refuses it


@pytest.mark.parametrize(
    ("controllers", "knows"),
    [
        (("open",), ("side",)),
        (("closed-1", "paper"), ("jam",)),
        (("closed",), ("map",)),
        (("map",), ("free",)),
    ],
)
def test_a_controller_that_uses_nothing_of_it_is_refused(
    controllers: tuple[str, ...], knows: tuple[Any, ...]
) -> None:
    with pytest.raises(ConfigError, match="--knows"):
        check(TunnelConfig(controllers=controllers, knows=knows))


def test_a_scene_without_a_route_is_refused_where_it_is_needed(pathless: str) -> None:
    with pytest.raises(SceneError, match="route"):
        check(TunnelConfig(scene=pathless, controllers=("map",)))
    with pytest.raises(SceneError, match="side"):
        check(TunnelConfig(scene=pathless, controllers=("closed-1",), knows=("side", "jam")))
    check(TunnelConfig(scene=pathless, controllers=("closed-1",), knows=("jam", "free")))


@pytest.mark.parametrize(
    "route",
    ["abc", [[0.0, 0.0]], [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [np.nan, 1.0]]],
)
def test_a_route_that_is_no_line_is_refused(route: Any) -> None:
    class Crooked(Pathless):
        def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Any:
            drawn = super().draw(robot, rng)
            drawn.route = route
            return drawn

    SCENES.add("crooked", Crooked)
    try:
        with pytest.raises(SceneError, match=r"^scene: (expected )?route"):
            check(TunnelConfig(scene="crooked", controllers=("map",)))
    finally:
        SCENES.added.clear()


def test_a_log_says_what_was_known_and_is_not_replayed(tmp_path: Path) -> None:
    config = TunnelConfig(
        trials=1, time_limit=0.3, controllers=("closed-1",), knows=("jam", "side")
    )
    EXPERIMENT.run(config, logs=tmp_path)
    with LogReader(next(tmp_path.glob("*.mcap"))) as log:
        header = log.header
    assert header.knows == ("side", "jam")
    with pytest.raises(LogError, match="side, jam"):
        recorded_controller(header)
    assert recorded_controller(header, "paper") is not None
    with pytest.raises(ConfigError, match="map"):
        recorded_controller(header, "map")


def test_simulate_gives_nothing() -> None:
    with pytest.raises(ConfigError, match="map"):
        simulate("map", time_limit=0.1)


def test_an_edge_keeps_its_place_while_others_come_and_go() -> None:
    edges, length = np.arange(12) * 0.3 + 1.0, 0.72
    before = edges_near(edges, 0.0, length)
    assert not (before > -length).any()
    for x in np.arange(0.3, 6.0, 0.07):
        now = edges_near(edges, x, length)
        told = now[np.isfinite(now)]
        assert np.isin(np.round(told, 9), np.round(x - edges, 9)).all()
        near = edges[(edges > x) & (edges < x + 0.3)]  # the line begins to rise there
        assert np.isin(np.round(x - near[:1], 9), np.round(told, 9)).all()
        both = np.isfinite(now) & np.isfinite(before)
        moved = (now - before)[both] % 1.2  # another edge takes the place of one that is gone
        assert np.minimum(moved, 1.2 - moved) == pytest.approx(0.07 if x > 0.31 else 0.3)
        before = now
