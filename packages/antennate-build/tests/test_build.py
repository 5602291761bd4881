"""Parts as solids: with the kernel, which `uv run --extra build` installs."""

from __future__ import annotations

import csv
import json
import math
import re
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("build123d", reason="the extra `build` is not installed")

import trimesh

from antennate.cli import main
from antennate.params.scene import PhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.world import World, compile_world
from antennate.testing import check_robot
from antennate_build import (
    antenna_checks,
    checks,
    fasteners,
    kernel,
    link_parts,
    mounts,
    voxels,
    weights,
)
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.build import comparing
from antennate_build.build.config import BuildConfig
from antennate_build.build.naming import links_of
from antennate_build.layout import layout_of
from antennate_build.mounts import X330
from antennate_build.printing import PrintParams
from antennate_build.winding import WireParams, springs_of

pytestmark = [
    pytest.mark.ci,
    pytest.mark.filterwarnings("default"),  # those of the kernel are its own
]


def solids(antenna: AntennaSpec, wire: str = "music_wire", share: float = 0.95) -> AntennaSolids:
    springs = springs_of(antenna, WireParams(wire=wire, stop_share=share))
    return AntennaSolids(layout_of(antenna, springs, PrintParams()), X330)


@pytest.mark.parametrize(
    ("coils", "wire", "share"),
    [
        ((3.0, 6.0, 9.0, 12.0), "music_wire", 0.95),
        ((3.0, 6.0, 6.0, 9.0, 9.0, 9.0), "music_wire", 0.95),
        ((3.0, 6.0, 6.0, 9.0, 9.0, 9.0), "stainless_302", 10.0),
        ((3.0,) * 2 + (6.0,) * 3 + (9.0,) * 5, "phosphor_bronze", 10.0),
    ],
)
def test_four_six_and_ten_hinges_of_three_wires_pass_every_check(
    coils: tuple[float, ...], wire: str, share: float
) -> None:
    antenna = solids(AntennaSpec(active_coils=coils), wire, share)
    for name, solid in antenna.printed.items():
        part = checks.printed(solid, antenna_checks.up_of(name), 1.2)
        assert (part.closed, part.wall, part.overhangs) == (True, 1.2, ()), name
        assert kernel.count(solid) == 1
    found = [antenna_checks.assembly_check(antenna), *antenna_checks.spring_checks(antenna)]
    assert [check for check in found if not check.good] == []


@pytest.mark.parametrize(
    ("pair", "stop"), [(("bracket", "segment_1"), 0.95 * 78.04), (("segment_1", "segment_2"), 80.2)]
)
def test_segments_meet_beyond_their_stop_and_not_before(pair: tuple[str, str], stop: float) -> None:
    """The first spring yields at 78.04 deg by hand (Shigley: 2211 MPa / 0.5^0.145 x 0.78)."""
    antenna = solids(AntennaSpec())
    first, second = (antenna.printed[name] for name in pair)
    place = (antenna.layout.length * (pair[0] != "bracket"), 0.0, 0.0)

    def common(angle: float) -> float:
        turned = kernel.turned(second, math.radians(angle))
        return checks.overlap(first, kernel.moved(turned, place))

    for sign in (1.0, -1.0):
        assert common(sign * (stop - 0.3)) < 0.1
        assert common(sign * (stop + 10.0)) > 1.0


def as_billed(out: Path) -> Counter[str]:
    """Parts of the assembly's STEP file, which are those of the bill, as many and by its names."""
    text = (out / "step/assembly.step").read_text().replace("\n", "")
    used = re.findall(r"NEXT_ASSEMBLY_USAGE_OCCURRENCE\('\w+',\s*'([^']+)'", text)
    found = Counter(name for name in used if name != "body")  # a spring has three
    rows = list(csv.DictReader((out / "bom.csv").read_text().splitlines()))
    billed = Counter[str]()
    for row in rows:
        billed[row["item"]] += int(row["count"])
    printed = {row["item"] for row in rows if row["use"] == "printed"}
    assert printed <= found.keys()
    assert {name: billed[name] for name in found} == found
    return found


