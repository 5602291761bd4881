"""`antennate robot`: what it says of robots of several sizes, and what it draws."""

from __future__ import annotations

import csv
import json
import re
from itertools import combinations
from pathlib import Path

import pytest

from antennate.cli import main
from antennate.robots.parts import bill, supply
from antennate.robots.spec import ROBOTS, RobotSpec
from antennate.robots.wiring import wiring


@pytest.mark.parametrize("links", [4, 6, 8])
def test_every_joint_is_listed_drawn_and_bought(
    links: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Stall currents of the e-Manual: 1.3 A at 11.1 V, and 1.47 A at 5 V behind 90 %."""
    folder, joints = tmp_path / "robot", links - 1 + 2 * links + 2
    assert main(["robot", "--robot.links", str(links), "--out", str(folder)]) == 0
    said = capsys.readouterr().out
    result = json.loads((folder / "result.json").read_text())
    names = RobotSpec(links=links).joint_names
    assert list(result["joints"]) == list(names)
    assert len(names) == joints
    drawing = (folder / "figures" / "wiring.svg").read_text()
    for name, joint in result["joints"].items():
        assert name in said
        assert f"{joint['id']}  {name}" in drawing
    bought = list(csv.DictReader((folder / "bom.csv").read_text().splitlines()))
    servos = [row for row in bought if row["item"].startswith("DYNAMIXEL")]
    assert sum(int(row["count"]) for row in servos) == joints
    assert (folder / "figures" / "wiring.png").stat().st_size > 10_000
    stall = 1.3 * (joints - 2) + 2 * 1.47 * 5.0 / 11.1 / 0.9
    assert result["supply"]["stall"] == pytest.approx(stall)
    assert f"{stall:.1f} A if all of them stall" in said


def test_what_no_file_states_and_nobody_measured_is_not_shown_as_a_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file has the zeros of the yaw joints and both lists of the antennae; yaw2 is lost."""
    monkeypatch.chdir(tmp_path)
    Path("robot.toml").write_text(
        "[robot.yaw]\nzeros = [2001, 2002, 2003, 2004, 2005]\n"
        "[robot.antennae]\nzeros = [2018, 2048]\ndirections = [1, -1]\n"
        '[zeros]\nmeasured = "2026-11-29"\nmissing = ["yaw2"]\n'
    )
    assert main(["robot", "--out", "run"]) == 0
    joints = json.loads(Path("run/result.json").read_text())["joints"]
    found = {name: (joint["zero"], joint["direction"]) for name, joint in joints.items()}
    assert [found.pop(f"yaw{n}") for n in range(1, 6)] == [
        *((2001, None), (None, None)),
        *((2003, None), (2004, None), (2005, None)),
    ]
    assert found.pop("antenna_l_base") == (2018, 1)
    assert found.pop("antenna_r_base") == (2048, -1)
    assert len(found) == 12
    assert set(found.values()) == {(None, None)}
    said = capsys.readouterr().out
    ends = {line.split()[0]: line.split()[-2:] for line in said.splitlines() if line.strip()}
    assert ends["leg_r5"] == ends["yaw2"] == ["-", "-"]
    assert (ends["yaw1"], ends["antenna_r_base"]) == (["2001", "-"], ["2048", "-1"])
    assert re.search("- is not measured; `.*antennate setup zero` measures it", said)


@pytest.mark.parametrize("name", ROBOTS)
def test_no_two_boxes_of_the_wiring_are_drawn_over_one_another(name: str) -> None:
    robot = RobotSpec.named(name)
    axes = wiring(robot).axes[0]
    boxes = [patch.get_window_extent() for patch in axes.patches]
    named = [text.get_window_extent() for text in axes.texts if "  " in text.get_text()]
    assert len(boxes) >= len(named) == len(robot.ids)
    assert not [pair for pair in combinations(boxes, 2) if pair[0].overlaps(pair[1])]
    for letters in named:  # each within its box
        assert any(box.x0 < letters.x0 and letters.x1 < box.x1 for box in boxes)


def test_elevation_servos_are_bought_fed_and_cabled() -> None:
    """22 servos at 11.1 V, two a feed; four of 1.47 A at 5 V behind 90 %."""
    robot = RobotSpec.named("scuttle3d")
    power = supply(robot)
    assert [len(rail.ids) for rail in power.rails] == [22, 4]
    assert power.feeds == 11
    assert power.stall == pytest.approx(1.3 * 22 + 4 * 1.47 * 5.0 / 11.1 / 0.9)
    assert power.fuse >= 1.25 * power.peak
    rows = {(part.use, part.item): part.count for part in bill(robot)}
    assert rows["elevation", "DYNAMIXEL XL330-M288-T"] == 2
    assert rows["pitch", "DYNAMIXEL XC430-W240-T"] == 5
    assert rows["servo bus", "cable with three wires, JST EHR-03 at both ends"] == 27


def test_an_inertial_sensor_is_wired_where_there_is_one() -> None:
    """The pins are those of docs/firmware.md."""
    for name, wired in (("scuttle3d", True), ("scuttle", False)):
        told = [text.get_text() for text in wiring(RobotSpec.named(name)).axes[0].texts]
        assert any("GPIO21, 22" in text for text in told) == wired


def test_one_plug_feeds_no_more_than_its_contacts_stand() -> None:
    """JST EH: 3 A. Two stalled XC430-W240-T draw 2.6 A, three 3.9 A."""
    power = supply(RobotSpec())
    assert power.per_feed == 2
    assert power.feeds == 9  # 17 servos


def test_a_robot_of_ones_own_with_other_servos_and_pitch(tmp_path: Path) -> None:
    """All at 5 V: no battery of 11.1 V, no converter."""
    file, folder = tmp_path / "small.toml", tmp_path / "small"
    groups = "".join(f'[{g}]\nservo = "xl330_m288"\nfastest = 4.5\n' for g in ("yaw", "legs"))
    file.write_text(f'links = 3\n{groups}[pitch]\nkind = "actuated"\nservo = "xl330_m288"\n')
    assert main(["robot", "--robot", str(file), "--out", str(folder)]) == 0
    result = json.loads((folder / "result.json").read_text())
    assert [rail["voltage"] for rail in result["supply"]["rails"]] == [5.0]
    assert result["supply"]["stall"] == pytest.approx(1.47 * 12)
    assert "converter" not in (folder / "bom.csv").read_text()
    drawing = (folder / "figures" / "wiring.svg").read_text()
    assert "pitch2" in drawing
    assert "converter" not in drawing
