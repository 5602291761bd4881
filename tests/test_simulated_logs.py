"""Logs and films of simulations that have no controller of their own: the gait, and the twin."""

from __future__ import annotations

import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from log_ticks import HEADER, tick
from mcap.reader import make_reader
from mcap.records import Message

import antennate
from antennate.cli import main
from antennate.errors import AntennateError, LogError
from antennate.experiments.tunnel.experiment import EXPERIMENT
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.params.control import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim import engine_setup
from antennate.sim.scenes.registry import make_scene
from antennate.sim.trial import draw_trial
from antennate.sim.world import World
from antennate.telemetry.reader import LogReader
from antennate.telemetry.simulated import Decisions, SimulatedLog, TickLog
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES, EVENTS, JOINT_STATES, MOTION
from antennate.telemetry.twin_log import LogQueue
from antennate.telemetry.writer import LogWriter
from antennate.types import AntennaFrame, Contact, JointCommand, Maneuver
from antennate_lab.gait.experiment import GaitStudyConfig, run
from dynamixel_bus import packets

TICKS = 60
TURN = 4096
"""Ticks of a turn of an X servo (e-manual, register 132)."""
ROBOT = RobotSpec()


@pytest.mark.ci
def test_each_walk_of_the_gait_leaves_a_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its phase runs at the frequency of the gait, and backwards in REVERSE."""
    run_at = ["--out", str(tmp_path / "run"), "--workers", "1", "--no-figures"]
    few = ["--sweep-points", "2", "--cycles", "2", "--settling-cycles", "0"]
    few += ["--gait.frequency", "0.8"]  # a short cycle
    assert main(["gait", "--log", *few, *run_at]) == 0
    logs = {path.stem: path for path in (tmp_path / "run" / "logs").iterdir()}
    assert set(logs) == {"forward", "turn_l", "turn_r", "reverse", "wave_off", "sweep0", "sweep1"}
    gait = GaitParams(frequency=0.8)
    for name, sense in (("forward", 1), ("reverse", -1)):
        with LogReader(logs[name]) as log:
            ticks = list(log)
            assert log.end == len(ticks)
            assert log.header.params.gait == gait
        assert len(ticks) == pytest.approx(2 / gait.frequency / 0.01, abs=2)
        advance = np.diff([tick.phase for tick in ticks])
        assert advance == pytest.approx(sense * 2 * math.pi * gait.frequency * 0.01)
        assert {tick.maneuver for tick in ticks} == {Maneuver[name.upper()]}
        assert {tick.contact for tick in ticks} == {(Contact.UNKNOWN, Contact.UNKNOWN)}
        assert max(abs(tick.angles[0]) for tick in ticks) == pytest.approx(gait.amplitude, rel=0.01)
    for action in (["info"], ["export"], ["plot"]):
        assert main(["log", *action, str(logs["forward"])]) == 0
    capsys.readouterr()
    assert main(["log", "replay", str(logs["forward"])]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "found 'gait'" in said
    assert main(["log", "replay", str(logs["forward"]), "--controller", "open"]) == 0


def test_a_walk_is_the_same_with_and_without_a_log(tmp_path: Path) -> None:
    """And a log that a killed run left half is replaced."""
    gait = GaitParams(frequency=0.8)
    coarse = PhysicsParams(timestep=0.004, contact_time=0.008)
    few = {"sweep_points": 2, "cycles": 2, "settling_cycles": 0, "rate": 50.0}
    config = GaitStudyConfig(**few, gait=gait, physics=coarse)
    (tmp_path / "forward.mcap").write_bytes(b"half")
    logged = run(config, logs=tmp_path)
    assert logged.result() == run(config).result()
    with LogReader(tmp_path / "forward.mcap") as log:
        assert log.ticks == 0 < sum(1 for _ in log)


@pytest.mark.parametrize("phase", ["None", "'turn'", "np.zeros((1, 2))", "1 / 0"])
def test_a_phase_that_is_something_else_is_unknown_in_the_log(tmp_path: Path, phase: str) -> None:
    """The protocol knows no phase: whose controller has an attribute of that name may use it."""
    (tmp_path / "own.py").write_text(
        f"""
