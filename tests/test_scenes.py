"""Scenes: ours, those of MJCF files, and one's own keep the protocol; bad ones are refused."""

from __future__ import annotations

import math
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from antennate import simulate
from antennate.cli import main
from antennate.errors import AntennateError, SceneError
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.mjcf import MjcfScene, require_compiles
from antennate.sim.scenes.registry import make_scene
from antennate.sim.scenes.scene import FlatScene, Route
from antennate.sim.scenes.tunnel import TunnelScene
from antennate.sim.trial import TrialConfig, check_start, make_world, place_at_start
from antennate.studies.run_directory import RunDirectory
from antennate.testing import check_scene

EXAMPLE = Path(__file__).parent.parent / "examples" / "own_scene.py"
SITES = '<site name="start"/><site name="exit" pos="2 0 0"/>'
WALL = '<geom name="wall" type="box" size="1 .02 .1" pos="1 .4 .1"/>'


def mjcf(folder: Path, world: str, before: str = "") -> Path:
    path = folder / "scene.xml"
    path.write_text(f"<mujoco>{before}<worldbody>{world}</worldbody></mujoco>")
    return path


def drawn(scene, seed: int = 0):
    return scene.draw(RobotSpec(), np.random.default_rng(seed))


def test_the_help_offers_the_scenes_that_a_refusal_lists(capsys):
    """A tunnel, corridors, seven hard ones, flat, wall, six of ground, a tunnel with a step."""
    assert main(["tunnel", "--scene", "tunnle"]) == 2
    listed = capsys.readouterr().err.split("expected one of ")[1].split(", or FILE.xml")[0]
    assert len(listed.split(", ")) == 18
    assert main(["tunnel", "--help-all"]) == 0
    assert f"--scene NAME {listed}, a MJCF file.xml" in " ".join(capsys.readouterr().out.split())


def test_ours_keep_the_protocol(tmp_path):
    for scene in (TunnelScene(), FlatScene(), MjcfScene(mjcf(tmp_path, SITES + WALL))):
        check_scene(scene)


@pytest.mark.ci
@pytest.mark.skipif(not EXAMPLE.is_file(), reason="examples are not part of this copy")
def test_a_scene_of_ones_own_is_walked_without_touching_the_package(tmp_path, capsys):
    check_scene(make_scene(f"{EXAMPLE}:Pillars"))
    out = ["--out", str(tmp_path / "run"), "--no-figures", "--workers", "1"]
    words = ["tunnel", "--scene", f"{EXAMPLE}:Pillars", "--trials", "1", "--time-limit", "0.5"]
    assert main([*words, *out]) == 0
    assert len((tmp_path / "run" / "trials.csv").read_text().splitlines()) > 1
    assert "Traceback" not in capsys.readouterr().err


class Broken(Route):
    """A straight route of 1 m that keeps the protocol but for what a test changes."""

    def __init__(self):
        super().__init__(np.array([[0.0, 0.0], [1.0, 0.0]]))


class Blocked(Broken):
    def build(self, spec):
        super().build(spec)
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1, 0.1, 0.1])


class Twice(Broken):
    def build(self, spec):
        super().build(spec)
        spec.worldbody.add_geom(size=[0.0, 0.0, 0.0], pos=[5, 0, 0])


class Short(Broken):
    def __init__(self):
        super().__init__()
        self.length = 0.0


class Drawing:
    def __init__(self, draw, random: bool = False):
        self.random = random
        self._draw = draw

    def draw(self, robot, rng):
        return self._draw(rng)


def broken(**parts):
    """A scene whose instance has some of its parts otherwise."""
    return Drawing(lambda rng: type("Other", (Broken,), parts)())


def shifted(rng):
    return Placed(rng.uniform(0.5, 0.9))


class Placed(Broken):
    def __init__(self, x):
        super().__init__()
        self._x = x

    def build(self, spec):
        super().build(spec)
        spec.worldbody.add_geom(size=[0.05, 0, 0], pos=[self._x, 0.4, 0.05])


