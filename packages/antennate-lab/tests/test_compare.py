"""`doctor --compare`: joints of a log beside the intervals of a fitted robot."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from protocol_logs import CONTROL, sweeps, write

from antennate.cli import main
from antennate.cli.doctor import VIEW
from antennate.control.protocol import Step
from antennate.errors import BadInputError
from antennate.params.scene import HookParams
from antennate.robots.spec import RobotSpec
from antennate.types import Floats
from antennate_lab.fit import compare
from antennate_lab.fit.simulated import Course, simulated

ANTENNATE = [sys.executable, "-c", "import sys; from antennate.cli import main; sys.exit(main())"]
LEGGED = 'links = 2\nmass = 0.8\n\n[antennae]\nkind = "none"\n'
SMALL = RobotSpec(links=2, mass=0.8, antennae={"kind": "none"})  # type: ignore[arg-type]
"""The robot of LEGGED."""


def fitted(folder: Path, text: str, **intervals: tuple[float, float]) -> Path:
    """A file as `fit` writes it, with intervals of a servo's numbers, or of other ones."""
    blocks = [
        f'[[fitted]]\nname = "{name}"\nlow = {low}\nhigh = {high}\nsource = "measured: drive"\n'
        for name, (low, high) in intervals.items()
    ]
    path = folder / "fitted.toml"
    path.write_text("\n".join([text, *blocks]), encoding="utf-8")
    return path


GAIN, FRICTION, DELAY = (f"servos.xc430_w240.{x}" for x in ("gain_divisor", "friction", "delay"))
KNOWN = {GAIN: (126.0, 130.0), FRICTION: (0.0, 0.002), DELAY: (0.0, 0.002)}
"""Intervals about the numbers of a new robot."""


def compared(
    folder: Path, known: dict[str, tuple[float, float]] | None = None, **numbers: float
) -> compare.Row:
    """The row of the one joint of a log, its servo with other numbers than the file says."""
    servos = {"xc430_w240": SMALL.servos.xc430_w240.model_dump() | numbers}
    truth = RobotSpec.model_validate(SMALL.model_dump() | {"servos": servos})

    def measured(step: Step, goals: Floats) -> Floats:
        none = np.zeros((len(goals), 0))
        course = Course(step.called, HookParams(), CONTROL.period, 0.0, goals, goals, none, none)
        return simulated(truth, course).positions

    log = write(folder / "drive.mcap", SMALL, sweeps(SMALL, "leg_l0"), measured)
    whole, *rows = compare.rows(fitted(folder, LEGGED, **(known or KNOWN)), log)
    assert (whole.part, whole.grade) == ("log", "ok")
    assert [row.check for row in rows] == ["yaw1", "leg_l0", "leg_r0", "leg_l1", "leg_r1"]
    yaw, row, *others = rows
    assert all((o.part, o.grade, o.found) == ("joint", "note", "none") for o in (yaw, *others))
    return row


def numbers_of(words: str) -> dict[str, float]:
    """Numbers of a row by name, those that are told."""
    parts = [part.split() for part in words.split(", ")]
    return {name: float(word.rstrip("°")) for name, word, *_ in parts if word != "not"}


def out_of_range(row: dict[str, str]) -> set[str]:
    """Names of the numbers of a row that are not as fitted."""
    names, found, _ = row["cure"].partition(" not as fitted")
    return set(names.split(" and ")) if found else set()


def test_joint_that_nobody_touched_is_as_fitted(tmp_path: Path) -> None:
    row = compared(tmp_path)
    assert row.grade == "ok", row
    assert numbers_of(row.found)["gain"] == pytest.approx(1.0, abs=0.02)
    assert row.cure == ""


@pytest.mark.ci
@pytest.mark.parametrize(
    ("change", "name", "value", "error"),
    [
        ({"gain_divisor": 256.0}, "gain", 0.5, 0.02),
        ({"delay": 0.02}, "lag", 20.0, 2.0),
        ({"friction": 0.06}, "friction", 0.06, 0.01),
        ({"gain_divisor": 128.0 / 0.75}, "gain", 0.75, 0.02),  # three times the margin hides these
        ({"delay": 0.012}, "lag", 12.0, 2.0),
        ({"friction": 0.045}, "friction", 0.045, 0.01),
    ],
)
def test_joint_that_was_changed_is_named(
    tmp_path: Path, change: dict[str, float], name: str, value: float, error: float
) -> None:
    row = compared(tmp_path, **change)
    assert row.grade == "warn", row
    assert numbers_of(row.found)[name] == pytest.approx(value, abs=error)
    assert f"{name} not as fitted" in row.cure