import numpy as np
from antennate.control.registry import make_controller

class Own:
    def __init__(self, params, robot, batch):
        self.made = make_controller("closed", params, robot, batch)

    def __getattr__(self, name):
        return getattr(self.made, name)

    @property
    def phase(self):
        return {phase}
"""
    )
    log = tmp_path / "a.mcap"
    antennate.simulate(f"{tmp_path / 'own.py'}:Own", scene="flat", time_limit=0.1, log=log)
    with LogReader(log) as read:
        phases = [tick.phase for tick in read]
    assert len(phases) > 5
    assert all(map(math.isnan, phases))


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan"), float("inf"), "1"])
def test_a_time_limit_is_a_finite_time_above_zero(limit: Any) -> None:
    with pytest.raises(AntennateError, match=r"time_limit: expected a finite number above 0 \[s\]"):
        antennate.simulate("open", scene="flat", time_limit=limit)


@pytest.mark.parametrize("name", ["log.txt", "log", "mcap"])
def test_a_log_with_another_ending_is_refused_before_anything_is_run(
    name: str, tmp_path: Path
) -> None:
    log = tmp_path / name
    with pytest.raises(antennate.BadInputError, match=r"log: expected a name with \.mcap, found "):
        antennate.simulate("open", scene="flat", time_limit=0.1, log=str(log))
    assert not log.exists()


def test_a_trial_that_was_killed_is_logged_anew(tmp_path: Path) -> None:
    """Half a log of it is in the folder of a run that goes on."""
    (tmp_path / "open-0.mcap").write_bytes(b"half")
    config = TunnelConfig(scene="flat", trials=1, controllers=("open",), time_limit=0.5)
    EXPERIMENT.run(config, logs=tmp_path)
    with LogReader(tmp_path / "open-0.mcap") as log:
        assert sum(1 for _ in log) == log.end == pytest.approx(50, abs=1)


def sync_write(address: int, size: int, values: list[int]) -> bytes:
    named = zip(ROBOT.ids, values, strict=True)
    data = {servo: value.to_bytes(size, "little", signed=True) for servo, value in named}
    return packets.sync_write(address, data)


def walked(
    folder: Path,
    *words: str,
    ticks: int = TICKS,
    code: int = 0,
    limits: Callable[[], None] | None = None,
) -> tuple[str, list[list[int]]]:
    """A twin in lock-step that is sent goals: what it said, and the goals [ticks]."""
    words = ("twin", "--pace", "lockstep", "--duration", f"{0.01 * ticks}", *words)
    ahead = [0] * 5 + [7 * (-1) ** side for _ in range(6) for side in range(2)] + [0] * 2
    plan = [[ROBOT.zeros[i] + step * ahead[i] for i in range(19)] for step in range(ticks)]
    with subprocess.Popen(
        [sys.executable, "-m", "antennate", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        preexec_fn=limits,
    ) as process:
        assert process.stdout is not None
        bus = os.open(json.loads(process.stdout.readline())["bus"], os.O_RDWR)
        tty.setraw(bus)
        os.write(bus, sync_write(64, 1, [1] * 19))
        for goals in plan:
            os.write(bus, sync_write(116, 4, goals))
        _, said = process.communicate(timeout=120)
        os.close(bus)
    assert process.returncode == code, said
    return said, plan


@pytest.mark.ci
def test_a_twin_logs_goals_readings_and_physics(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--scene", "flat", "--fault", "servo:3=silent@0.3s", "--log", "twin.mcap"]
    said, plan = walked(tmp_path, *words)
    assert "log: twin.mcap\n" in said
    log = tmp_path / "twin.mcap"
    with LogReader(log) as reader:
        groups = list(reader.groups())
        assert (reader.bad, reader.missing, reader.end) == (0, 0, TICKS)
        assert reader.header.arena["scene"] == "flat"
    ticks = [tick for _, tick in groups if tick is not None]
    sign = np.array(ROBOT.directions) * 2 * math.pi / TURN
    goals = (np.array(plan) - np.array(ROBOT.zeros)) * sign
    np.testing.assert_allclose([tick.angles for tick in ticks], goals, atol=1e-12)
    assert [tick.now for tick in ticks] == pytest.approx(0.01 * np.arange(1, TICKS + 1))
    assert {tick.maneuver for tick in ticks} == {-1}
    assert np.isnan([tick.level for tick in ticks]).all()
    legs = np.array([tick.positions[5:17] for tick in ticks])
    assert (np.abs(legs[-1]) > 0.2).all()
    assert not np.isnan([tick.counts for tick in ticks]).any()
    records = [record for found, _ in groups for record in found]
    events = [EVENTS.type.decode(r.data)["msg"] for r in records if r.topic is EVENTS]
    assert any("servo:3=silent" in text for text in events)
    assert sum(record.topic.name == "/coordinates" for record in records) == TICKS // 10
    stamped = [record for record in records if record.topic is JOINT_STATES]
    stamps = [(record.topic.type.decode(record.data), record.time) for record in stamped]
    assert [10**9 * one["sec"] + one["nanosec"] for one, _ in stamps] == [
        time for _, time in stamps
    ]
    assert main(["log", "info", str(log)]) == 0
    capsys.readouterr()
    assert main(["log", "replay", str(log)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_fault_before_any_torque_stands_at_its_own_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["--fault", "esp32=silent@0.4s", "--log", "twin.mcap"]
    assert main(["twin", "--duration", "0.6", *words]) == 0
    capsys.readouterr()
    assert main(["log", "info", "twin.mcap", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    times = [1e-9 * (each["time_ns"] - found["start_ns"]) for each in found["events"]]
    assert (found["ticks"], times) == (0, [pytest.approx(0.4, abs=0.05)])


def drawable() -> bool:
    """Whether films can be made here."""
    pytest.importorskip("av")
    try:
        engine_setup.backend()
    except AntennateError:
        return False
    return True


@pytest.mark.slow
def test_a_twin_and_its_log_are_filmed(tmp_path: Path) -> None:
    """A second of the film for a second of the walk; the log shows the same at 10 Hz."""
    ticks = 28
    if not drawable():
        pytest.skip("neither EGL nor OSMesa")
    words = ["--scene", "flat", "--video", "twin.mp4", "--log", "twin.mcap"]
    said, _ = walked(tmp_path, *words, ticks=ticks)
    assert "video: twin.mp4\n" in said
    assert (
        main(["log", "film", str(tmp_path / "twin.mcap"), "--out", str(tmp_path / "log.mp4")]) == 0
    )
    import av

    for name in ("twin.mp4", "log.mp4"):
        with av.open(str(tmp_path / name)) as container:
            pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        assert len(pictures) == pytest.approx(ticks * 0.01 * 25, abs=1)
        assert np.abs(pictures[-1].astype(int) - pictures[0]).max() > 100
        assert len(np.unique(pictures[-1][:400].reshape(-1, 3), axis=0)) > 100


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--log", "a.csv"], "--log: expected a name with .mcap, found a.csv"),
        (["--video", "a.mcap"], "--video: expected a name with .mp4, found a.mcap"),
        (["--log", "here.mcap"], "expected a log that does not exist yet, found here.mcap"),
        (["--log", "nowhere/a.mcap"], "expected a folder to write nowhere/a.mcap"),
        (["--video", "nowhere/a.mp4"], "--video: expected a folder for nowhere/a.mp4"),
        (["--servos", "1:xl330-m288", "--log", "a.mcap"], "--log: expected none beside --servos"),
    ],
)
def test_what_a_twin_cannot_keep_is_refused_in_one_line(
    words: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("here.mcap").write_bytes(b"")
    assert main(["twin", "--duration", "1", *words]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert said in err
    assert [path.name for path in Path().iterdir()] == ["here.mcap"]


@pytest.mark.parametrize("phase", [np.array([0.5, 0.25]), [0.5, 0.25], (1, 2), "none", None, 3.0])
def test_decisions_of_any_form_are_kept_as_they_are(phase: Any) -> None:
    """Numbers of other sizes, views with gaps, integers as levels, a phase of any kind."""
    spaced = np.arange(24.0).reshape(2, 12)
    made = SimpleNamespace(
        maneuver=np.array([1, 4], np.int8),
        level=np.array([[0, 1], [1, 0]]),
        contact=np.array([[0, 2], [1, 1]], np.int32),
        phase=phase,
    )
    frame = AntennaFrame(t=np.array([0.25, 0.5]), counts=np.array([[1.0, 2.0], [math.nan, 4.0]]))
    command = JointCommand(
        yaw=spaced[:, :10:2],
        leg=np.ones((2, 6, 2), np.float32),
        antenna=np.array([[7, 8], [9, 10]]),
    )
    decisions = Decisions(ROBOT, made, 2)
    ticks = [decisions.take(frame, command)] * 3
    made.level = np.array([[0.5, 0.25], [0.75, 0.125]])
    ticks.append(decisions.take(frame, command))
    spaced[:] = -1.0  # what is used anew by its owner
    expected = {
        "t": [0.5] * 4,
        "maneuver": [4] * 4,
        "phase": [phase[1] if np.shape(phase) == (2,) else math.nan] * 4,
        "counts": [[math.nan, 4.0]] * 4,
        "level": [[1.0, 0.0]] * 3 + [[0.75, 0.125]],
        "contact": [[1, 1]] * 4,
        "angles": [[12, 14, 16, 18, 20, *[1.0] * 12, 9.0, 10.0]] * 4,
    }
    found = decisions.columns(ticks, 1)
    assert found.keys() == expected.keys()
    for name, column in expected.items():
        np.testing.assert_array_equal(found[name], column)


def pushes(world: World) -> list[float]:
    """Normal forces [N] between the robot and what is not the floor, as the engine tells them."""
    model, data, force = world.model, world.data, np.zeros(6)
    found = []
    for number in range(data.ncon):
        geoms = data.contact.geom[number]
        bodies = [model.body(model.geom_bodyid[geom]).name for geom in geoms]
        if sum(name.startswith("robot/") for name in bodies) != 1:
            continue
        assert "floor" not in [model.geom(geom).name for geom in geoms]
        mujoco.mj_contactForce(model, data, number, force)
        found.append(float(force[0]))
    return found


def test_contacts_of_a_look_are_its_own_where_the_first_is_with_an_obstacle(tmp_path: Path) -> None:
    """Robot and cylinders hang above the floor, whose contacts else come before all others."""
    config = TunnelConfig(trials=1)
    scene = make_scene(config.scene, config.tunnel)
    world = draw_trial(config, scene, 0, config.control.gait, config.control.period).world
    begin, first = world.data.qpos.copy(), world.root
    begin[[*range(2, first, 4), first + 2]] += 0.2
    made = SimpleNamespace(
        maneuver=np.array([1]),
        level=np.zeros((1, 2)),
        contact=np.zeros((1, 2), np.int64),
        phase=np.zeros(1),
    )
    frame = AntennaFrame(t=np.zeros(1), counts=np.zeros((1, 2)))
    command = JointCommand(np.zeros((1, 5)), np.zeros((1, 6, 2)), np.zeros((1, 2)))
    decisions, expected = Decisions(ROBOT, made), []
    decided = decisions.take(frame, command)
    with SimulatedLog(tmp_path / "a.mcap", HEADER, world, decisions) as log:
        for ahead in (0.36, 0.0, 0.4, 0.54, 0.0, 0.0, 0.6, 0.7):
            world.data.qpos[:] = begin
            world.data.qpos[first] += ahead
            mujoco.mj_forward(world.model, world.data)
            expected.append(pushes(world))
            for _ in range(10):  # one look in ten ticks
                log.take(decided)
    assert [bool(found) for found in expected] == [
        True,
        False,
        True,
        True,
        False,
        False,
        True,
        True,
    ]
    with LogReader(tmp_path / "a.mcap") as reader:
        looks = [
            {record.topic: record.topic.decode(record.data) for record in records}
            for records, _ in reader.groups()
        ]
    told = [look.get(CONTACT_FORCES, {"normal": []}) for look in looks if COORDINATES in look]
    for found, wanted in zip(told, expected, strict=True):
        np.testing.assert_allclose(found["normal"], wanted, rtol=1e-6)


def made(count: int) -> list[Tick]:
    """Ticks that follow from their number, 0.01 s apart."""
    return [replace(tick(number), now=0.01 * number) for number in range(1, count + 1)]


def as_made(log: LogWriter, ticks: Sequence[Tick]) -> None:
    """Write such ticks as they are."""
    for each in ticks:
        log.write(each)


def columns(ticks: Sequence[Tick], names: Sequence[str]) -> dict[str, np.ndarray[Any, Any]]:
    """Some fields of ticks, and those that each tick must have."""
    needed = ["t", "now", "counts", "reading", "level", "contact", "maneuver", "phase", "angles"]
    return {name: np.array([getattr(each, name) for each in ticks]) for name in [*needed, *names]}


@pytest.mark.parametrize("names", [(), ("positions",), ("positions", "velocities", "efforts")])
def test_ticks_written_at_once_are_those_written_one_by_one(
    names: tuple[str, ...], tmp_path: Path
) -> None:
    """Bit by bit, of a robot without a supervisor; the time of messages never goes back."""
    chance, joints = np.random.default_rng(5), (len(names), 40, len(ROBOT.joint_names))
    measured = [
        dict(zip(names, map(tuple, row), strict=True))
        for row in chance.normal(size=joints).swapaxes(0, 1).tolist()
    ]
    quiet = {"state": "", "causes": (), "age": math.nan, "missed": 0, "frames": 0, "lost": 0}
    quiet |= {"misses": 0, "stale": 0, "sent": 0}
    kept = [replace(each, **quiet, **more) for each, more in zip(made(40), measured, strict=True)]
    kept[20] = replace(kept[20], now=0.05)
    with LogWriter(tmp_path / "one by one.mcap", HEADER) as log:
        as_made(log, kept)
    with LogWriter(tmp_path / "at once.mcap", HEADER) as log:
        log.write_many(columns(kept[:30], names), {})
        log.write_many(columns(kept[30:], names), {})
    found = [messages(tmp_path / f"{name}.mcap") for name in ("one by one", "at once")]
    assert found[0] == found[1]
    with LogReader(tmp_path / "at once.mcap") as reader:
        assert [each.pack() for each in reader] == [each.pack() for each in kept]


COUNTED = np.array([0, 5, 7])
WELL = np.array(["", "", ""])
CHANGED = {
    "counted later": {"missed": COUNTED},
    "states": {"state": np.array(["OK", "", "HOLD"]), "note": np.array(["", "look", ""])},
    "causes": {"state": WELL, "causes": np.array([["a: 1"], ["a: 2"], ["b"]])},
    "an IMU that the robot has not": {name: np.ones((3, 3)) for name in MOTION},
    "no measured joints": {"positions": np.zeros((3, 0))},
    "too large": {"contact": np.array([[0, 1], [0, 2**63], [0, 0]], np.uint64)},
    "negative": {"missed": -COUNTED},
    "not whole": {"maneuver": np.array([0.0, 1.0, 2.0])},
    "much too large": {"maneuver": np.array([0, 1, 2**70], object)},
    "of text": {"phase": np.array(["1", "2", "3"])},
}
"""Columns of three ticks in place of those that all ticks have, or beside them."""


@pytest.mark.parametrize("before", ["", "OK"])
@pytest.mark.parametrize("changed", CHANGED.values(), ids=CHANGED)
def test_ticks_written_at_once_have_the_topics_and_refusals_of_each(
    changed: dict[str, np.ndarray[Any, Any]], before: str, tmp_path: Path
) -> None:
    """A tick before them leaves a state, after which a tick without one is an event."""
    quiet = {"phase": 0.5, "maneuver": 1, "contact": (0, 1), "state": "", "causes": ()}
    given = columns([replace(each, **quiet) for each in made(3)], ()) | changed
    first = replace(made(1)[0], state=before)
    beside = {COORDINATES: COORDINATES.type.encode(0, (1.0, 2.0))}
    refused = {}
    with LogWriter(tmp_path / "one by one.mcap", HEADER) as log:
        log.write(first)
        try:
            for place in range(3):
                row = {name: column.tolist()[place] for name, column in given.items()}
                log.write(Tick(number=2 + place, **row))
                if place == 1:
                    log.add(COORDINATES, 3, 0, beside[COORDINATES])
        except LogError as error:
            refused["one by one"] = str(error)
    with LogWriter(tmp_path / "at once.mcap", HEADER) as log:
        log.write(first)
        try:
            log.write_many(given, {1: beside})
        except LogError as error:
            refused["at once"] = str(error)
    assert refused.get("at once") == refused.get("one by one")
    assert messages(tmp_path / "at once.mcap") == messages(tmp_path / "one by one.mcap")


def test_what_went_wrong_later_is_logged_and_no_tick_is_none(tmp_path: Path) -> None:
    given = columns(made(3), ()) | {"missed": COUNTED}
    with LogWriter(tmp_path / "log.mcap", HEADER) as log:
        log.write_many({name: column[:0] for name, column in given.items()}, {})
        log.write_many({}, {})
        assert log.written == 0
        log.write_many(given, {})
    with LogReader(tmp_path / "log.mcap") as reader:
        assert [each.missed for each in reader] == [0, 5, 7]


def messages(path: Path) -> list[tuple[str, Message]]:
    """Messages of a file as the package `mcap` reads them, with their topics, in their order."""
    with path.open("rb") as file:
        found = make_reader(file).iter_messages(log_time_order=False)
        return [(channel.topic, message) for _, channel, message in found]


def test_a_log_behind_a_queue_is_the_same(tmp_path: Path) -> None:
    kept = made(700)
    with TickLog(tmp_path / "here.mcap", HEADER, as_made) as log:
        for each in kept:
            log.add(each)
    with LogQueue(TickLog(tmp_path / "there.mcap", HEADER, as_made)) as queue:
        for each in kept:
            queue.add(each)
    assert queue.close() == ""
    with LogReader(tmp_path / "here.mcap") as one, LogReader(tmp_path / "there.mcap") as other:
        assert [tick.pack() for tick in one] == [tick.pack() for tick in other]
        assert one.end == other.end == 700


def test_a_tick_never_waits_for_a_slow_disk_and_those_without_room_are_counted(
    tmp_path: Path,
) -> None:
    """The queue holds 30 s of ticks; what comes in order before and after stays in order."""
    begun, go_on = threading.Event(), threading.Event()

    def slowly(log: LogWriter, ticks: Sequence[Tick]) -> None:
        begun.set()
        go_on.wait(60)
        as_made(log, ticks)

    kept = made(3500)
    queue = LogQueue(TickLog(tmp_path / "log.mcap", HEADER, slowly))
    queue.add(kept[0])
    assert begun.wait(60)
    begin = time.monotonic()
    for each in kept[1:]:
        queue.add(each)
    assert time.monotonic() - begin < 1.0
    go_on.set()
    assert queue.close() == "499 ticks are missing in it"
    assert queue.dropped == 499
    with LogReader(tmp_path / "log.mcap") as log:
        assert [tick.now for tick in log] == [each.now for each in kept[:3001]]
        assert log.end == 3001


def test_a_log_that_fails_in_any_way_is_told(tmp_path: Path) -> None:
    def broken(log: LogWriter, ticks: Sequence[Tick]) -> None:
        raise ValueError("ticks of 3")

    told = list[str]()
    queue = LogQueue(TickLog(tmp_path / "log.mcap", HEADER, broken), told.append)
    queue.add(made(1)[0])
    assert queue.close() == queue.failure == "ValueError: ticks of 3"
    assert told == [queue.failure]


SLOW = f"""
import os, signal, sys, threading, time
sys.path[:0] = {sys.path!r}
from test_simulated_logs import HEADER, Path, TickLog, as_made, made