def test_a_sound_one_passes():
    check_scene(Drawing(lambda rng: Broken()))
    check_scene(Drawing(shifted, random=True))


@pytest.mark.parametrize(
    ("scene", "told"),
    [
        (Drawing(lambda rng: Blocked()), "room for the robot"),
        (Drawing(lambda rng: Twice()), "cannot be compiled"),
        (
            broken(progress=lambda self, head: Route.progress(self, head) + 0.1),
            "progress 0 m at the start",
        ),
        (broken(progress=lambda self, head: -Route.progress(self, head)), "to grow"),
        (broken(succeeded=lambda self, head: False), "success past the exit"),
        (Drawing, "a scene, an object with draw and random"),
        ("tunnel", "a scene, an object with draw and random"),
        (Drawing(lambda rng: 7), "an instance with start, length"),
        (Drawing(lambda rng: 1 / 0), "draw to work, found: ZeroDivisionError"),
        (broken(succeeded=lambda self, head: True), "no success at the start"),
        (broken(left=lambda self, head: False), "to have left"),
        (broken(left=lambda self, head: True), "a start inside"),
        (Drawing(lambda rng: Short()), "a length above 0"),
        (broken(time_limit=0.0), "time_limit to be a time above 0 s"),
        (Drawing(shifted), "random is False"),
        (Drawing(lambda rng: Broken(), random=True), "random is True"),
        (Drawing(lambda rng: Placed(np.random.default_rng().uniform(0.5, 0.9)), True), "again"),
    ],
)
def test_the_check_finds_what_is_broken(scene, told):
    with pytest.raises(AssertionError, match=told):
        check_scene(scene)


def touching(world) -> set[str]:
    """First letters of the robot's geoms that touch something named wall."""
    found = set()
    for contact in world.data.contact:
        names = [world.model.geom(g).name for g in contact.geom]
        if any("wall" in name for name in names):
            found |= {name.removeprefix("robot/")[:3] for name in names if "robot/" in name}
    return found


@pytest.mark.parametrize("movable", [False, True])
def test_a_geom_with_default_bits_meets_body_legs_and_antennae(tmp_path, movable):
    wall = '<geom name="wall" type="box" size="1 .5 .02" pos="0 0 .042" mass="1"/>'
    if movable:
        wall = f"<body><freejoint/>{wall}</body>"
    instance = drawn(MjcfScene(mjcf(tmp_path, SITES + wall)))
    world = make_world(PhysicsParams(), RobotSpec(), instance)
    place_at_start(world, instance, GaitParams())
    assert touching(world) == {"lin", "leg", "ant"}
    assert world.obstacle_overlap() > 0.0


@pytest.mark.parametrize(
    ("plane", "floors"),
    [
        ("", {"floor"}),
        ('<geom name="ground" type="plane" size="5 5 1"/>', {"scene/ground"}),
        ('<geom name="slope" type="plane" size="5 5 1" pos="0 0 -.2" euler="0 5 0"/>', {"floor"}),
    ],
)
def test_a_level_plane_of_the_file_is_the_floor_or_one_is_added(tmp_path, plane, floors):
    instance = drawn(MjcfScene(mjcf(tmp_path, SITES + plane)))
    world = make_world(PhysicsParams(), RobotSpec(), instance)
    place_at_start(world, instance, GaitParams())
    world.command(world.drives().copy())
    world.step(100)
    named = [{world.model.geom(g).name for g in c.geom} for c in world.data.contact]
    assert len(named) >= 3, "the robot stands on its legs"
    assert {min(pair - {name for name in pair if "robot/" in name}) for pair in named} == floors
    assert all(any("leg" in name for name in pair) for pair in named)


