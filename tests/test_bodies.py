"""Mass and inertia of links and legs from a robot's file, and meshes by which they are drawn."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from antennate.cli import main
from antennate.errors import ConfigError
from antennate.params.scene import PhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.mechanics import body_of
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.export.folder import export_mjcf
from antennate.sim.parts import OBSTACLE_BIT, build_antenna
from antennate.sim.world import World, compile_world
from antennate.testing import check_robot

LINKS = (0.30, 0.20, 0.26)
LEG = 0.025
BOX = (0.0004, 0.0001, 0.00045, 0.0, 0.00001, 0.0)


def text(mass: float = sum(LINKS) + 6 * LEG, meshes: str = "") -> str:
    lines = ["links = 3", f"mass = {mass!r}", f"leg_mass = {LEG}", f'meshes = "{meshes}"']
    lines += ["[antennae]", 'kind = "none"']
    for n, link in enumerate(LINKS):
        lines += [
            "[[bodies]]",
            f'name = "link{n}"',
            f"mass = {link}",
            "centre = [0.01, 0.0, 0.002]",
        ]
        lines += [f"inertia = {list(BOX)}", 'source = "made up"']
        for side in "lr":
            lines += ["[[bodies]]", f'name = "leg_{side}{n}"', f"mass = {LEG}"]
            lines += ["centre = [0.0, 0.0, -0.008]", "inertia = [3e-6, 5e-6, 3e-6, 0.0, 0.0, 0.0]"]
    return "\n".join(lines)


def robot(tmp_path: Path, **values: object) -> RobotSpec:
    file = tmp_path / "robot.toml"
    file.write_text(text(**values))  # type: ignore[arg-type]
    return RobotSpec.named(file)


def tetrahedron(file: Path) -> None:
    """A binary STL of four triangles, 20 mm long."""
    corners = 20.0 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    rows = [
        struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel().tolist(), 0) for face in faces
    ]
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(bytes(80) + struct.pack("<I", 4) + b"".join(rows))


def test_links_and_legs_weigh_what_the_file_says_where_it_says(tmp_path: Path) -> None:
    spec = robot(tmp_path)
    check_robot(spec)
    model = compile_world(PhysicsParams(), spec)
    for n, mass in enumerate(LINKS):
        link, leg = model.body(f"robot/link{n}"), model.body(f"robot/leg_r{n}")
        assert link.mass == pytest.approx(mass)
        assert link.ipos == pytest.approx([0.01, 0.0, 0.002])
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, link.iquat)
        axes = turn.reshape(3, 3)
        xx, yy, zz, xy, xz, yz = BOX
        expected = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
        assert axes @ np.diag(link.inertia) @ axes.T == pytest.approx(np.array(expected), abs=1e-12)
        assert leg.mass == pytest.approx(LEG)
        assert leg.ipos == pytest.approx([0.0, 0.0, -0.008])
    weights = 9.81 * (np.array(LINKS) + 2 * LEG)
    assert body_of(spec, 0.5).link_weight == pytest.approx(weights)


def test_meshes_are_drawn_and_touch_nothing_and_the_head_goes_the_same_way(tmp_path: Path) -> None:
    tetrahedron(tmp_path / "meshes" / "link1.stl")
    plain, drawn = robot(tmp_path), robot(tmp_path, meshes="meshes")
    worlds = [World(compile_world(PhysicsParams(), spec), spec) for spec in (plain, drawn)]
    for world in worlds:
        world.place(0.0, 0.0, 0.0, np.zeros(2), np.zeros((3, 2)))
        world.command(np.full(len(plain.joint_names), 0.2))
        world.step(200)
    assert worlds[0].head.tolist() == worlds[1].head.tolist()
    model = worlds[1].model
    (mesh,) = np.flatnonzero(model.geom_type == int(mujoco.mjtGeom.mjGEOM_MESH))
    assert model.body(model.geom_bodyid[mesh]).name == "robot/link1"
    assert model.geom_contype[mesh] == model.geom_conaffinity[mesh] == 0
    edges = model.mesh_vert[:, None] - model.mesh_vert[None]
    assert np.linalg.norm(edges, axis=2).max() == pytest.approx(0.02 * 2**0.5)  # of 20 mm
    spine = model.geom("robot/link1_spine")
    assert (int(spine.group[0]), int(spine.conaffinity[0]) & OBSTACLE_BIT) == (3, OBSTACLE_BIT)


def test_an_exported_robot_keeps_bodies_and_meshes(tmp_path: Path) -> None:
    tetrahedron(tmp_path / "meshes" / "link1.stl")
    export = export_mjcf(robot(tmp_path, meshes="meshes"))
    assert all(apart < 1e-12 for apart in export.result["model_difference"].values())
    assert export.result["mass"] == pytest.approx(sum(LINKS) + 6 * LEG)
    assert len([name for name in export.files if name.endswith(".stl")]) == 1


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("mass = 0.91", "mass = 1.0", "mass: expected 0.91 kg, that of all bodies, found 1"),
        ("leg_mass = 0.025", "leg_mass = 0.02", "bodies: expected legs of leg_mass, 0.02 kg"),
        ('name = "leg_r2"', 'name = "tail"', "bodies: expected each of link0, link1"),
        ("[0.0004,", "[0.0009,", "inertia: expected moments of a body, each at most the sum"),
        ('meshes = ""', 'meshes = "none"', "robot.meshes: expected a folder with files such as"),
    ],
)
def test_a_file_that_is_no_robot_is_refused_in_one_line(
    old: str, new: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, right = tmp_path / "robot.toml", text(mass=0.91)
    assert old in right
    file.write_text(right.replace(old, new))
    assert main(["robot", "--robot", str(file), "--export", "mjcf", "--out", f"{file}.d"]) == 2
    error = capsys.readouterr().err
    assert expected in error
    assert error.count("\n") == 1


def test_hinges_of_an_antenna_stop_where_its_file_says() -> None:
    stops = (1.2, 1.4, 1.3, 1.4, 1.4, 0.9)
    model = build_antenna(AntennaSpec(ranges=stops)).compile()
    found = [model.joint(f"hinge{n}").range.tolist() for n in range(6)]
    assert found == [pytest.approx([-stop, stop]) for stop in stops]
    assert AntennaSpec().hinge_ranges == (1.4,) * 6
    with pytest.raises(ConfigError, match=r"ranges: expected at most range, 1.4 rad, found 1.5"):
        AntennaSpec(ranges=(1.5,) * 6)


def test_a_robot_without_bodies_is_written_as_before() -> None:
    assert {"bodies", "meshes"}.isdisjoint(RobotSpec().model_dump())
    assert RobotSpec().link_masses == (RobotSpec().link_mass,) * 6
