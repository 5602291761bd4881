"""The antenna pushed at its tip: what it bears, what it reads, and its drawing."""

from __future__ import annotations

import math
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Circle, Rectangle

from antennate.antenna.statics import Chain, equilibrium, largest_force, shape
from antennate.cli import main
from antennate.experiments.antenna.config import AntennaConfig
from antennate.experiments.antenna.drawing import drawing
from antennate.experiments.antenna.physics import bending_of
from antennate.robots.antenna import AntennaSpec

WIRE, COIL = 0.5, 3.77
ONE = AntennaSpec(active_coils=(3.0,), sensor_stiffness_n_mm_per_deg=0.0)
"""A single hinge of 0.274 N·mm/deg on a link of 120 mm: the force is torque over length."""


def yield_deg(coils: float) -> float:
    """By Shigley, section 10-12: stainless 302 of 0.5 mm, 1867 MPa mm^0.146, 61 % of it."""
    index = COIL / WIRE
    inside = (4 * index**2 - index - 1) / (4 * index * (index - 1))
    strength = 0.61 * 1867.0 / WIRE**0.146  # N/mm²
    torque = strength * math.pi * WIRE**3 / (32.0 * inside)  # N·mm
    return torque / (193e3 * WIRE**4 / (10.8 * COIL * coils) / 360.0)


def test_a_single_hinge_bears_what_its_spring_says() -> None:
    found = bending_of(AntennaConfig(antenna=ONE))
    assert found.bearable_n == pytest.approx(0.274 * 30.0 / 120.0, rel=1e-6)
    assert (found.ends_by, found.ends_at_hinge) == ("yield", 1)
    assert found.sound_n == pytest.approx(0.274 * yield_deg(3) / 120.0, rel=1e-6)
    first, *_, last = found.curve
    assert (first.tip_mm, first.force_n, first.flex_deg) == (0.0, 0.0, 0.0)
    assert last.tip_mm == pytest.approx(120.0 * math.sin(math.radians(yield_deg(3))), rel=1e-6)
    assert last.flex_deg == last.most_bent_deg == pytest.approx(yield_deg(3), rel=1e-6)


def test_its_stop_comes_first_where_it_is_nearer_than_the_yield() -> None:
    found = bending_of(AntennaConfig(antenna=ONE.model_copy(update={"range": 0.5})))
    assert found.ends_by == "stop"
    assert found.sound_n == pytest.approx(0.274 * math.degrees(0.5) / 120.0, rel=1e-6)


def test_a_reading_is_that_of_the_divider() -> None:
    """10 kOhm flat and 1.2 / 180 deg more for each degree, above 10 kOhm at 3.3 V; the ADC of the
    ESP32 at 11 dB and 1100 mV reads 0.8056 mV a count from 142 mV on (ESP-IDF)."""
    for push in bending_of(AntennaConfig(antenna=ONE)).curve[::6]:
        ratio = 1.0 / (2.0 + 1.2 * push.flex_deg / 180.0)
        assert push.counts == pytest.approx((3300.0 * ratio - 142.0) / 0.8056, abs=12.0)


def test_small_forces_bend_springs_in_a_row_by_their_levers() -> None:
    """The second hinge, 0.137 N·mm/deg at 83.3 mm from the tip, turns by 0.3 deg first."""
    bare = AntennaSpec(sensor_stiffness_n_mm_per_deg=0.0, length=0.1)
    found = bending_of(AntennaConfig(antenna=bare, angle_deg=0.3))
    assert found.bearable_n == pytest.approx(0.137 * 0.3 / (100.0 * 5 / 6), rel=1e-3)