begun = threading.Event()
def slowly(out, ticks):
    begun.set()
    time.sleep(0.5)
    as_made(out, ticks)

log = TickLog(Path(sys.argv[1]), HEADER, slowly)
for tick in made(300):  # the first 256 are written at once
    log.add(tick)
begun.wait()
"""
"""A log whose thread writes for some time while 44 more ticks wait."""


@pytest.mark.ci
def test_a_person_who_is_impatient_while_it_is_closed_costs_no_tick(tmp_path: Path) -> None:
    code = (
        "main = threading.main_thread().ident\n"
        "threading.Timer(0.1, signal.pthread_kill, (main, signal.SIGINT)).start()\n"
        "log.close()"
    )
    words = [sys.executable, "-c", SLOW + code, str(tmp_path / "log.mcap")]
    done = subprocess.run(words, timeout=120, check=False, capture_output=True)
    assert done.returncode == -2, done.stderr
    with LogReader(tmp_path / "log.mcap") as log:
        assert sum(1 for _ in log) == log.end == 300


FORKED = f"""
import os, sys
sys.path[:0] = {sys.path!r}
from test_simulated_logs import HEADER, Path, TickLog, as_made, made

folder = Path(sys.argv[1])
for name in ("parent.mcap", "child.mcap"):
    with TickLog(folder / name, HEADER, as_made) as log:
        for tick in made(300):
            log.add(tick)
    child = os.fork() if name == "parent.mcap" else 0
    if child:
        sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
