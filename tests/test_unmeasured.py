"""Zeros and directions are measured or absent: who refuses without them, who says so, who knows."""

from __future__ import annotations

import contextlib
import json
import math
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from doctor_rig import Patient
from lockstep import BoardPort, LockstepClock
from setup_rig import ROBOT, Script
from stated import STATED, stated
from test_jog import Ready
from test_robot_commands_read import boxed
from twin_rig import rig

from antennate.cli import doctor, main, setup
from antennate.hardware.config import DoctorConfig, DriveConfig, RobotFile
from antennate.hardware.doctor.check import Row
from antennate.hardware.doctor.checkup import examine
from antennate.hardware.driving import connect
from antennate.hardware.driving.drive import drive
from antennate.params.base import read_file
from antennate.params.hardware import ZerosParams
from antennate.params.safety import TouchCheckParams
from antennate.robots.spec import RobotSpec
from antennate.studies.formats import to_toml
from antennate.telemetry.feed import Feed
from antennate.twin.config import TwinConfig, watched

ANTENNATE = [sys.executable, "-m", "antennate"]
PORTS = ["--esp32", "/no/board", "--bus", "/no/bus"]
NAMES = ROBOT.joint_names
TICK = 0.0015339807878856412  # rad: a turn has 4096
DONE = f"[setup]\ndone = {json.dumps(NAMES)}\n"
YAW = "[robot.yaw]\nids = [1, 2, 3, 4, 5]\n"
LEGS = "[robot.legs]\nids = [6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17]\n"
ZEROS = {"yaw": [2048] * 5, "legs": [2048] * 12, "antennae": [2048] * 2}
CURVE = {
    "polarity": -1,
    "counts_low": 1399.0,
    "counts_high": 1872.0,
    "midpoint": 0.305,
    "slope": 18.3,
}
"""The default."""
KNOWN = ("yaw", "legs", "antennae", "pitch", "elevation")
ONES = {name: [1] * len(zeros) for name, zeros in ZEROS.items()}


def lists(**of: dict[str, list[int]]) -> str:
    """Lists of each group as TOML."""
    return "".join(
        f"[robot.{name}]\n" + "".join(f"{what} = {by[name]}\n" for what, by in of.items())
        for name in ZEROS
    )


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A robot.toml as `setup` leaves it: ids and what is done, neither zeros nor directions."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.toml").write_text(YAW + LEGS + "[robot.antennae]\nids = [18, 19]\n" + DONE)
    return Path("robot.toml")


FILES = {
    "nothing": ("", "found none; "),
    "no directions": (lists(zeros=ZEROS), "found none; "),
    "no zeros": (lists(directions=ONES), "found none; "),
    "no antennae": (
        lists(zeros=ZEROS, directions=ONES).partition("[robot.antennae]")[0],
        "found none of antenna_l_base, antenna_r_base; ",
    ),
    "another servo": (
        lists(zeros=ZEROS, directions=ONES) + '[zeros]\nmissing = ["yaw3"]\n',
        "found none of yaw3; ",
    ),
}