@pytest.mark.parametrize("coils", [AntennaSpec().active_coils, (9.0,) * 10])
def test_no_force_is_told_beyond_the_last_stable_one(coils: tuple[float, ...]) -> None:
    """By Newton's method, which shares nothing with the angles of the curve."""
    antenna = AntennaSpec(active_coils=coils)
    found = bending_of(AntennaConfig(antenna=antenna))
    forces = np.array([push.force_n for push in found.curve[1:]] + [1.001 * found.sound_n])
    chain = Chain.of(antenna)
    loads = np.stack([np.zeros_like(forces), forces], axis=1)
    rest = equilibrium(chain, np.full(len(forces), chain.length), loads, follower=True)
    assert rest.solved.all()
    assert rest.stable.tolist() == [True] * (len(forces) - 1) + [False]
    tips = shape(chain, rest.angles)[:-1, -1, 1]
    assert [push.tip_mm for push in found.curve[1:]] == pytest.approx((1e3 * tips).tolist())
    assert (found.ends_by, found.ends_at_hinge) == ("unstable", None)
    turned = float(abs(rest.angles[:-1]).max()) > math.radians(30)
    assert (found.bearable_n is not None) == turned == (len(coils) == 6)


def test_two_links_are_stable_until_the_second_hinge_says() -> None:
    """Springs k/4 and k, links d, x = f d / k: the second hinge turns by x, and the matrix
    [[k/4, -f d sin x / 2], [., k]] is positive until x sin x = 1, x = 1.1141571409."""
    chain = Chain(np.array([0.1, 0.1]), np.array([0.005, 0.02]))
    assert largest_force(chain, 7.0) == pytest.approx(0.2 * 1.1141571409, rel=1e-9)


def test_a_hundred_hinges_take_no_longer_than_a_search_may() -> None:
    """A search by Newton's method took 51 s of processor time, this one takes 1 s."""
    began = time.process_time()
    largest_force(Chain.of(AntennaSpec(active_coils=(9.0,) * 100)), math.radians(30))
    assert time.process_time() - began < 15.0


@pytest.mark.parametrize("coils", [(3.0, 6.0), (3.0,) * 10, (9.0,) * 40])
def test_the_drawing_is_to_scale(coils: tuple[float, ...]) -> None:
    antenna = AntennaSpec(active_coils=coils, length=0.09)
    figure = drawing(AntennaConfig(antenna=antenna))
    (axes,) = figure.axes
    assert axes.get_aspect() == 1.0
    boxes = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    links = [box for box in boxes if box.get_height() == pytest.approx(6.0)]
    assert max(box.get_x() + box.get_width() for box in links) == pytest.approx(90.0)
    coil = [patch for patch in axes.patches if isinstance(patch, Circle)]
    assert len(coil) == len(coils)
    assert {round(2 * patch.radius, 6) for patch in coil} == {COIL + WIRE}
    texts = {text.get_text() for text in axes.texts}
    assert {"90.0", f"{90 / len(coils):.1f}", "flex sensor 90.0"} <= texts
    assert (f"{coils[-1]:g} coils\n{WIRE * (coils[-1] + 1):.1f} tall" in texts) == (len(coils) < 13)


@pytest.mark.ci
def test_coils_that_overlap_are_told_and_many_springs_fit_the_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """60 hinges over 120 mm stand 2 mm apart, coils of 0.5 mm wire are 4.27 mm wide."""
    Path(tmp_path / "many.toml").write_text(f"length = 0.12\nactive_coils = {[9.0] * 60}\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main(["antenna", str(tmp_path / "many.toml"), "--out", str(tmp_path / "out")]) == 0
    line = "Coils overlap: they are 4.27 mm wide, hinges are 2.00 mm apart."
    assert line in " ".join(capsys.readouterr().out.split())
    assert line in (tmp_path / "out" / "figures" / "drawing.svg").read_text()
    texts = [text.get_text() for text in drawing(AntennaConfig()).axes[0].texts]
    assert not any("overlap" in text for text in texts)


@pytest.mark.ci
def test_the_command_draws_and_says_what_the_antenna_bears(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["antenna", "bench", "--out", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "At the tip it bears 76 mN before a hinge turns 30 deg" in said
    assert "before its rest is not stable any more. The force turns with the last link." in said
    assert "mode 1 mode 2 mode 3" in said
    drawn = tmp_path / "out" / "figures"
    assert "flex sensor 95.3" in (drawn / "drawing.svg").read_text()
    assert (drawn / "bending.png").stat().st_size > 0
