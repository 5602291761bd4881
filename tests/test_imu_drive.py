"""The inertial sensor through bytes: as in simulation, judged, lost, logged and replayed."""

from __future__ import annotations

import json
import math
import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from doctor_rig import Patient, wrong
from driven_rig import driven, simulated_alike
from lockstep import BoardPort, LockstepClock
from stated import words as stated_words
from test_drive_processes import ANTENNATE, ATTEMPTS, NO_SERVO
from twin_rig import rig

from antennate import simulate
from antennate.cli import main
from antennate.control.registry import CONTROLLERS, make_controller
from antennate.errors import BadInputError
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.config import DriveConfig, RecordConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.report import Report
from antennate.hardware.esp32 import datagram, frame
from antennate.hardware.esp32.board import Board
from antennate.hardware.esp32.recording import Recorder, read_esp32
from antennate.hardware.ports.network import Verifier
from antennate.hardware.safety.imu import ImuDiagnosis, ImuFinding
from antennate.hardware.safety.session import Session
from antennate.params.control import ControlParams
from antennate.params.hardware import NetworkParams
from antennate.robots.imu import ImuParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.replay import ReplayRobot, replay
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import IMU
from antennate.telemetry.writer import LogWriter
from antennate.twin.config import TwinConfig, watched
from antennate.twin.faults import Faults, read
from antennate.types import AntennaFrame, Floats, JointCommand, State

ROBOT = RobotSpec.named("scuttle3d")
G = 9.81
STEP = ROBOT.imu.steps


def felt(frame_: AntennaFrame) -> Floats:
    """Angular velocity and specific force of one frame, shape (6,)."""
    return np.concatenate([frame_.angular_velocity[0], frame_.linear_acceleration[0]])


class Turning:
    """Bends to and fro, by as much as it felt itself turn; keeps what it was given."""

    frames: list[AntennaFrame]

    def __init__(self, control: object, robot: RobotSpec, batch: int) -> None:
        self._robot, self._batch, self._ticks = robot, batch, 0
        self.maneuver = np.zeros(batch, dtype=int)
        self.contact = np.zeros((batch, 2), dtype=int)
        self.level = np.zeros((batch, 2))
        self.turned = np.zeros(batch)

    def reset(self, rows: object, phase: Floats | float = 0.0) -> None:
        self._ticks = 0

    def step(self, frame: AntennaFrame) -> JointCommand:
        Turning.frames.append(frame.copy())
        shapes = self._robot.command_shapes(self._batch).items()
        command = JointCommand(**{name: np.zeros(shape) for name, shape in shapes})
        if frame.angular_velocity.size:
            self.turned += 0.01 * np.nan_to_num(frame.angular_velocity[:, 2])
        command.yaw[:] = 0.2 * math.sin(0.04 * self._ticks) - 0.01 * self.turned[:, None]
        self._ticks += 1
        return command


@pytest.fixture(autouse=True)
def turning(monkeypatch: pytest.MonkeyPatch) -> None:
    Turning.frames = []
    monkeypatch.setitem(CONTROLLERS.added, "turning", Turning)
    monkeypatch.setitem(CONTROLLERS.added, "noting", Noting)


class Noting:
    """The controller `closed`, which walks as it is asked to; keeps what it was given."""

    def __init__(self, control: ControlParams, robot: RobotSpec, batch: int) -> None:
        self._inner = make_controller("closed", control, robot, batch)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def step(self, frame: AntennaFrame) -> JointCommand:
        Turning.frames.append(frame.copy())
        return self._inner.step(frame)


def test_the_controller_is_handed_what_a_simulation_hands_it() -> None:
    """Bit by bit, through the bytes of the board."""
    config = TunnelConfig(robot=ROBOT)
    one = driven(config, "noting", 0, 60)
    first, Turning.frames = Turning.frames, []
    simulated_alike(config, "noting", 0, one.start, 60)
    pairs = list(zip(first, Turning.frames, strict=False))[-60:]
    for through_bytes, plain in pairs:
        np.testing.assert_array_equal(felt(through_bytes), felt(plain))
    values = np.array([felt(plain) for _, plain in pairs])
    assert values[:, 2].std() > 0.05  # it turns
    assert values[:, 5].mean() == pytest.approx(G, abs=0.7)