@pytest.mark.parametrize("command", [["drive"], ["drive", "teleop"]])
@pytest.mark.parametrize("text", FILES)
def test_no_robot_is_armed_before_zeros_and_directions_are_known(
    command: list[str], text: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Refused before any port is opened, and nothing is left behind."""
    file.write_text(FILES[text][0])
    assert main([*command, *PORTS, "--arm"]) == 2
    *_, line = capsys.readouterr().err.splitlines()
    expected = "--arm: expected measured zeros and directions of all joints, "
    assert f"{expected}{FILES[text][1]}`" in line
    assert "antennate setup zero` measures them" in line
    assert [path.name for path in file.absolute().parent.iterdir()] == ["robot.toml"]


def test_what_stands_in_the_file_arms(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file.write_text(lists(zeros=ZEROS, directions=ONES))
    assert main(["drive", *PORTS, "--arm"]) == 2
    assert "/no/b" in capsys.readouterr().err.splitlines()[-1]  # only the ports are not there


def test_a_session_of_such_a_robot_gets_no_torque() -> None:
    """Whoever asks, and however long: the supervisor is told."""
    made = rig(TwinConfig())
    made.session.unfit = "no zeros"
    patience = TouchCheckParams(patience=0.5)
    config = DriveConfig(dry_run=0.3, duration=0.5, touch_check=False, touch=patience)
    report = drive(made.session, config, arm=True)
    assert "NOT_READY: something speaks against arming (no zeros)" in report.refusal
    assert (report.on, made.session.touched) == (None, False)


@pytest.mark.parametrize(
    ("robot", "missing", "why"),
    [
        (RobotSpec(), (), "all joints, found none; `"),
        (stated(), ("yaw3",), "all joints, found none of yaw3; `"),
        (stated(), (), ""),
    ],
)
def test_ports_that_python_opened_give_such_a_robot_no_torque(
    robot: RobotSpec, missing: tuple[str, ...], why: str
) -> None:
    clock = LockstepClock(twin := watched(TwinConfig())[0])
    config = DriveConfig(
        robot=robot,
        zeros=ZerosParams(missing=missing),
        dry_run=0.3,
        duration=0.5,
        touch_check=False,
        touch=TouchCheckParams(patience=0.5),
    )
    session = connect.prepare(config, BoardPort(twin, clock), clock, clock)
    report = drive(session, config, arm=True)
    assert why in report.refusal
    assert (report.on is None, session.touched) == (bool(why), not why)


@pytest.fixture
def twin(monkeypatch: pytest.MonkeyPatch) -> LockstepClock:
    """A twin in invented time at the ports that a drive opens."""
    robot = watched(TwinConfig(), 5)[0]
    clock = LockstepClock(robot)
    ports: dict[str, Any] = {"/no/board": BoardPort(robot, clock), "/no/bus": clock}
    for port in ports.values():
        monkeypatch.setattr(port, "close", lambda: None, raising=False)
    monkeypatch.setattr(connect, "finder", lambda address, *_: ports[address])
    monkeypatch.setattr(connect, "Reconnecting", lambda port: port)
    monkeypatch.setattr(connect, "HostClock", lambda: clock)
    monkeypatch.setattr(Feed, "watched", property(lambda feed: True))  # its time is invented
    return clock


@pytest.mark.ci
@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 2, "--arm is refused: expected measured zeros and directions of all joints, found"),
        (STATED, 0, "; --arm lets the robot walk."),
    ],
)
def test_a_dry_run_says_that_arming_is_refused(
    words: list[str],
    code: int,
    said: str,
    file: Path,
    twin: LockstepClock,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["drive", *PORTS, *words, "--dry-run", "1.5", "--out", "run"]) == code
    assert said in " ".join(capsys.readouterr().out.split())
    result = json.loads(Path("run/result.json").read_text())
    assert bool(result["refusal"]) == (code == 2)
    assert (result["torque_off"], result["commands_sent"]) == (None, 0)


def of_robot(config: DoctorConfig, patient: Patient) -> dict[str, Row]:
    """Rows of the doctor about the robot itself."""
    ports = ("/dev/bus", patient.bus), ("/dev/esp32", patient.esp32)
    checkup = examine(config, *ports, patient.clock.now)
    return {row.check: row for row in checkup.rows if row.part == "robot"}


def test_the_doctor_names_every_number_that_nobody_has_measured() -> None:
    rows = of_robot(DoctorConfig(), Patient())
    assert {check: row.grade for check, row in rows.items()} == {
        "zeros and directions": "bad",
        "ids": "warn",
        "joint limits": "note",
        "supply limits": "note",
        "left calibration": "warn",
        "right calibration": "warn",
    }
    assert rows["zeros and directions"].found == "not measured"
    assert "setup zero" in rows["zeros and directions"].cure
    assert rows["ids"].found == "assumed: 1-19 in the order of the joints"
    # 2 atan(2 (60 - 33 - 1) mm / 200 mm) is 29.1 deg
    assert rows["joint limits"].found == "assumed: yaw 29 deg, antennae 90 deg"
    supply = "supply_warn 10.8, supply_hold 10.2, supply_off 9.6 V, of three lithium cells"
    assert rows["supply limits"].found == f"assumed: {supply}"
    assert rows["left calibration"].found == "assumed: that of a simulated antenna"
    assert all(row.cure for row in rows.values())


def test_what_is_stated_is_not_named() -> None:
    spec = stated().model_dump()
    for name, first in (("yaw", 1), ("legs", 6), ("antennae", 18)):
        spec[name]["ids"] = range(first, first + len(spec[name]["zeros"]))
    spec["yaw"]["limit"], spec["antennae"]["limit"] = 0.4, 1.2
    config = DoctorConfig.model_validate(
        {
            "robot": spec | {"imu": {"kind": "head"}},
            "zeros": {"measured": "2026-11-29", "missing": ["leg_r2"]},
            "limits": {"supply_warn": 10.8, "supply_hold": 10.2, "supply_off": 9.6},
            "control": {"conditioning": CURVE},
        }
    )
    rows = of_robot(config, Patient(robot=config.robot))
    told = rows.pop("zeros and directions")
    assert (told.grade, told.found) == ("bad", "not measured: leg_r2")
    assert {check for check, row in rows.items() if row.grade != "ok"} == {
        "right calibration",
        "inertial axes",
    }
    assert rows["right calibration"].found == "assumed: that of the left one"
    both = config.model_copy(update={"zeros": config.zeros.model_copy(update={"missing": ()})})
    told = of_robot(both, Patient(robot=config.robot))["zeros and directions"]
    assert (told.grade, told.found) == ("ok", "measured on 2026-11-29")
    plain = DoctorConfig(robot=stated())
    told = of_robot(plain, Patient())["zeros and directions"]
    assert (told.grade, told.found) == ("ok", "in its file, without a date")


@pytest.fixture
def examined(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """The command `doctor` before a twin with faults."""

    def run(*words: str, fault: str = "") -> int:
        patient = Patient(*([fault] if fault else []))
        by_flag = {"--bus": patient.bus, "--esp32": patient.esp32}
        monkeypatch.setattr(doctor, "opener_of", lambda address, flag, *_: by_flag[flag])
        monkeypatch.setattr(doctor, "HostClock", lambda: patient.clock)
        return main(["doctor", "--bus", "bus", "--esp32", "esp32", *words])

    return run


def test_the_doctor_lets_no_robot_walk_that_was_set_up_and_never_zeroed(
    file: Path, examined: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert examined() == 2
    said = " ".join(capsys.readouterr().out.split())
    assert "must not be driven yet: 1 of 44 checks are bad, 2 warn." in said
    file.write_text(lists(zeros=ZEROS, directions=ONES))
    assert examined() == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "no check is bad, 3 of 44 warn; numbers assumed: 2." in said


@pytest.mark.parametrize("base", ["", 'base = "scuttle"\n', 'base = "mine.toml"\n'])
def test_a_number_is_stated_whatever_it_is_and_assumed_only_where_it_is_not(
    base: str, file: Path, examined: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    """Each number of the file is the default, and none of them stands for its neighbour."""
    Path("mine.toml").write_text("leg_width = 0.016\n[legs]\nfastest = 4.5\n")
    known = lists(zeros=ZEROS, directions=ONES).replace(
        "antennae]\n", "antennae]\nlimit = 1.5707963267948966\n"
    )
    file.write_text(
        f"[robot]\n{base}{known}ids = [18, 19]\n[limits]\nsupply_hold = 10.2\n"
        "[control.conditioning]\n"
        + "".join(f"{name} = {value}\n" for name, value in CURVE.items() if name != "slope")
    )

    def found() -> dict[str, str]:
        examined("--json")
        said = json.loads(capsys.readouterr().out)["rows"]
        return {row["check"]: row["found"] for row in said if row["part"] == "robot"}

    rows = found()
    assert rows["joint limits"] == "assumed: yaw 29 deg"
    assert rows["ids"] == "assumed: 1-17 in the order of the joints"
    of_cells = "assumed: supply_warn 10.8, supply_off 9.6 V, of three lithium cells"
    assert rows["supply limits"] == of_cells
    assert rows["left calibration"] == "assumed: slope 18.3 of a simulated antenna"
    assert rows["right calibration"] == rows["left calibration"]
    words = ("supply_hold = 10.2", "supply_warn = 10.8\nsupply_hold = 10.2\nsupply_off = 9.6")
    file.write_text(file.read_text().replace(*words) + "slope = 18.3\n")
    rows = found()
    assert (rows["supply limits"], rows["left calibration"]) == ("in its file", "in its file")
    assert rows["right calibration"] == "assumed: that of the left one"


def test_steps_of_an_inertial_sensor_that_are_stated_are_not_assumed() -> None:
    step = 0.035 * math.pi / 180  # the default: 35 mdeg/s
    for more, lack in (({}, 4), ({"gyro_step": step}, 3)):
        config = DoctorConfig.model_validate({"robot": {"imu": {"kind": "head", **more}}})
        row = of_robot(config, Patient(robot=config.robot))["inertial axes"]
        assert row.found.startswith("assumed: x, y, ")
        assert ("gyro_step" in row.found, len(row.found.split(","))) == (not more, lack)
        assert "accel_step 0.002" in row.found  # 0.244 mg


def test_a_servo_that_the_doctor_gives_an_id_has_no_zero(
    file: Path, examined: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    """The one before it had one; the file says so at once, and so does the same examination."""
    file.write_text(lists(zeros=ZEROS, directions=ONES))
    assert examined("--fix", "--yes", fault="servo:7=id:99") == 2
    assert "not measured: leg_r0" in " ".join(capsys.readouterr().out.split())
    assert tomllib.loads(file.read_text())["zeros"]["missing"] == ["leg_r0"]
    file.write_text(lists(zeros=ZEROS, directions=ONES))
    assert examined("--fix", "--yes", fault="servo:7=return_delay_time:250") == 0
    assert "zeros" not in tomllib.loads(file.read_text())


def scripted(patch: pytest.MonkeyPatch, script: Script) -> None:
    """Let a script answer in place of a person."""
    patch.setattr(script, "close", lambda: None, raising=False)
    patch.setattr(setup, "TerminalPerson", lambda: script)


def test_a_servo_that_is_set_up_anew_has_no_zero_even_if_that_fails(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is noted before the servo is changed: a program that was killed would not come to it."""
    file.write_text(lists(zeros=ZEROS, directions=ONES))
    box = boxed(monkeypatch, setup, RobotSpec(), ready=True)
    box.plug("yaw3", "yaw4")
    seen: list[Any] = []
    pattern = "connect the servo of yaw3"
    steps: list[Any] = [
        (pattern, None, ""),
        ("expected one servo alone", lambda: seen.append(missing(file)), None),
        (pattern, None, "q"),
    ]
    scripted(monkeypatch, Script(steps))
    words = ["setup", "--bus", "bus", "--esp32", "esp32", "--only", "yaw3"]
    assert main(words) == 0
    assert seen == [("yaw3",)]
    assert main(["drive", *PORTS, "--arm"]) == 2
    assert "found none of yaw3; " in capsys.readouterr().err


def missing(file: Path) -> tuple[str, ...]:
    """Joints that a file names as not measured."""
    return read_file(file, RobotFile).zeros.missing


def zeroed(patch: pytest.MonkeyPatch, moved: tuple[str, ...], *words: str) -> None:
    """`setup zero` of a robot whose joints are moved or kept."""
    box = boxed(patch, setup, RobotSpec(), ready=True)
    turns = {name: lambda s=s: s.place(s.position - 300) for name, s in box.servos.items()}
    steps: list[Any] = [("straight", None, "")]
    steps += [
        (f": {n}: ", turn if n in moved else None, None if n in moved else "s")
        for n, turn in turns.items()
    ]
    scripted(patch, Script(steps))
    assert main(["setup", "zero", "--bus", "bus", *words]) == 0


def test_zero_writes_when_it_measured_and_of_which_joints_it_did_not(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before = time.strftime("%Y-%m-%d")
    zeroed(monkeypatch, NAMES[1:])
    found = read_file(file, RobotFile)
    assert found.zeros.missing == ("yaw1",)
    assert before <= found.zeros.measured <= time.strftime("%Y-%m-%d")
    assert found.robot.directions == (1, *[-1] * 18)
    assert "setup zero\n" in capsys.readouterr().err  # what is next
    zeroed(monkeypatch, NAMES[:1])  # the directions of the others stand in the file now
    found = read_file(file, RobotFile)
    assert (found.zeros.missing, found.robot.directions) == ((), (-1,) * 19)
    assert "doctor\n" in capsys.readouterr().err
    assert found.robot.ids == tuple(range(1, 20))


def test_directions_that_are_kept_are_those_of_the_file_or_none(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file.write_text(lists(directions=ONES))
    zeroed(monkeypatch, (), "--keep-directions")
    assert missing(file) == ()
    file.write_text("")
    zeroed(monkeypatch, (), "--keep-directions")
    assert missing(file) == NAMES


def test_jog_moves_a_joint_without_a_zero_a_little_from_where_it_stands() -> None:
    """That is what it is for, before and while directions are measured: 0.35 rad, 228 ticks."""
    ready = Ready(measured=False)
    ready.servo.place(2900.0)  # the joint's limit of 29 deg about 2048 would be far away
    jog = ready.jog(step=0.2)
    assert jog.look().angle == pytest.approx(0.0, abs=2 * TICK)
    for _ in range(9):
        jog.step(1)
    assert jog.look().goal == pytest.approx(0.35)
    ready.wait(jog, 2.0)
    assert ready.servo.position == pytest.approx(2900 + 0.35 / TICK, abs=12)
    assert jog.end() == []


def test_jog_says_so(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(setup, "write", said.append)
    boxed(monkeypatch, setup, RobotSpec(), ready=True)
    keys = iter("+q")
    monkeypatch.setattr(setup, "typed_keys", lambda: contextlib.nullcontext(lambda _: [next(keys)]))
    assert main(["setup", "jog", "--bus", "bus"]) == 0
    assert said[0].startswith("yaw1: its zero or direction is not measured: at most 20 deg from")
    keys = iter("+q")
    said.clear()
    assert main(["setup", "jog", "--bus", "bus", *STATED]) == 0
    assert said == ["yaw1: torque is off, verified\n"]


def test_the_twin_writes_the_file_of_its_robot(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With what a builder measures on a robot; a file that it has not written is left alone."""
    robot = RobotSpec.named("scuttle3d")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text("[robot.yaw]\nzeros = [2000, 2001, 2002, 2003, 2004]\n")
    words = ["twin", "--duration", "0.1", "--robot", "scuttle3d", "--robot-toml"]
    for _ in range(2):  # the next twin has other ports
        assert main([*words, "twin.toml"]) == 0
    paths = json.loads(capfd.readouterr().out.splitlines()[-1])
    found = read_file(tmp_path / "twin.toml", RobotFile)
    assert dict(found.ports) == paths
    assert (found.robot.ids, found.robot.zeros) == (tuple(range(1, 27)), (2048,) * 26)
    assert found.robot.model_dump(exclude={*KNOWN}) == robot.model_dump(exclude={*KNOWN})
    assert found.robot.unstated("ids", "zeros", "directions") == ()
    assert found.limits.covered == 0.8  # how far the simulated sensor goes on bending
    mine = (tmp_path / "mine.toml").read_text()
    assert main([*words, "mine.toml"]) == 2
    assert "--robot-toml: expected no file yet, or one of a twin" in capfd.readouterr().err
    assert (tmp_path / "mine.toml").read_text() == mine


@contextlib.contextmanager
def served(folder: Path) -> Iterator[list[str]]:
    """The shipped twin, which writes twin.toml: its ports as flags."""
    words = [*ANTENNATE, "twin", "--robot-toml", "twin.toml"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=folder) as process:
        assert process.stdout is not None
        paths = json.loads(process.stdout.readline())
        try:
            yield ["--esp32", paths["esp32"], "--bus", paths["bus"]]
        finally:
            process.send_signal(signal.SIGTERM)


@pytest.mark.slow
def test_the_shipped_commands_before_the_shipped_twin(tmp_path: Path) -> None:
    """Without zeros nothing walks; with those that the twin knows, it does."""

    def ran(*words: str) -> tuple[int, str]:
        done = subprocess.run(
            [*ANTENNATE, *words], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        return done.returncode, " ".join((done.stdout + done.stderr).split())

    with served(tmp_path) as ports:
        code, said = ran("doctor", *ports)
        assert (code, "The robot must not be driven yet: " in said) == (2, True)
        code, said = ran("drive", *ports, "--dry-run", "1.5")
        assert (code, "--arm is refused" in said) == (2, True)
        code, said = ran("drive", *ports, "--arm")
        assert (code, "found none; " in said) == (2, True)
        assert [path.name for path in (tmp_path / "runs").iterdir()] == ["drive-1"]
        more = ("--no-touch-check", "--dry-run", "1", "--duration", "2")
        code, said = ran("drive", "--config", "twin.toml", "--arm", *more)
        assert code == 0, said
        assert re.search(r"The robot walked for [12]\.\d s", said)
        assert "torque is off, verified" in said


def test_a_file_that_says_so_is_written_and_read_alike() -> None:
    config = RobotFile.model_validate({"zeros": {"measured": "2026-11-29", "missing": ["yaw1"]}})
    assert RobotFile.model_validate(tomllib.loads(to_toml(config))).zeros == config.zeros
