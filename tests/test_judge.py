"""Who crosses the exit from inside succeeds; who walks round outside does not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from antennate.errors import SceneError
from antennate.params.scene import TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim.episode import Judge
from antennate.sim.scenes import geometry
from antennate.sim.scenes.mjcf import MjcfScene
from antennate.sim.scenes.scene import Route, SceneInstance
from antennate.sim.scenes.tunnel import Tunnel, TunnelScene
from antennate.types import Floats

LOOK = 0.01
"""A robot of 0.1 m/s between two looks [m]."""
CORNER = TunnelParams(turns_deg=(120.0,), mirror="never", strewn=0)
U_TURN = TunnelParams(segments=(1.0, 1.0, 1.0), turns_deg=(90.0, 90.0), mirror="never", strewn=0)
MJCF = """<mujoco><worldbody>
<site name="start"/><site name="via0" pos="1 0 0"/><site name="via1" pos="1 1 0"/>
<site name="exit" pos="0 1 0"/>
<geom type="box" size=".7 .02 .1" pos=".7 -.5 .1"/>
<geom type="box" size=".5 .02 .1" pos=".5 .5 .1"/>
</worldbody></mujoco>"""


def tunnel(params: TunnelParams) -> Tunnel:
    return TunnelScene(params).draw(RobotSpec(), np.random.default_rng(0))


def judged(scene: SceneInstance, corners: Sequence[Sequence[float]], step: float = LOOK) -> Any:
    """How a head ends that goes straight from corner to corner; None if it only went on."""
    points = np.array(corners, float)
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    judge = Judge(scene)
    ends: Iterable[str | None] = (
        judge.look(head) for head in geometry.resample(points, np.arange(0.0, length, step))
    )
    return next((end for end in ends if end is not None), None)


def past(route: Floats) -> list[list[float]]:
    """The route, and 0.1 m straight on."""
    along = route[-1] - route[-2]
    return [*route.tolist(), (route[-1] + 0.1 * along / np.hypot(*along)).tolist()]


@pytest.mark.parametrize("params", [TunnelParams(mirror="never"), CORNER, U_TURN])
@pytest.mark.parametrize("step", [LOOK, 0.05])
def test_who_follows_the_way_succeeds(params: TunnelParams, step: float) -> None:
    scene = tunnel(params)
    assert judged(scene, past(scene.route), step) == "success"
    assert judged(scene, scene.route.tolist(), step) is None, "not before the exit"


def test_who_follows_the_sites_of_a_file_succeeds(tmp_path: Path) -> None:
    scene = file_scene(tmp_path)
    assert judged(scene, past(scene.route)) == "success"


def file_scene(folder: Path) -> Route:
    path = folder / "scene.xml"
    path.write_text(MJCF)
    return MjcfScene(path).draw(RobotSpec(), np.random.default_rng(0))


AROUND = {
    # out by the entrance, round outside the walls, and past the line of the exit
    "120 deg, far outside": (CORNER, [(-0.1, 0), (-0.1, 0.7), (0.3, 0.7), (0.3, 1.5)]),
    "120 deg, nearest way": (CORNER, [(-0.1, 0), (0.2, 0.45), (0.2, 1.2)]),
    "U-turn": (U_TURN, [(-0.1, 0), (-0.2, 0.6), (-0.2, 1.0), (0.1, 1.0), (-0.2, 1.0)]),
}


@pytest.mark.parametrize("name", AROUND)
def test_who_walks_round_outside_a_tunnel_has_left(name: str) -> None:
    params, around = AROUND[name]
    for mirror in ("never", "always"):
        scene = tunnel(params.model_copy(update={"mirror": mirror}))
        way = [(x, -y if mirror == "always" else y) for x, y in [(0, 0), *around]]
        assert judged(scene, way) == "left"


def test_who_walks_round_outside_in_a_file_has_left(tmp_path: Path) -> None:
    scene = file_scene(tmp_path)
    assert judged(scene, [(0, 0), (-0.3, 0), (-0.3, 0.6), (-0.3, 1.0)]) == "left"
    assert judged(scene, [(0, 0), (0, -0.7), (1.6, -0.7), (1.6, 1.6), (-0.1, 1.6)]) == "left"


def test_who_comes_in_by_the_exit_has_to_go_out_twice() -> None:
    """The scene that says nothing of leaving shows what the judge counts."""

    class Open(Route):
        def left(self, head: Floats) -> bool:
            return False

    scene = Open(np.array([[0.0, 0.0], [1.0, 0.0]]))
    around = [(0, 0), (0, 0.7), (1.2, 0.7), (1.2, 0)]
    assert judged(scene, [*around, (0.8, 0)]) is None, "backwards, from outside"
    assert judged(scene, [*around, (0.8, 0), (1.2, 0)]) is None, "and out again"
    assert judged(scene, [*around, (0.8, 0), (1.2, 0), (1.2, 0.7), (0.5, 0.7), (0.5, 0)]) is None
    assert judged(scene, [(0, 0), (0, 0.7), (0.5, 0.7), (0.5, 0), (1.2, 0)]) == "success"


def test_between_two_looks_the_head_goes_straight() -> None:
    scene = Route(np.array([[0.0, 0.0], [1.0, 0.0]]))
    judge = Judge(scene)
    assert judge.look(np.array([0.9, 0.45])) is None
    assert judge.look(np.array([1.1, 0.54])) == "success", "half way it was at 0.495 m"
    judge = Judge(scene)
    assert judge.look(np.array([0.9, 0.45])) is None
    assert judge.look(np.array([1.1, 0.56])) == "left", "half way it was at 0.505 m, beside the end"


def test_a_way_that_crosses_what_lies_beyond_its_end_is_not_at_its_end() -> None:
    """Three turns to the left: what lies straight past the exit is the first piece."""
    route = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [1.5, 2.0], [1.5, 1.0]])
    scene = Route(route)
    assert scene.progress(np.array([1.5, 0.1])) == pytest.approx(1.5)
    assert judged(scene, past(route)) == "success"


def test_a_rule_of_success_of_ones_own_is_asked() -> None:
    class Half(Route):
        def succeeded(self, head: Floats) -> bool:
            return bool(head[0] > 0.5)

    class Beyond(Route):
        def succeeded(self, head: Floats) -> bool:
            return bool(head[0] > 1.3)

    route = np.array([[0.0, 0.0], [1.0, 0.0]])
    assert judged(Half(route), [(0, 0), (0.6, 2)]) == "left", "by then outside"
    assert judged(Half(route), [(0, 0), (0.6, 0)]) == "success"
    assert judged(Beyond(route), [(0, 0), (1.2, 0)]) is None
    assert judged(Beyond(route), [(0, 0), (1.4, 0)]) == "success"


@pytest.mark.parametrize("line", [[[0.0, 0.0]], [[0.0, 1.0], [0.0, np.nan]], "exit"])
def test_an_exit_that_is_no_line_is_said(line: Any) -> None:
    class Lineless(Route):
        exit = line

    with pytest.raises(SceneError, match="exit"):
        judged(Lineless(np.array([[0.0, 0.0], [1.0, 0.0]])), [(0, 0), (1, 0)])


class Robot:
    """What a judge looks at: a robot that lies with its head and its lowest link so."""

    t = 0.0

    def __init__(self, head: float, overturned: bool = False, lowest: float = 0.0) -> None:
        self.head, self.overturned, self.lowest = np.array([head, 0.0]), overturned, lowest

    def link_places(self) -> Floats:
        return np.array([[0.0, 0.0, 0.0], [0.0, 0.0, self.lowest]])


IN, OUT, BESIDE = 0.5, 1.1, -9.0
"""Heads on a way of 1 m: on it, past its exit, and far from it."""


@pytest.mark.parametrize(
    ("robot", "t", "flat", "anywhere", "outcome"),
    [
        (Robot(OUT), 4.9, True, False, "success"),
        (Robot(OUT), 5.0, True, False, "success"),
        (Robot(OUT), 5.000001, True, False, "timeout"),
        (Robot(IN), 4.9, True, False, None),
        (Robot(IN), 5.0, True, False, "timeout"),
        (Robot(BESIDE), 4.9, True, False, "left"),
        (Robot(BESIDE), 5.1, True, False, "timeout"),
        (Robot(OUT, overturned=True), 4.9, True, True, "success"),
        (Robot(IN, overturned=True), 4.9, True, True, "overturned"),
        (Robot(IN, overturned=True), 4.9, True, False, None),
        (Robot(IN, overturned=True), 4.9, False, False, "overturned"),
        (Robot(IN, overturned=True), 5.1, False, False, "timeout"),
        (Robot(IN, overturned=True, lowest=-0.2), 4.9, False, False, "overturned"),
        (Robot(IN, lowest=-0.2), 4.9, False, False, "fell"),
        (Robot(IN, lowest=-0.17), 4.9, False, False, None),
        (Robot(IN, lowest=-0.2), 4.9, True, False, None),
    ],
)
def test_how_an_episode_with_a_limit_of_5_s_ends(
    robot: Robot, t: float, flat: bool, anywhere: bool, outcome: str | None
) -> None:
    scene = Route(np.array([[0.0, 0.0], [1.0, 0.0]]))
    if not flat:
        scene.ground = 0.0  # type: ignore[attr-defined]
    judge = Judge(scene, 5.0, on_its_back=anywhere)
    assert judge.watch(Robot(IN)) is None
    robot.t = t
    assert judge.watch(robot) == outcome