def faulty(fault: str, robot: RobotSpec = ROBOT) -> tuple[Report, Session, list[Tick]]:
    """A drive with a fault from 1.5 s on."""
    made = rig(TwinConfig(robot=robot, scene="flat"), "turning")
    faults = Faults([read(f"{fault}@1.5s")], robot.ids, has_imu=robot.has_imu)
    config = DriveConfig(robot=robot, dry_run=0.3, duration=2.5, touch_check=False)
    ticks = list[Tick]()

    def on_tick(session: Session, t: float) -> None:
        faults.apply(made.robot, made.robot.t)
        ticks.append(Tick.of(session, t))

    return drive(made.session, config, arm=True, on_tick=on_tick), made.session, ticks


@pytest.mark.parametrize(
    ("fault", "words", "soon"),
    [
        ("imu=silent", "no answer", 0.02),
        pytest.param("imu=stuck", "always the same readings", 0.12, marks=pytest.mark.slow),
        ("imu=railed", "readings at the end of the range", 0.02),
    ],
)
def test_a_sensor_that_is_lost_makes_its_numbers_nan_and_stops_nothing(
    fault: str, words: str, soon: float
) -> None:
    report, session, ticks = faulty(fault)
    assert report.worst == State.DEGRADED
    cause = "the inertial sensor gives nothing that can be used"
    assert report.why == f"DEGRADED IMU: {cause} ({words})"
    assert report.ended == "the end of its time"
    assert report.on == []
    unknown = [tick.now for tick in ticks if np.isnan(tick.angular_velocity).all()]
    lost = [now for now in unknown if now > 1.0]
    assert 1.5 - 0.02 <= lost[0] <= 1.5 + soon + 0.02
    assert all(np.isfinite(tick.angular_velocity).all() for tick in ticks if 1.0 < tick.now < 1.48)
    assert np.isnan(ticks[-1].linear_acceleration).all()
    assert np.isfinite(ticks[-1].counts).all()
    counted: Any = report.result(session)["imu_readings"]
    unnamed = 10 if fault == "imu=railed" else 0  # those of the first 100 ms
    assert counted[{"silent": "missing"}.get(fault[4:], fault[4:])] >= len(lost) - unnamed - 3
    assert counted["ok"] > 100
    sent = [tick.sent for tick in ticks if tick.now > lost[0]]
    assert sent[-1] - sent[0] > 80  # it walks on


def test_a_controller_at_less_than_full_pace_is_told_no_rates() -> None:
    """With a low battery it is left out in every second tick, and would miss half of a turn."""
    made = rig(TwinConfig(robot=ROBOT, scene="flat"), "turning")
    faults = Faults([read("bus=discharge:0.3@1.0s")], ROBOT.ids, has_imu=True)
    config = DriveConfig(robot=ROBOT, dry_run=0.3, duration=3.5, touch_check=False)
    full, slow = list[Tick](), list[Tick]()

    def on_tick(session: Session, t: float) -> None:
        faults.apply(made.robot, made.robot.t)
        if t > 1.0:
            (full if session.control.rate == 1.0 else slow).append(Tick.of(session, t))

    report = drive(made.session, config, arm=True, on_tick=on_tick)
    assert report.ended == "the end of its time"
    assert len(full) > 30
    assert len(slow) > 30
    for ticks, unknown in ((full, False), (slow, True)):
        values = np.array([[tick.angular_velocity, tick.linear_acceleration] for tick in ticks])
        assert np.isnan(values).all() == np.isnan(values).any() == unknown
    assert made.session.imu is not None
    assert made.session.imu.finding is ImuFinding.OK  # nothing is wrong with the sensor


def test_one_that_comes_back_is_used_again() -> None:
    made = rig(TwinConfig(robot=ROBOT, scene="flat"), "turning")
    faults = Faults([read("imu=silent@0.5s"), read("imu=none@0.8s")], ROBOT.ids, has_imu=True)
    config = DriveConfig(robot=ROBOT, dry_run=0.3, duration=1.0, touch_check=False)
    drive(made.session, config, True, lambda session, t: faults.apply(made.robot, made.robot.t))
    assert made.session.imu is not None
    assert made.session.imu.finding is ImuFinding.OK
    assert 25 <= made.session.imu.counted[ImuFinding.MISSING] <= 35
    missed = made.robot.imu.misses  # pyright: ignore[reportOptionalMemberAccess]
    assert made.session.imu.result()["missed_by_board"] == missed >= 25