def test_obstacles_are_outlined_from_above(tmp_path):
    lying = '<geom type="capsule" fromto="1 1 .1 2 1 .1" size=".1"/>'
    tilted = '<geom type="box" size=".1 .2 .3" pos="1 -1 .1" euler="0 0 90"/>'
    pillar = '<geom type="cylinder" size=".3 .2" pos="5 0 .2"/>'
    ball = '<body pos="3 3 .1"><freejoint/><geom type="ellipsoid" size=".1 .2 .1"/></body>'
    scene = MjcfScene(mjcf(tmp_path, SITES + lying + tilted + pillar + ball))
    instance = drawn(scene)
    world = make_world(PhysicsParams(), RobotSpec(), instance)
    place_at_start(world, instance, GaitParams())
    fixed, movable = world.outlines()
    boxes = [np.concatenate([p.min(axis=0), p.max(axis=0)]) for p in [*fixed, *movable]]
    expected = [
        (0.9, 0.9, 2.1, 1.1),
        (0.8, -1.1, 1.2, -0.9),
        (4.7, -0.3, 5.3, 0.3),
        (2.9, 2.8, 3.1, 3.2),
    ]
    assert np.array(boxes) == pytest.approx(np.array(expected), abs=1e-3)
    assert len(movable) == 1


def test_geoms_of_a_file_touch_one_another_as_they_did(tmp_path):
    balls = (
        '<body pos="9 0 .1"><freejoint/><geom name="a" size=".1"/></body>'
        '<body pos="9 .15 .1"><freejoint/><geom name="b" size=".1" contype="2" conaffinity="2"/>'
        "</body>"
        '<body pos="9 .05 .22"><freejoint/><geom name="c" size=".1" contype="1" conaffinity="2"/>'
        "</body>"
    )
    alone = mujoco.MjModel.from_xml_path(str(mjcf(tmp_path, SITES + balls)))
    data = mujoco.MjData(alone)
    mujoco.mj_forward(alone, data)

    def pairs(model, contacts):
        named = [{model.geom(g).name.removeprefix("scene/") for g in c.geom} for c in contacts]
        return {frozenset(n) for n in named if n <= {"a", "b", "c"}}

    world = make_world(PhysicsParams(), RobotSpec(), drawn(MjcfScene(tmp_path / "scene.xml")))
    mujoco.mj_forward(world.model, world.data)
    assert pairs(alone, data.contact) == {frozenset("ac"), frozenset("bc")}
    assert pairs(world.model, world.data.contact) == pairs(alone, data.contact)


def test_progress_follows_the_sites_on_the_way(tmp_path):
    sites = (
        '<site name="start" pos="1 1 .3"/><site name="via0" pos="1 3 0"/>'
        '<site name="via1" pos="4 3 0"/><site name="exit" pos="4 2 0"/>'
    )
    instance = drawn(MjcfScene(mjcf(tmp_path, sites)))
    assert instance.length == pytest.approx(2.0 + 3.0 + 1.0)
    assert instance.start == pytest.approx((1.0, 1.0, math.pi / 2))
    assert instance.progress(np.array([2.0, 3.2])) == pytest.approx(3.0)
    assert instance.exit == pytest.approx(np.array([[4.5, 2.0], [3.5, 2.0]])), "left, then right"
    assert not instance.left(np.array([4.7, 3.7]))
    assert instance.left(np.array([4.9, 3.0])), "farther than 0.8 m from the route"


def test_meshes_are_read_from_the_folder_of_the_file(tmp_path):
    (tmp_path / "parts").mkdir()
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    (tmp_path / "parts" / "stone.obj").write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    assets = '<compiler meshdir="parts"/><asset><mesh file="stone.obj" scale=".2 .2 .2"/></asset>'
    stone = '<geom name="wall" type="mesh" mesh="stone" pos="1 .5 0"/>'
    instance = drawn(MjcfScene(mjcf(tmp_path, SITES + stone, assets)))
    world = make_world(PhysicsParams(), RobotSpec(), instance)
    (polygon,) = world.outlines()[0]
    assert polygon.min(axis=0) == pytest.approx([1.0, 0.5], abs=1e-6)
    assert polygon.max(axis=0) == pytest.approx([1.2, 0.7], abs=1e-6)
    assert len(polygon) == 3