@pytest.mark.parametrize(
    ("known", "absent"),
    [
        ({"servos.xl330_m288.gain_divisor": (250.0, 262.0)}, ["lag", "gain", "friction"]),
        ({GAIN: (126.0, 130.0), FRICTION: (0.0, 0.002)}, ["lag"]),
        ({DELAY: (0.0, 0.002)}, ["gain", "friction"]),
    ],
)
def test_number_without_an_interval_is_never_as_fitted(
    tmp_path: Path, known: dict[str, tuple[float, float]], absent: list[str]
) -> None:
    """Not even by the value that the file has, and the joint is none that behaves as fitted."""
    row = compared(tmp_path, known)
    assert row.grade == "note"
    assert f"{' and '.join(absent)}: not in the file" in row.cure
    for name in absent:
        assert f"{name}: not in the file" in row.expected
        assert name not in row.found
    rows = [{"part": row.part, "grade": row.grade}]
    assert VIEW.sentence({"rows": rows}) == (
        "Of 1 joints 0 behave as fitted, 1 were not compared in full."
    )


def test_file_without_intervals_and_log_without_sweeps_are_refused(tmp_path: Path) -> None:
    log = write(tmp_path / "drive.mcap", SMALL, sweeps(SMALL, "leg_l0"))
    bare = fitted(tmp_path, LEGGED)
    with pytest.raises(BadInputError, match=r"expected intervals of servos.*found none"):
        compare.rows(bare, log)
    longer = fitted(tmp_path, LEGGED.replace("links = 2", "links = 3"), **KNOWN)
    with pytest.raises(BadInputError, match="with links 3, found 2"):
        compare.rows(longer, log)
    stood = sweeps(SMALL, "leg_l0").model_copy(update={"steps": (Step(name="stand"),)})
    walk = write(tmp_path / "stand.mcap", SMALL, stood)
    with pytest.raises(BadInputError, match="expected steps that sweep one joint"):
        compare.rows(fitted(tmp_path, LEGGED, **KNOWN), walk)


@pytest.mark.parametrize("head", ["", "[robot]\n"])
def test_interval_that_does_not_hold_its_value_is_refused(tmp_path: Path, head: str) -> None:
    """Of a robot's file, and of the table of a robot.toml."""
    table = "[[robot.fitted]]" if head else "[[fitted]]"
    file = fitted(tmp_path, head + 'antennae = { kind = "none" }\n', **{GAIN: (100.0, 110.0)})
    file.write_text(file.read_text().replace("[[fitted]]", table))
    with pytest.raises(BadInputError, match="expected its value within 100 to 110, found 128"):
        compare.rows(file, tmp_path / "none.mcap")


def test_sentence_counts_joints_that_changed_and_those_that_nothing_tells() -> None:
    """Beside what it says of ports, where some were looked at."""
    port = {"part": "bus", "grade": "ok"}
    grades = ("ok", "ok", "warn", "note")
    joints = [{"part": "log", "grade": "ok"}, *({"part": "joint", "grade": g} for g in grades)]
    told = "Of 4 joints 2 behave as fitted, 1 do not, 1 were not compared in full."
    assert VIEW.sentence({"rows": joints}) == told
    driven = "The robot may be driven: all 1 checks are good."
    assert VIEW.sentence({"rows": [port, *joints]}) == f"{driven} {told}"
    assert VIEW.sentence({"rows": [port]}) == driven


def test_doctor_without_the_laboratory_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("antennate.cli.doctor.installed", lambda group: ())
    code = main(["doctor", "--no-config", "--compare", "fit.toml", str(tmp_path / "a.mcap")])
    said = capsys.readouterr().err
    assert code == 2
    assert said.count("\n") == 1
    assert "expected the package antennate-lab" in said


PROTOCOL = "carry = 1.5\n" + "".join(
    f'[[steps]]\nplace = "hanging"\njoint = "{name}"\nlowest = 0.5\nhighest = 8.0\nseconds = 3.0\n'
    for name in ("yaw1", "leg_l1", "leg_r2")
)
HEAD = 'imu = { kind = "head" }\n'
BACKLASH = "yaw.backlash[0]"