def test_a_robot_without_one_is_told_nothing_and_refuses_its_faults() -> None:
    plain = RobotSpec()
    made = rig(TwinConfig(robot=plain, scene="flat"), "turning")
    config = DriveConfig(robot=plain, dry_run=0.1, duration=0.3, touch_check=False)
    report = drive(made.session, config, arm=True)
    assert all(not each.angular_velocity.size for each in Turning.frames)
    assert "imu_readings" not in report.result(made.session)
    with pytest.raises(BadInputError, match="expected a robot with an inertial sensor"):
        Faults([read("imu=stuck")], plain.ids)
    with pytest.raises(BadInputError, match="expected one of silent, stuck, railed, none for imu"):
        read("imu=broken")


def test_a_board_without_one_is_named() -> None:
    """The robot has one, its board sends plain samples."""
    plain = ROBOT.model_copy(update={"imu": ImuParams()})
    made = rig(TwinConfig(robot=plain, scene="flat"), "turning")
    made.session.imu = ImuDiagnosis(ROBOT.imu)
    config = DriveConfig(robot=ROBOT, dry_run=0.1, duration=0.5, touch_check=False)
    report = drive(made.session, config, arm=True)
    assert "IMU: the inertial sensor gives nothing that can be used (no answer)" in report.why
    assert report.worst == State.DEGRADED


def replayed(log: Path) -> Any:
    """A log decided upon anew by the same controller."""
    with LogReader(log) as reader:
        header, ticks = reader.header, [tick for _, tick in reader.groups() if tick is not None]
    return replay(ticks, Turning(None, header.robot, 1), header), ticks, header


def test_a_simulation_logs_what_was_felt_and_is_replayed_to_the_bit(tmp_path: Path) -> None:
    log = tmp_path / "walk.mcap"
    series = simulate("turning", robot=ROBOT, scene="flat", time_limit=1.0, log=log)
    given, Turning.frames = Turning.frames, []
    found, ticks, header = replayed(log)
    assert (found.commands, found.different, len(ticks)) == (0, 0, len(series.t))
    assert header.robot == ROBOT
    logged = np.array([[tick.angular_velocity, tick.linear_acceleration] for tick in ticks])
    np.testing.assert_array_equal(series.angular_velocity, logged[:, 0])
    np.testing.assert_array_equal(series.columns()["linear_acceleration_z"], logged[:, 1, 2])
    for then, now in zip(given[: len(ticks)], Turning.frames, strict=True):
        np.testing.assert_array_equal(felt(then), felt(now))
    silent = [replace(tick, angular_velocity=(), linear_acceleration=()) for tick in ticks]
    assert np.isnan(felt(ReplayRobot(silent, header).read())).all()