"""A child that writes a log of its own after that of its parent."""


@pytest.mark.ci
def test_a_forked_child_writes_a_log_as_its_parent_did(tmp_path: Path) -> None:
    words = [sys.executable, "-W", "ignore", "-c", FORKED, str(tmp_path)]
    with subprocess.Popen(words, start_new_session=True) as forked:
        try:
            assert forked.wait(60) == 0
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(forked.pid, signal.SIGKILL)
    for name in ("parent", "child"):
        with LogReader(tmp_path / f"{name}.mcap") as log:
            assert sum(1 for _ in log) == log.end == 300


@pytest.mark.ci
def test_a_log_whose_simulation_is_killed_is_not_closed(tmp_path: Path) -> None:
    """All but the last half of a second is read; a second log at the same place is refused."""
    code = f"""
import os, signal, sys, time
sys.path[:0] = {sys.path!r}
from test_simulated_logs import HEADER, LogQueue, Path, TickLog, as_made, made
log = LogQueue(TickLog(Path({str(tmp_path / "log.mcap")!r}), HEADER, as_made))
for tick in made(300):
    log.add(tick)
time.sleep(0.5)
os.kill(os.getpid(), signal.SIGKILL)
"""
    done = subprocess.run([sys.executable, "-c", code], timeout=120, check=False)
    assert done.returncode == -9
    with LogReader(tmp_path / "log.mcap") as log:
        assert [tick.now for tick in log] == pytest.approx(0.01 * np.arange(1, 301))
        assert log.end is None
    with pytest.raises(LogError, match="expected a log that does not exist yet"):
        TickLog(tmp_path / "log.mcap", HEADER, as_made)


def test_a_scene_of_many_bodies_leaves_chunks_that_can_be_read(tmp_path: Path) -> None:
    """256 ticks with 60 kB beside each are 15 MB; a reader takes chunks of 8 MB at most."""
    places = np.random.default_rng(0).normal(size=7500)
    message = COORDINATES.type.encode(0, tuple(places))

    def beside(log: LogWriter, ticks: Sequence[Tick]) -> None:
        places = {place: {COORDINATES: message} for place in range(len(ticks))}
        log.write_many(columns(ticks, ()), places)

    path = tmp_path / "log.mcap"
    with TickLog(path, HEADER, beside) as log:
        for each in made(256):
            log.add(each)
    with LogReader(path) as reader:
        assert [each.now for each in reader] == [each.now for each in made(256)]
        assert reader.damage == []