GRID = '<replicate count="200" offset=".1 0 0"><replicate count="200" offset="0 .1 0">{}'
BAD = {
    "no exit": ('<site name="start"/>', "", "'exit'.*found start"),
    "no start": ('<site name="exit"/>', "", "'start'"),
    "no sites": (WALL, "", "'start'.*no site"),
    "a gap": (SITES + '<site name="via1" pos="1 1 0"/>', "", "named 'via0' before 'via1'"),
    "same place": ('<site name="start"/><site name="exit"/>', "", "1 mm apart"),
    "option": (SITES, '<option timestep="0.01"/>', "no <option>.*timestep"),
    "flag": (SITES, '<option><flag gravity="disable"/></option>', "no <flag>"),
    "include": (SITES + '<include file="/etc/passwd"/>', "", "no <include>"),
    "extension": (SITES, '<extension><plugin plugin="x"/></extension>', "no <extension>"),
    "attach": (SITES + '<attach model="x" prefix="y"/>', "", "could not find model 'x'"),
    "memory": (SITES, '<size memory="200G"/>', "no <size>"),
    "absolute": (SITES, '<asset><mesh file="/etc/passwd"/></asset>', "folder of the model"),
    "above": (SITES, '<asset><mesh file="../x.obj"/></asset>', "folder of the model"),
    "missing": (SITES, '<asset><mesh file="x.obj"/></asset>', "x.obj: expected a readable file"),
    "nan": (SITES + '<geom size="nan"/>', "", "finite"),
    "infinite": (SITES + '<body><geom size="1" mass="1e999"/></body>', "", "finite"),
    "bomb": (SITES + GRID.format(WALL) + "</replicate></replicate>", "", "at most 20000 elements"),
    "unknown": (SITES + "<gem/>", "", "gem"),
    "not xml": ("<", "", "MJCF model"),
    "no mass": (SITES + "<body><freejoint/></body>", "", "mass"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused_in_one_line(tmp_path, name):
    world, before, told = BAD[name]
    with pytest.raises(SceneError, match=told) as found:
        MjcfScene(mjcf(tmp_path, world, before))
    assert "\n" not in str(found.value)
    assert "scene.xml" in str(found.value)


def test_an_error_of_the_engine_has_the_line_of_the_file(tmp_path):
    """Although the engine never sees the comments, and each tag on one line."""
    path = tmp_path / "scene.xml"
    lines = ['<?xml version="1.0"?>', "<!-- a", " <geom> -->", "<mujoco>", " <worldbody>", ""]
    lines += ['<geom type="box"', ' size="1 1 1"/> <geom size="1"/>', "<body>", "</body>"]
    path.write_text("\n".join([*lines, "<geom", ' sizee="1"/>', "</worldbody>", "</mujoco>"]))
    with pytest.raises(SceneError, match=r"found unrecognized attribute: 'sizee' .* line 11$"):
        MjcfScene(path)
    path.write_text("<mujoco>\n <geom>\n  </mujoco>")
    with pytest.raises(SceneError, match=r"broken XML at line 3, column 5: mismatched tag$"):
        MjcfScene(path)


def test_entities_and_large_files_are_refused(tmp_path):
    path = tmp_path / "scene.xml"
    path.write_text('<!DOCTYPE m [<!ENTITY a "aaaa">]><mujoco model="&a;"/>')
    with pytest.raises(SceneError, match="no DOCTYPE"):
        MjcfScene(path)
    path.write_bytes(b" " * 5_000_001)
    with pytest.raises(SceneError, match="at most 5000000 bytes"):
        MjcfScene(path)
    with pytest.raises(SceneError, match=r"none\.xml: expected a readable file"):
        MjcfScene(tmp_path / "none.xml")


@pytest.mark.ci
def test_a_bad_scene_is_told_before_anything_is_written(tmp_path, refused):
    path = mjcf(tmp_path, SITES + '<geom type="box" size=".1 .1 .1"/>')
    assert "room for the robot" in refused(
        "tunnel", "--scene", str(path), "--out", str(tmp_path / "run")
    )
    assert not (tmp_path / "run").exists()


@pytest.mark.ci
@pytest.mark.parametrize(
    ("code", "limit", "told"),
    [
        ("import time; time.sleep(60)", 0.2, "compiles within 0.2 s"),
        ("import os; os.kill(os.getpid(), 24)", 60, "compiles within 10 s of CPU time"),  # SIGXCPU
        ("import os; os.abort()", 60, "crashes MuJoCo .signal 6."),
        ("raise MemoryError", 60, "crashes MuJoCo .exit code 1."),
    ],
)
def test_X4_a_model_on_which_the_engine_fails_harms_another_process(tmp_path, code, limit, told):
    with pytest.raises(SceneError, match=told) as found:
        require_compiles(mjcf(tmp_path, SITES), limit, ("-c", code))
    assert "\n" not in str(found.value)


def test_X2_a_named_file_is_compiled_by_another_process_first(tmp_path, monkeypatch):
    tried = []
    monkeypatch.setattr("antennate.sim.scenes.mjcf.require_compiles", tried.append)
    path = mjcf(tmp_path, SITES)
    assert make_scene(str(path)).random is False
    make_scene("flat")
    assert tried == [path]


@pytest.mark.ci
def test_a_good_model_and_a_bad_one_leave_the_word_to_the_reader(tmp_path):
    require_compiles(mjcf(tmp_path, SITES + WALL))
    require_compiles(mjcf(tmp_path, "<gem/>"))


@pytest.mark.parametrize(("line", "method"), [(5, "__init__"), (7, "draw"), (11, "build")])
def test_an_error_in_ones_own_scene_names_it_and_its_line(tmp_path, line, method):
    lines = [
        "from antennate.sim.scenes.scene import Route",
        "class Mine:",
        "    random = False",
        "    def __init__(self):",
        "        pass",
        "    def draw(self, robot, rng):",
        "        drawn = Line([[0.0, 0.0], [1.0, 0.0]])",
        "        return drawn",
        "class Line(Route):",
        "    def build(self, spec):",
        "        super().build(spec)",
    ]
    assert f"def {method}(" in lines[line - 2]
    lines[line - 1] = "        1 / 0"
    (tmp_path / "mine.py").write_text("\n".join(lines))
    with pytest.raises(AntennateError, match=rf"mine\.py:Mine.*ZeroDiv.*mine\.py:{line}\)"):
        check_start(TrialConfig(scene=f"{tmp_path / 'mine.py'}:Mine"))


@pytest.mark.ci
def test_a_trial_that_starts_inside_a_wall_is_invalid(tmp_path, refused):
    """Chance may move the start of a trial, though the first one has room."""
    walls = [f'<geom type="box" size="2 .02 .1" pos="0 {y} .1"/>' for y in (-0.4, 0.4)]
    path = mjcf(tmp_path, SITES + "".join(walls))
    words = ["tunnel", "--scene", str(path), "--variation.start-lateral", "0.35", "--trials", "4"]
    more = ["--controllers", "open", "--time-limit", "0.2", "--no-figures", "--workers", "1"]
    main([*words, *more, "--out", str(tmp_path / "run")])
    rows = RunDirectory.open(tmp_path / "run").rows()
    invalid = [row for row in rows if row["outcome"] == "invalid"]
    assert 0 < len(invalid) < 4
    assert all("expected room for the robot at the start" in row["reason"] for row in invalid)
    assert all(row["force_max_n"] < 1e3 for row in rows if row not in invalid)
    blocked, settings = invalid[0]["trial"], {"start_lateral": 0.35}
    with pytest.raises(SceneError, match="expected room for the robot at the start"):
        simulate("open", blocked, scene=str(path), variation=settings)
    words = ["twin", "--scene", str(path), "--variation.start-lateral", "0.35", "--duration", "1"]
    assert "expected room for the robot at the start" in refused(*words, "--trial", str(blocked))


@pytest.mark.ci
@pytest.mark.parametrize(
    ("workers", "ends", "told"),
    [
        ("1", "raise ValueError('no room for a stone')", "ValueError: no room for a stone"),
        ("2", "raise SystemExit(3)", "SystemExit: 3"),
    ],
)
def test_a_trial_whose_scene_cannot_be_drawn_is_invalid_and_the_others_run(
    tmp_path, workers, ends, told
):
    """The first trial is drawn before anything is run, so a scene without any trial is refused."""
    lines = [
        "import numpy as np",
        "from antennate.sim.scenes.scene import Route",
        "class Mine:",
        "    random = True",
        "    def draw(self, robot, rng):",
        "        if rng.random() < 0.3:",
        "",
        "        return Route(np.array([[0.0, 0.0], [1.0, 0.0]]))",
    ]
    lines[6] = f"            {ends}"
    (tmp_path / "mine.py").write_text("\n".join(lines))
    words = ["tunnel", "--scene", f"{tmp_path / 'mine.py'}:Mine", "--trials", "9", "--no-figures"]
    more = ["--controllers", "open", "closed", "--time-limit", "0.2", "--workers", workers]
    assert main([*words, *more, "--out", str(tmp_path / "run")]) == 0
    rows = RunDirectory.open(tmp_path / "run").rows()
    reasons = {name: [r["reason"] for r in rows if r["controller"] == name] for name in more[1:3]}
    assert reasons["open"] == reasons["closed"]
    lost = [row for row in rows if told in str(row["reason"])]
    assert 0 < len(lost) < 18
    assert {row["outcome"] for row in lost} == {"invalid"}
    assert {row["outcome"] for row in rows if row not in lost} == {"timeout"}
    assert len(rows) == 18
    lines[5] = "        if True:"
    (tmp_path / "mine.py").write_text("\n".join(lines))
    assert main([*words, "--out", str(tmp_path / "none")]) == 2


@pytest.mark.ci
@pytest.mark.parametrize(
    ("answer", "told"),
    [
        ("progress(self, head): return 1 / 0", r"progress raised ZeroDivisionError.*mine\.py:\d+"),
        ("progress(self, head): return 'far'", "progress to return a finite number"),
        ("progress(self, head): return float('nan')", "progress to return a finite number"),
        ("succeeded(self, head): return head > 1", "succeeded to return True or False"),
        ("left(self, head): return None", "left to return True or False, found None"),
    ],
)
def test_a_scene_that_answers_wrongly_makes_invalid_rows(tmp_path, answer, told):
    (tmp_path / "mine.py").write_text(
        "from antennate.sim.scenes.scene import Route\n"
        "class Mine:\n    random = False\n"
        "    def draw(self, robot, rng): return Line([[0.0, 0.0], [1.0, 0.0]])\n"
        f"class Line(Route):\n    def {answer}\n"
    )
    words = ["tunnel", "--scene", f"{tmp_path / 'mine.py'}:Mine", "--trials", "2"]
    more = ["--controllers", "open", "--time-limit", "0.3", "--no-figures", "--workers", "1"]
    assert main([*words, *more, "--out", str(tmp_path / "run")]) == 2
    rows = RunDirectory.open(tmp_path / "run").rows()
    assert [row["outcome"] for row in rows] == ["invalid"] * 2
    assert all(re.search(told, row["reason"]) for row in rows)


def test_a_scene_that_draws_nothing_is_told_with_what_is_missing(tmp_path, refused):
    path = tmp_path / "empty.py"
    path.write_text(
        "class Empty:\n    random = False\n    def draw(self, robot, rng):\n        return None\n"
    )
    words = ["tunnel", "--scene", f"{path}:Empty", "--trials", "1", "--out", str(tmp_path / "run")]
    found = refused(*words)
    assert "expected draw to return a SceneInstance, found NoneType without start, length" in found