def test_an_antenna_of_stainless_wire_weighs_within_a_tenth_of_the_simulated_one(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    wire = ["--springs.wire", "stainless_302", "--springs.stop-share", "10"]
    assert main(["build", "--what", "antenna", *wire, "--out", str(out)]) == 0
    result = json.loads((out / "result.json").read_text())
    assert all(check["good"] for check in result["checks"])
    mass = result["masses"]["antenna's mass"]
    assert mass["specified"] == pytest.approx(5.8)  # six links of 0.8 g, a base of 1 g
    assert abs(mass["difference"]) < 0.1
    by_name = {check["name"]: check for check in result["checks"]}
    weighed = by_name.pop("mass of the antenna, of the specification")
    assert weighed["warn"] == (result["masses"]["bracket's mass"]["difference"] > 0.1)
    assert not any(check["warn"] for check in by_name.values())
    for name, part in result["parts"].items():
        mesh = trimesh.load(out / "stl" / f"{name}.stl")
        assert mesh.is_watertight, name
        assert mesh.bounds[0] == pytest.approx([0, 0, 0], abs=0.05)
        assert 1.24e-3 * mesh.volume == pytest.approx(part["mass_g"], rel=0.02)
        assert (out / "step" / f"{name}.step").read_bytes().startswith(b"ISO-10303-21")
    for name in ("antenna", "assembly", "bracket"):
        assert (out / "drawings" / f"{name}.pdf").read_bytes().startswith(b"%PDF")
        assert (out / "figures" / f"{name}.svg").is_file()
    rows = list(csv.DictReader((out / "bom.csv").read_text().splitlines()))
    assert {row["cost"] for row in rows} == {""}
    parts = as_billed(out)
    assert [parts[f"torsion spring of {n} turns"] for n in (3, 6, 9)] == [1, 2, 3]
    assert (parts["segment_4"], parts["pin"], parts["cover"]) == (2, 6, 6)


def test_the_default_robot_passes_every_check_and_its_assembly_is_that_of_its_bill(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    assert main(["build", "scuttle", "--out", str(out), "--no-figures"]) == 0
    result = json.loads((out / "result.json").read_text())
    assert [check for check in result["checks"] if not check["good"] or check["warn"]] == []
    assert {part["wall_mm"] for part in result["parts"].values()} == {1.2}
    parts = as_billed(out)
    assert (parts["DYNAMIXEL XC430-W240-T"], parts["DYNAMIXEL XL330-M288-T"]) == (17, 2)
    assert (parts["battery, three lithium cells"], parts["leg"], parts["segment_4"]) == (1, 12, 4)


@pytest.mark.parametrize("name", ["cover", "frame"])
def test_a_wall_of_a_line_and_an_island_are_found_in_a_small_and_in_a_large_part(name: str) -> None:
    if name == "cover":
        part, up, top = solids(AntennaSpec()).printed["cover"], antenna_checks.up_of("cover"), "y"
    else:
        found = links_of(BuildConfig(robot=RobotSpec()))
        assert found is not None
        part, up, top = link_parts.frame(found[0], first=False, last=False), "z", "z"
    (_, y, z), (_, high_y, high_z) = kernel.bounds(part)
    fin = (
        ((-0.2, 0.2), (y, y + 8.0), (-2.0, 2.0))
        if top == "y"
        else ((-0.2, 0.2), (-4, 4), (z, z + 12))
    )
    at = high_y + 3.0 if top == "y" else high_z + 3.0
    island = ((-1, 1), (at, at + 2), (-1, 1)) if top == "y" else ((-1, 1), (-1, 1), (at, at + 2))
    sound, thin, loose = (
        checks.printed(solid, up, 1.2)
        for solid in (part, *(kernel.joined(part, kernel.block(*b)) for b in (fin, island)))
    )
    assert not checks.walls_check({name: sound}, 1.2).warn
    assert checks.walls_check({name: thin}, 1.2).warn
    assert 0.2 < thin.wall < 0.9
    assert (sound.closed, thin.closed, loose.closed) == (True, True, False)
    assert checks.layers_check({name: loose}).found.endswith(f"begin in the air: {name}")
    assert checks.layers_check({name: sound}).found.endswith("none begins in the air")


FOUR = "links = 4\nmass = 1.4\n"
EIGHT = "links = 8\nmass = 2.7\n"


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["scuttle", "scuttle3d", FOUR, EIGHT])
def test_a_robot_is_built_nothing_meets_and_it_is_simulated_as_it_is_built(
    robot: str, tmp_path: Path
) -> None:
    out, file = tmp_path / "out", tmp_path / "own.toml"
    file.write_text(robot)
    name = str(file) if "=" in robot else robot
    before = time.process_time()
    assert main(["build", name, "--out", str(out), "--no-figures"]) == 0
    assert time.process_time() - before < 90.0
    result = json.loads((out / "result.json").read_text())
    assert [check for check in result["checks"] if not check["good"]] == []
    spec, built = RobotSpec.named(name), RobotSpec.named(out / "robot.toml")
    counts = {name: part["count"] for name, part in result["parts"].items()}
    joints = spec.links - 1
    assert (counts["leg"], counts["hinge"], counts["pin"]) == (2 * spec.links, joints, 12)
    assert ("hinge_pitch" in counts) == (robot == "scuttle3d")
    assert abs(built.mass / spec.mass - 1.0) < 0.1
    assert result["masses"]["robot's mass"]["built"] == pytest.approx(1e3 * built.mass)
    check_robot(built)
    legs = {body.name: body for body in built.bodies if body.name.startswith("leg_")}
    assert legs["leg_l0"].centre[1] == -legs["leg_r0"].centre[1] != 0.0  # webs inside
    assert -spec.leg_eccentricity < legs["leg_l0"].centre[2] + 0.0005 < 0.0
    told = " ".join(result["apart"])
    assert ("robot.toml limits them to 75 deg" in told) == (robot != "scuttle3d")
    limit = 90.0 if robot == "scuttle3d" else 75.0
    assert math.degrees(built.antennae.limit) == pytest.approx(limit, abs=0.01)
    assert math.degrees(built.antenna.hinge_ranges[0]) == pytest.approx(74.1, abs=0.1)
    drawn = World(compile_world(PhysicsParams(), built), built).model
    assert (drawn.geom_type == int(mujoco.mjtGeom.mjGEOM_MESH)).sum() == 3 * spec.links + 14
    alone = mujoco.MjModel.from_xml_path(str(out / "robot.xml"))
    assert alone.body_mass.sum() == pytest.approx(built.mass)


def test_weights_of_parts_are_those_of_plain_solids() -> None:
    """Two cubes of 1 g, 20 mm apart: 2 m (a^2 / 6), and m d^2 / 2 across the line between them."""
    cube = kernel.block((-5, 5), (-5, 5), (-5, 5))
    pair = [("cube", 1.0, kernel.moved(cube, (x, 0, 0))) for x in (0.0, 20.0)]
    found = weights.body("pair", pair)
    assert found["mass"] == 0.002
    assert found["centre"] == pytest.approx([0.01, 0.0, 0.0])
    own, apart = 2 * 100 / 6, 2 * 10.0**2
    expected = 1e-9 * np.array([own, own + apart, own + apart, 0.0, 0.0, 0.0])
    assert found["inertia"] == pytest.approx(expected, rel=1e-5, abs=1e-15)
    assert found["source"] == "cube 2.0 g"


def test_a_screw_that_is_too_long_or_too_short_is_found() -> None:
    plate = kernel.cut(kernel.block((-9, 9), (-9, 9), (0, 3)), kernel.rod(1.1, (0, 0, -1), 9))
    seat = fasteners.Seat("plate", (0.0, 0.0, 0.0), "z", 1)

    def good(length: float) -> bool:
        screw = fasteners.Fastener(1, mounts.M2, length, "plates", (seat,), 3.3)
        return fasteners.check([screw], {"plate": plate}).good

    assert [length for length in (4, 5, 6, 7) if good(length)] == [5, 6]  # bites 2 to 3.3 mm


def test_a_layer_of_its_own_is_told_where_a_part_begins_in_the_air() -> None:
    on_bed = kernel.block((0, 4), (0, 4), (0, 6))
    over = kernel.joined(
        on_bed, kernel.block((0, 20), (0, 4), (6, 8)), kernel.block((16, 20), (0, 4), (3, 6))
    )
    found = {name: checks.printed(s, "z", 1.2) for name, s in (("post", on_bed), ("hook", over))}
    check = checks.layers_check(found)
    assert check.good
    assert check.found.endswith("begin in the air: hook")
    needle = checks.printed(kernel.block((0, 1.4), (0, 1.4), (0, 3)), "z", 1.2)
    assert not checks.layers_check({"needle": needle}).good


def mesh_of(solid: kernel.Solid) -> kernel.Mesh:
    return kernel.mesh(solid)


def test_cubes_find_a_thin_wall_and_an_overhang() -> None:
    """A plate of 0.6 mm is thin; a table's top of 20 mm on one foot hangs in the air, one on two
    feet 8 mm apart is a bridge."""
    plate = kernel.block((0, 10), (0, 0.6), (0, 10))
    thick = kernel.block((0, 10), (0, 1.6), (0, 10))
    found = [voxels.thinnest(voxels.voxels(mesh_of(s), 0.1), 1.2)[0] for s in (plate, thick)]
    assert found[0] == pytest.approx(0.6, abs=0.21)
    assert found[1] == 1.2

    def table(*feet: tuple[float, float]) -> list[voxels.Overhang]:
        top = kernel.block((0, 12), (0, 4), (5, 6.5))
        legs = [kernel.block(foot, (0, 4), (0, 5)) for foot in feet]
        return voxels.overhangs(voxels.voxels(mesh_of(kernel.joined(top, *legs)), 0.1))

    assert table((0, 2), (10, 12)) == []
    (hanging,) = table((0, 2))
    assert hanging.height == pytest.approx(5.0, abs=0.2)
    assert hanging.area == pytest.approx(40.0, rel=0.1)


def test_the_volume_of_cubes_is_that_of_the_solid() -> None:
    ball = kernel.cut(kernel.rod(5, (0, 0, 0), 8), kernel.rod(2, (1, 0, -1), 10))
    cubes = voxels.voxels(mesh_of(ball), 0.1)
    expected = math.pi * (25 - 4) * 8
    assert cubes.inside.sum() * 1e-3 == pytest.approx(expected, rel=0.01)
    assert kernel.volume(ball) == pytest.approx(expected, rel=1e-6)
    assert np.isfinite(mesh_of(ball).points).all()


@pytest.mark.parametrize(("built", "warned"), [(1.09, False), (1.11, True), (0.89, True)])
def test_a_mass_more_than_a_tenth_off_is_told(built: float, warned: bool) -> None:
    masses = {
        "antenna's mass": comparing.compared("g", 5.8, 5.8),
        "bracket's mass": comparing.compared("g", 1.0, built),
        "antenna's inertia about its base": comparing.compared("g·mm²", 1.0, 2.0),
    }
    check = comparing.mass_check(masses)
    assert (check.good, check.warn) == (True, warned)
    assert f"bracket's mass {100 * built - 100:+.1f} %" in check.found