def test_a_message_is_that_of_ros(tmp_path: Path) -> None:
    """sensor_msgs/Imu by another decoder: 37 numbers behind its header, no orientation."""
    log = tmp_path / "walk.mcap"
    series = simulate("turning", robot=ROBOT, scene="flat", time_limit=0.2, log=log)
    with LogReader(log) as reader:
        data = [r.data for records, _ in reader.groups() for r in records if r.topic is IMU]
    assert len(data) == len(series.t)
    body = data[-1][4:]
    name_at = 8
    length = int.from_bytes(body[name_at : name_at + 4], "little")
    assert body[name_at + 4 : name_at + 4 + length] == b"link0\0"
    at = -(-(name_at + 4 + length) // 8) * 8
    numbers = np.frombuffer(body, "<f8", offset=at)
    assert len(numbers) == 4 + 9 + 3 + 9 + 3 + 9
    assert (numbers[3], numbers[4]) == (1.0, -1.0)
    np.testing.assert_array_equal(numbers[13:16], series.angular_velocity[-1])
    np.testing.assert_array_equal(numbers[25:28], series.linear_acceleration[-1])


@pytest.mark.ci
def test_a_drive_is_logged_exported_and_replayed_to_the_bit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With a sensor that falls silent in it."""
    _, _, ticks = faulty("imu=silent")
    log, table = tmp_path / "drive.mcap", tmp_path / "drive.csv"
    header = Header(controller="open", params=ControlParams(), robot=ROBOT)
    with LogWriter(log, header) as out:
        for tick in ticks:
            out.write(Tick.unpack(tick.pack()))
    Turning.frames = []
    found, back, _ = replayed(log)
    assert (found.commands, found.failures) == (0, 0)
    for then, now in zip(ticks, back, strict=True):
        np.testing.assert_array_equal(then.angular_velocity, now.angular_velocity)
    assert main(["log", "export", str(log), "--out", str(table)]) == 0
    capsys.readouterr()
    names, *rows = (line.split(",") for line in table.read_text().splitlines())
    at = names.index("angular_velocity_x")
    assert names[at : at + 6] == [
        *(f"angular_velocity_{axis}" for axis in "xyz"),
        *(f"linear_acceleration_{axis}" for axis in "xyz"),
    ]
    assert float(rows[100][at + 5]) == ticks[100].linear_acceleration[2]
    assert math.isnan(float(rows[-1][at] or "nan"))


def test_the_log_of_a_twin_holds_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain = simulate("turning", robot=RobotSpec(), scene="flat", time_limit=0.1)
    assert plain.angular_velocity.size == 0
    assert not any(name.startswith("angular") for name in plain.columns())
    robot = watched(TwinConfig(robot=ROBOT, scene="flat"))[0]
    assert robot.frame.linear_acceleration[0, 2] == pytest.approx(G, abs=5 * 0.02 * G)
    capsys.readouterr()


@pytest.mark.parametrize(
    ("fault", "found"),
    [
        ("imu=silent", "no answer"),
        ("imu=stuck", "always the same readings"),
        ("imu=railed", "readings at the end of the range"),
    ],
)
def test_the_doctor_names_it(fault: str, found: str) -> None:
    robot = RobotSpec(imu={"kind": "head"})  # pyright: ignore[reportArgumentType]
    rows = wrong(Patient(robot=robot).examine(bus=False))
    assert not [name for name in rows if "inertial" in name or "turning" in name]
    row = wrong(Patient(fault, robot=robot).examine(bus=False))["esp32: inertial sensor"]
    assert row.found.startswith(found)
    assert row.grade == "warn"
    assert row.cure
    assert row.found.endswith("missed since the board began") == (fault == "imu=silent")


def test_the_doctor_says_where_up_is() -> None:
    """The board counts 8 g in 0.244 mg; the file of the robot says a fifth less."""
    other = ROBOT.imu.model_copy(update={"accel_step": 0.8 * ROBOT.imu.accel_step})
    patient = Patient(robot=ROBOT)
    patient.spec = ROBOT.model_copy(update={"imu": other})
    row = wrong(patient.examine(bus=False))["esp32: upwards"]
    assert "IMU_AXES" in row.cure
    assert float(row.found.split(", ")[2].split()[0]) == pytest.approx(0.8 * G, abs=0.06 * G)
    assert row.found.endswith("m/s²")


@pytest.mark.parametrize(
    ("axes", "name"),
    [((1, -3, 2), "-y"), ((-1, -2, 3), ""), ((1, -2, -3), "-z"), ((-3, 2, 1), "-x")],
)
def test_the_doctor_says_which_axis_is_up(axes: tuple[int, int, int], name: str) -> None:
    """Axes of the head as such a setting of the board makes them of a sensor as printed."""
    patient = Patient(robot=ROBOT)
    sensor = patient.robot.imu
    assert sensor is not None
    order = [abs(axis) - 1 for axis in axes]
    signs, plain = np.sign(axes), sensor.sample

    def sample(counts: Floats, standing: bool) -> tuple[int, ...]:
        readings = np.array(plain(counts, standing)).reshape(2, 3)
        return tuple((readings[:, order] * signs).ravel().tolist())

    sensor.sample = sample  # pyright: ignore[reportAttributeAccessIssue]
    rows = wrong(patient.examine(bus=False))
    if not name:
        assert "esp32: upwards" not in rows
        return
    assert rows["esp32: upwards"].found.endswith(f"m/s², so {name} points up")


def test_the_doctor_names_a_sensor_that_only_one_of_both_knows() -> None:
    patient = Patient(robot=ROBOT)
    patient.spec = ROBOT.model_copy(update={"imu": ImuParams()})
    row = wrong(patient.examine(bus=False))["esp32: inertial sensor"]
    assert row.found == "answers, and nothing reads it"
    assert "under [robot.imu] of robot.toml" in row.cure
    assert "under [imu] of the file of the robot" in row.cure
    patient = Patient(robot=patient.spec)
    patient.spec = ROBOT
    row = wrong(patient.examine(bus=False))["esp32: inertial sensor"]
    assert row.found == "none on this board"


def test_a_recording_has_its_columns() -> None:
    robot = watched(TwinConfig(robot=ROBOT, scene="flat"))[0]
    robot.imu.trouble = ""  # pyright: ignore[reportOptionalMemberAccess]
    clock = LockstepClock(robot)
    stream = bytearray()

    class Port(BoardPort):
        def read(self, most: int, timeout: float) -> bytes:
            data = super().read(most, timeout)
            stream.extend(data)
            return data

    lines = list[str]()
    params = RecordConfig(duration=0.5)
    Recorder(
        Board(Port(robot, clock)), params, clock.now, lambda text: lambda: True, lines.append
    ).run()
    names = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]
    assert lines[0].split(",") == ["time", "left", "right", *names]
    up = np.array([line.split(",")[8] for line in lines[1:]], float)
    assert up.mean() * ROBOT.imu.accel_step == pytest.approx(G, abs=5 * 0.02 * G)
    found = read_esp32(bytes(stream))
    assert found.imu.shape == (len(found.t), 6)
    assert list(found.to_dataframe().columns[-6:]) == names


def test_signed_datagrams_carry_it() -> None:
    key, nonce, clock = bytes(range(32)), bytes(16), 1.0
    host, signer = Verifier(key, nonce, NetworkParams()), datagram.Signer(key)
    hello = frame.encode_hello(7, 1, 0, b"board", 100)
    encoder = frame.SampleEncoder(7, motion=True)
    board = datagram.Speaker(signer, 7, hello, encoder.size)
    for _ in range(2):
        ask = host.due_ask(clock) or host.ask()
        answer = board.answer(ask, "host", round(1e3 * clock))
        assert answer is not None
        host.take(bytes(answer), clock)
        clock += 1.0
    buffer = bytearray(encoder.size)
    encoder.encode_sample_into(buffer, 3, 30_000, 1800, 1801, 0, 0, (1, 2, 3, 4, 5, 6))
    signed = board.sign(buffer, round(1e3 * clock) - 900)
    assert signed is not None
    assert host.take(bytes(signed), clock) == (bytes(buffer), False)
    signed[20] ^= 1
    assert host.take(bytes(signed), clock) == (b"", False)
    assert host.tally.forged == 1


@contextmanager
def wired(folder: Path) -> Iterator[tuple[list[str], Any]]:
    """A twin of the robot in a process of its own: its addresses, and what takes orders."""
    words = [*ANTENNATE, "twin", "--robot", "scuttle3d", "--scene", "flat", "--orders", "-"]
    pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(words, stderr=subprocess.DEVNULL, cwd=folder, **pipes) as process:
        assert process.stdout is not None
        places = json.loads(process.stdout.readline())
        try:
            yield ["--esp32", places["esp32"], "--bus", places["bus"]], process.stdin
        finally:
            process.kill()


def drive_by_command(run: Path) -> tuple[int, str, str]:
    """`drive` with a sensor that falls silent in it: exit code, what it said on both streams."""
    words = ["drive", "--arm", "--no-touch-check", "--robot", "scuttle3d", "--controller", "climb"]
    words += ["--dry-run", "3", "--duration", "4", *NO_SERVO, "--out", str(run)]
    words += stated_words(RobotSpec.named("scuttle3d"))
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with (
        wired(run.parent) as (places, orders),
        subprocess.Popen([*ANTENNATE, *words, *places], **pipes) as process,
    ):
        assert process.stderr is not None
        lines = list[str]()
        for line in process.stderr:
            lines.append(line)
            sent = re.search(r" sent=(\d+) ", line)
            if sent and int(sent[1]) > 0:
                break
        orders.write("fault imu=silent\n")
        orders.flush()
        said, more = process.communicate()
    return process.returncode, said, "".join([*lines, more])


@pytest.mark.ci
def test_the_command_drives_on_without_it(tmp_path: Path) -> None:
    """Exit code 0, named in the status line and in the last lines; its log replays to the bit.

    A machine that stands still lets the watchdogs end it, as they must; then there is another one.
    """
    run, attempt = tmp_path / "1", 1
    code, said, status = drive_by_command(run)
    while code and attempt < ATTEMPTS:
        attempt += 1
        run = tmp_path / str(attempt)
        code, said, status = drive_by_command(run)
    assert code == 0, status
    result = json.loads((run / "result.json").read_text())
    named = "IMU: the inertial sensor gives nothing that can be used (no answer)"
    assert named in status
    assert result["imu_readings"]["missing"] > 100
    assert result["imu_readings"]["ok"] > 100
    assert result["worst_state"] in ("DEGRADED", "HOLD")
    if result["worst_state"] == "DEGRADED":  # the machine was never late
        assert named in said.replace("\n", " ")
    assert "torque is off, verified" in said
    log = run / result["logs"][0]
    with LogReader(log) as reader:
        ticks = [tick for _, tick in reader.groups() if tick is not None]
    assert np.isnan(ticks[-1].angular_velocity).all()
    assert sum(np.isfinite(tick.angular_velocity).all() for tick in ticks) > 100
    words = [*ANTENNATE, "log", "replay", str(log), "--json"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["different_commands"] == 0
