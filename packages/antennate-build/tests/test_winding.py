"""Springs of stock wire, and what refuses a build: none of it needs the kernel of solids."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from antennate.cli import main
from antennate.errors import ConfigError
from antennate.params.spring import STOCK_WIRES_MM
from antennate.robots.antenna import N_MM_PER_DEG, AntennaSpec
from antennate.robots.spec import RobotSpec
from antennate_build.flange import hinge_height, screw_places
from antennate_build.layout import layout_of, segment_names
from antennate_build.mounts import X330, X430, mount_of
from antennate_build.printing import PrintParams
from antennate_build.winding import WireParams, springs_of

LADDERS = [
    (3.0, 6.0, 9.0, 12.0),
    (3.0, 6.0, 6.0, 9.0, 9.0, 9.0),
    (3.0,) * 2 + (6.0,) * 3 + (9.0,) * 5,
]


def test_the_papers_counts_are_wound_of_half_a_millimetre_of_stainless_wire() -> None:
    """193 GPa d^4 / (10.8 D N) per turn, D = 3.8 mm, N = 3: 0.2721 N·mm/deg; the paper: 0.274."""
    springs = springs_of(AntennaSpec(), WireParams(wire="stainless_302"))
    assert [spring.turns for spring in springs] == [3, 6, 6, 9, 9, 9]
    assert {(round(s.wire, 3), round(s.coil, 3)) for s in springs} == {(0.5, 3.8)}
    rate = 193e3 * 0.5**4 / (10.8 * 3.8 * 3) / 360
    assert springs[0].stiffness / N_MM_PER_DEG == pytest.approx(rate, rel=1e-6)
    assert springs[0].error == pytest.approx(rate / 0.274 - 1, rel=1e-6)


@pytest.mark.parametrize("coils", LADDERS)
@pytest.mark.parametrize("wire", ["stainless_302", "music_wire", "phosphor_bronze"])
def test_all_ladders_are_wound_of_stock_wire_and_their_arbor_has_play(
    coils: tuple[float, ...], wire: str
) -> None:
    antenna = AntennaSpec(active_coils=coils)
    springs = springs_of(antenna, WireParams(wire=wire))
    layout = layout_of(antenna, springs, PrintParams())
    turn = antenna.range / math.tau
    for spring in springs:
        assert min(abs(spring.wire - stock) for stock in STOCK_WIRES_MM) < 1e-9
        inside = spring.coil * spring.turns / (spring.turns + turn) - spring.wire
        assert layout.hinge.pin <= 0.9 * inside
        assert abs(spring.error) < 0.1
    assert len(segment_names(layout)) == len(coils)


def test_stops_stand_before_the_spring_yields_or_at_the_range() -> None:
    """Music wire, Shigley: 0.78 x 2211 MPa / 0.5^0.145 at the inside of coils of 4 mm: 78.04."""
    springs = springs_of(AntennaSpec())
    assert (springs[0].wire, springs[0].coil) == pytest.approx((0.5, 4.0))
    assert math.degrees(springs[0].yields) == pytest.approx(78.04, abs=0.01)
    stops = [spring.stop for spring in springs]
    assert stops == pytest.approx([math.radians(0.95 * 78.0414), *[1.4] * 5], abs=1e-5)
    farther = springs_of(AntennaSpec(), WireParams(stop_share=10.0))
    assert {spring.stop for spring in farther} == {1.4}
    nearer = springs_of(AntennaSpec(ranges=(1.0, 1.4, 1.4, 1.4, 1.4, 0.5)))
    assert [nearer[0].stop, nearer[-1].stop] == [1.0, 0.5]


def test_loose_legs_make_a_spring_softer_by_a_third_of_their_length() -> None:
    """Shigley: a leg bent at its end adds l / (3 pi D) turns."""
    spring = springs_of(AntennaSpec())[0]
    added = 2 * spring.leg / (3 * math.pi * spring.coil)
    assert spring.loose_stiffness == pytest.approx(spring.stiffness * 3 / (3 + added))


def test_holes_of_servos_are_those_of_the_solids_of_their_maker() -> None:
    """X330: four on a circle of 12 mm; X430: on one of 16 mm, in the case 24 x 12 and 22 x 40."""
    assert (X330.horn.circle, X330.horn.holes, X430.horn.circle) == (12.0, 4, 16.0)
    ys, zs = zip(*X430.sides, strict=True)
    assert (max(ys) - min(ys), max(zs) - min(zs)) == (24.0, 12.0)
    xs, ys = zip(*X430.back, strict=True)
    assert (max(xs) - min(xs), max(ys) - min(ys)) == (22.0, 40.0)
    assert {round(math.hypot(*place), 9) for place in screw_places(X330)} == {6.0}


def test_a_tilted_antenna_stands_higher_over_its_servo() -> None:
    upright, tilted = (
        layout_of(spec, springs_of(spec), PrintParams())
        for spec in (AntennaSpec(), AntennaSpec(roll=0.5))
    )
    assert hinge_height(tilted, X330, 0.5) > hinge_height(upright, X330, 0.0)


def test_a_servo_without_hole_pattern_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"^robot.yaw.servo: expected .* found xm540_w270$"):
        mount_of("xm540_w270", "robot.yaw.servo")


REFUSED = {
    "no stock wire": (
        "three_coil_stiffness_n_mm_per_deg = 900.0\n",
        "antenna.active_coils: expected springs that stock music_wire gives",
    ),
    "hard to reach": ("length = 0.06\n", "antenna.length: expected at least 0.0"),
    "short link": (
        "link_pitch = 0.06\nleg_radius = 0.02\n",
        "robot.link_pitch: expected at least 0.0",
    ),
    "narrow": ("width = 0.14\n", "robot.width: expected at least 0.1"),
    "small servo": (
        '[yaw]\nservo = "xl330_m288"\n',
        "robot.yaw.servo: expected a servo with holes",
    ),
    "small leg": ("leg_radius = 0.015\n", "robot.leg_radius: expected a ring"),
    "unequal ranges": (
        "active_coils = [3.0, 6.0]\nlength = 0.05\nranges = [1.0]\n",
        "ranges: expected 2 angles, one a hinge, found 1",
    ),
    "lifting": ('[legs]\nkind = "lifting"\n', "robot.legs.kind: expected rolling legs"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_built_is_refused_in_one_line(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, expected = REFUSED[name]
    file = tmp_path / "spec.toml"
    file.write_text(text)
    assert main(["build", str(file), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("antennate build: error: ")
    assert expected in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_the_hexapod_is_refused_in_one_line_as_its_legs_lift(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", "hexapod", "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "robot.legs.kind: expected rolling legs, whose links are known, found lifting" in error
    assert "`antennate build ROBOT --what antenna` builds its antenna alone" in error
    assert error.count("\n") == 1


def test_without_the_kernel_one_line_says_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("antennate_build.build.config.find_spec", lambda name: None)
    assert main(["build", "scuttle", "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "expected the packages build123d and trimesh, found no build123d and no trimesh" in error
    assert "uv run --extra build antennate" in error
    assert "./antennate/packages/antennate-build[build]" in error


def test_a_file_of_an_antenna_or_its_name_builds_the_antenna_alone(tmp_path: Path) -> None:
    from antennate_build.build.config import read

    file = tmp_path / "antenna.toml"
    file.write_text("active_coils = [3.0, 6.0]\nlength = 0.05\n")
    config = read(file)
    assert config.what == "antenna"
    assert config.robot.antenna.active_coils == (3.0, 6.0)
    named = read(Path("antenna"))
    assert (named.what, named.robot) == ("antenna", RobotSpec())
    assert read(Path("scuttle3d")).robot == RobotSpec.named("scuttle3d")