LATE = 0.02
"""Share of missed ticks above which `drive` calls a computer late (docs/hardware.md)."""


class Twin:
    """A twin that takes orders from a pipe."""

    def __init__(self, folder: Path, robot: str) -> None:
        self.folder = folder
        os.mkfifo(folder / "orders")
        (folder / "short.toml").write_text(PROTOCOL)
        (folder / "built.toml").write_text(robot)
        words = ["--scene", "flat", "--orders", "orders", "--robot-toml", "twin.toml"]
        self.process = subprocess.Popen(
            [*ANTENNATE, "twin", "--robot", "built.toml", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=folder,
        )
        assert self.process.stdout is not None
        assert json.loads(self.process.stdout.readline())

    def order(self, text: str) -> None:
        (self.folder / "orders").write_text(f"{text}\n")
        time.sleep(0.5)

    def rows(self, out: str, file: Path) -> dict[str, dict[str, Any]]:
        """Record the protocol, compare it, and give the doctor's rows by their check.

        A computer that was late has recorded its own pace: up to four drives are made, until one
        is not late, and the one that missed the fewest ticks is compared.
        """
        words = ["--config", "twin.toml", "--dry-run", "1", "--no-touch-check", "--arm"]
        words += ["--protocol", "short.toml", "--tell", "orders"]
        words += ["--limits.late-answers", "100", "--limits.silent-answers", "100"]
        missed, said = dict[str, float](), []
        while len(said) < 4 and min(missed.values(), default=1.0) > LATE:
            name = f"{out}-{len(said)}"
            drive = [*ANTENNATE, "drive", *words, "--out", name]
            driven = subprocess.run(drive, cwd=self.folder, capture_output=True, timeout=120)
            said.append(driven.stderr.decode())
            result = json.loads((self.folder / name / "result.json").read_text())
            if result["ended"] not in ("a HOLD", "a fault"):
                assert driven.returncode == 0, said
                missed[name] = result["walking"]["missed_share"]
        assert missed, said
        best = min(missed, key=lambda name: missed[name])
        doctor = [*ANTENNATE, "doctor", "--no-config", "--json", "--compare", str(file), best]
        done = subprocess.run(doctor, cwd=self.folder, capture_output=True, timeout=400)
        assert done.returncode == 0, done.stderr.decode()
        return {row["check"]: row for row in json.loads(done.stdout)["rows"]}


@pytest.mark.slow  # .ci/run runs it alone: what servos do is measured in real time
def test_twin_with_joints_repaired_wrongly_is_told_from_one_that_nobody_touched(
    tmp_path: Path,
) -> None:
    """The gain of a leg is halved and given back; a yaw joint has 2 degrees of backlash."""
    known = KNOWN | {BACKLASH: (0.0, 0.001)}
    file = fitted(tmp_path, HEAD, **known)
    twin = Twin(tmp_path, HEAD + "[yaw]\nbacklash = [0.035, 0.0, 0.0, 0.0, 0.0]\n")
    try:
        twin.order("fault servo:8=position_p_gain:350")
        wrong = twin.rows("wrong", file)
        assert wrong["leg_l1"]["grade"] == "warn"
        assert numbers_of(wrong["leg_l1"]["found"])["gain"] == pytest.approx(0.5, abs=0.05)
        assert wrong["yaw1"]["grade"] == "warn"
        assert "backlash not as fitted" in wrong["yaw1"]["cure"]
        assert 1.0 < numbers_of(wrong["yaw1"]["found"])["backlash"] < 3.0
        assert out_of_range(wrong["leg_r2"]) <= {"lag"}
        assert numbers_of(wrong["leg_r2"]["found"])["gain"] == pytest.approx(1.0, abs=0.1)
        twin.order("fault servo:8=position_p_gain:700")
        right = twin.rows("right", file)
        # A lag of the twin is up to a control period more, as its clock happens to stand.
        assert out_of_range(right["leg_l1"]) <= {"lag"}
        assert numbers_of(right["leg_l1"]["found"])["gain"] == pytest.approx(1.0, abs=0.1)
    finally:
        twin.process.kill()
        twin.process.communicate()
