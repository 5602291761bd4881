"""Parts as solids: with the kernel, which `uv run --extra build` installs."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("build123d", reason="the extra `build` is not installed")

import trimesh

from antennate.cli import main
from antennate.robots.antenna import AntennaSpec
from antennate_build import antenna_checks, checks, kernel, voxels
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.layout import layout_of
from antennate_build.mounts import X330
from antennate_build.printing import PrintParams
from antennate_build.winding import WireParams, springs_of

pytestmark = [
    pytest.mark.ci,
    pytest.mark.filterwarnings("default"),  # those of the kernel are its own
]


def solids(antenna: AntennaSpec, wire: str = "stainless_302") -> AntennaSolids:
    springs = springs_of(antenna, WireParams(wire=wire))
    return AntennaSolids(layout_of(antenna, springs, PrintParams()), X330)


@pytest.mark.parametrize(
    ("coils", "wire"),
    [
        ((3.0, 6.0, 9.0, 12.0), "music_wire"),
        ((3.0, 6.0, 6.0, 9.0, 9.0, 9.0), "stainless_302"),
        ((3.0,) * 2 + (6.0,) * 3 + (9.0,) * 5, "phosphor_bronze"),
    ],
)
def test_four_six_and_ten_hinges_of_three_wires_pass_every_check(
    coils: tuple[float, ...], wire: str
) -> None:
    antenna = solids(AntennaSpec(active_coils=coils), wire)
    for name, solid in antenna.printed.items():
        part = checks.printed(solid, antenna_checks.up_of(name), 1.2)
        assert (part.closed, part.wall, part.overhangs) == (True, 1.2, ()), name
        assert kernel.count(solid) == 1
    found = [antenna_checks.assembly_check(antenna), *antenna_checks.spring_checks(antenna)]
    assert [check for check in found if not check.good] == []


def test_segments_meet_beyond_their_stop_and_not_before() -> None:
    antenna = solids(AntennaSpec())
    first, second = antenna.printed["segment_1"], antenna.printed["segment_2"]
    length, stop = antenna.layout.length, antenna.layout.hinge.stop

    def common(angle: float) -> float:
        return checks.overlap(first, kernel.moved(kernel.turned(second, angle), (length, 0, 0)))

    for sign in (1.0, -1.0):
        assert common(sign * stop) < 0.1
        assert common(sign * (stop + math.radians(8.0))) > 1.0


def test_the_default_antenna_weighs_within_a_tenth_of_the_simulated_one(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["build", "--what", "antenna", "--out", str(out)]) == 0
    result = json.loads((out / "result.json").read_text())
    assert all(check["good"] for check in result["checks"])
    mass = result["masses"]["antenna's mass"]
    assert mass["specified"] == pytest.approx(5.8)  # six links of 0.8 g, a base of 1 g
    assert abs(mass["difference"]) < 0.1
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
    springs = {row["item"]: int(row["count"]) for row in rows if "turns" in row["item"]}
    assert list(springs.values()) == [1, 2, 3]


@pytest.mark.parametrize("robot", ["scuttle", "scuttle3d"])
def test_a_robot_is_built_and_nothing_meets(robot: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["build", robot, "--out", str(out), "--no-figures"]) == 0
    result = json.loads((out / "result.json").read_text())
    assert [check for check in result["checks"] if not check["good"]] == []
    counts = {name: part["count"] for name, part in result["parts"].items()}
    assert (counts["leg"], counts["hinge"], counts["pin"]) == (12, 5, 12)
    assert ("hinge_pitch" in counts) == (robot == "scuttle3d")
    told = " ".join(result["apart"])
    assert ("servo leg_left and segment" in told) == (robot == "scuttle")


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
