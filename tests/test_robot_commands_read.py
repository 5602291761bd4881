"""No command of the robot accepts a parameter that it does not read.

Each command's own code runs before the twin, all but `twin` in invented time, with a configuration
that records which of its parameters are read.
"""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from doctor_rig import Patient
from lockstep import BoardPort, LockstepClock
from log_ticks import HEADER
from recorded import act, leaves, meet_ground, press, recorded, tried
from setup_rig import Box, Script
from stated import stated
from worlds import recorded as logged
from worlds import simulated

from antennate.cli import doctor, drive, main, record, replay, setup, twin
from antennate.control.registry import BUILT_IN
from antennate.hardware.config import (
    DoctorConfig,
    DriveConfig,
    JogConfig,
    RecordConfig,
    RobotFile,
    SetupConfig,
    TeleopConfig,
    ZeroConfig,
)
from antennate.hardware.driving.connect import prepare
from antennate.hardware.driving.drive import drive as walk
from antennate.hardware.driving.goals import GoalController
from antennate.hardware.ports.finder import finder
from antennate.hardware.safety.session import Session
from antennate.hardware.setup.servos import ServoSetup, joints_of
from antennate.messages import command_words
from antennate.params.base import Params, read_file
from antennate.params.hardware import NetworkParams
from antennate.robots.spec import RobotSpec
from antennate.studies.run_directory import RunDirectory
from antennate.telemetry.feed import Feed
from antennate.telemetry.replay import ReplayConfig
from antennate.twin.config import TwinConfig, watched
from antennate.twin.faults import Faults, read
from dynamixel_bus.simulated_wire import SimulatedWire

Patch = pytest.MonkeyPatch
PORTS = {"bus": "the bus", "esp32": "the board"}
FAULTS = {  # by the number of its readings; with 5 the ports are swapped
    3: ("servo:7=return_delay_time:250",),
    4: ("esp32=silent", "servo:1=silent"),
    5: (),
}
REPLACED = {"controller"}  # `teleop` walks by keys in its place
SHORT = {"dry_run": 0.1, "duration": 0.5, "stand": 0.1}
BRIEF = {"patience": 1.0}
"""Torque is refused before a silent bus; it is asked for so long."""
PITCH = {"kind": "actuated", "servo": "xl430_w250"}
INERTIAL = {"imu": {"kind": "head"}}
LIFTING = {
    "legs": {"kind": "lifting"},
    "pitch": PITCH,
    "elevation": {"kind": "pair"},
    **INERTIAL,
}
GROUND = ("stairs", "gap", "ramp", "rubble")
"""Scenes that read all sizes of ground between them."""
PLANAR = {name: group for name, group in LIFTING.items() if name != "elevation"}
HEXAPOD = RobotSpec.named("hexapod").model_dump()
"""Without antennae."""


def reach(network: NetworkParams) -> None:
    """Open a board's port on the network."""
    finder("udp://127.0.0.1:9", 0, "", b"", network)().close()


def fresh(robot: RobotSpec) -> RobotSpec:
    """The same robot, for what stands before the command; nobody notes what is read of it."""
    return RobotSpec.model_validate(robot.model_dump())


def told(
    patch: Patch,
    command: Callable[..., int],
    options: Any,
    config: Params,
    path: Path | None = None,
) -> int:
    """Run a command with a configuration and options, in place of words."""
    module = sys.modules[command.__module__]
    if path is None:
        patch.setattr(module, "parse_robot", lambda *_, **__: (config, options))
    else:
        patch.setattr(module, "parse_writer", lambda *_, **__: (config, options, path))
    return command([])


def connected(**of_twin: Any) -> Callable[..., Any]:
    """In place of `connect`: a twin in lock-step, with a fault."""
    fault = of_twin.pop("fault", None)

    @contextlib.contextmanager
    def connect(config: DriveConfig, *_: Any) -> Iterator[Session]:
        reach(config.network)
        robot = watched(TwinConfig(robot=fresh(config.robot), **of_twin))[0]
        clock = LockstepClock(robot)
        session = prepare(config, BoardPort(robot, clock), clock, clock)
        if fault:
            Faults([read(fault)], config.robot.ids).apply(robot, robot.t)
        yield session

    return connect


def driven(
    patch: Patch, config: DriveConfig, out: Path, teleop: bool = False, **of_twin: Any
) -> None:
    patch.setattr(drive, "Header", lambda **_: HEADER)
    patch.setattr(RunDirectory, "describe", lambda *_: None)
    patch.setattr(drive, "connect", connected(**of_twin))
    patch.setattr(Feed, "watched", property(lambda feed: True))  # its time is invented
    patch.setattr(drive, "pressed_keys", lambda _: contextlib.nullcontext(lambda: True))
    if teleop:
        told(patch, drive.teleop, drive.TeleopOptions(arm=True, out=out, **PORTS), config)
        return
    told(patch, drive.command, drive.DriveOptions(arm=True, out=out, **PORTS), config)
    if config.control.rate < 100.0:
        climbing = ("climb", "lifted", "rhythm")
        for name in (name for name in BUILT_IN if name not in climbing):
            act(name, config.control, config.robot)
        meet_ground(config.control, RobotSpec.named("scuttle3d"))
        control, robot = config.control, config.robot
        press(GoalController(control, robot, config.goals, lambda: None, lambda: 0.0), control)


def run_drive(patch: Patch, config: DriveConfig, tmp_path: Path) -> None:
    if config.touch_check:
        weak, touch = {"voltage": 10.5}, ("left@0.6s", "right@2.4s")
        fault = "bus=discharge:0.01"
        driven(patch, config, tmp_path / "1", battery=weak, touch=touch, fault=fault)
    else:
        driven(patch, config, tmp_path / "2", fault="bus=silent")


def run_teleop(patch: Patch, config: TeleopConfig, tmp_path: Path) -> None:
    patch.setattr(drive, "typed_keys", lambda: contextlib.nullcontext(lambda _: ["w", "o"]))
    touch = ("left@0.6s", "right@2.4s")
    fault = "bus=discharge:0.01" if config.touch_check else "bus=silent"
    weak = {"voltage": 10.5}
    driven(patch, config, tmp_path, teleop=True, battery=weak, touch=touch, fault=fault)


def run_doctor(patch: Patch, config: DoctorConfig, tmp_path: Path) -> None:
    robot = fresh(config.robot) if config.robot.has_imu and not config.robot.pitch_count else None
    patient = Patient(*FAULTS[config.doctor.reads], robot=robot)

    def opener(address: str, flag: str, key: object = None, network: Any = None) -> Any:
        if network is not None:
            reach(network)
        return patient.bus if (flag == "--bus") == (config.doctor.reads < 5) else patient.esp32

    patch.setattr(doctor, "opener_of", opener)
    patch.setattr(doctor, "HostClock", lambda: patient.clock)
    told(patch, doctor.command, doctor.DoctorOptions(fix=True, yes=True, **PORTS), config)


def run_record(patch: Patch, config: RecordConfig, tmp_path: Path) -> None:
    patient = Patient()

    def opener(address: str, flag: str, key: object, network: NetworkParams) -> Any:
        reach(network)
        return patient.esp32

    enters = tmp_path / "enters"
    enters.write_text("\n" * 20)
    patch.setattr(record, "opener_of", opener)
    patch.setattr(record, "HostClock", lambda: patient.clock)
    with enters.open() as stdin, pytest.MonkeyPatch.context() as inner:
        inner.setattr("sys.stdin", stdin)
        options = record.RecordOptions(esp32="the board", out=tmp_path / "recording.csv")
        told(patch, record.command, options, config)


class Waiting:
    """The time of a wire, for who sleeps until a time."""

    def __init__(self, wire: SimulatedWire) -> None:
        self._wire, self.now = wire, wire.now

    def sleep_until(self, t: float) -> None:
        self._wire.sleep(t - self._wire.now())


def boxed(patch: Patch, module: Any, robot: RobotSpec, ready: bool) -> Box:
    """A box of servos on the bus of a command."""
    robot = fresh(robot)
    box = Box(robot)
    for joint in joints_of(robot) if ready else ():
        box.plug(joint.name)
        ServoSetup(box.opener, robot, 0.02, box.wire.now).set_up(joint, ())
    box.plug_all()
    patch.setattr(module, "opener_of", lambda *_: box.opener)
    patch.setattr(module, "HostClock", lambda: Waiting(box.wire))
    return box


def run_setup(patch: Patch, config: SetupConfig, tmp_path: Path) -> None:
    box = boxed(patch, setup, config.robot, ready=False)
    steps = [(rf"servo of {n} ", lambda n=n: box.plug(n), "") for n in box.servos]
    script = Script([*steps, ("whole|connect all", box.plug_all, "")])
    patch.setattr(script, "close", lambda: None, raising=False)
    patch.setattr(setup, "TerminalPerson", lambda: script)
    patch.setattr(setup, "find_port", lambda *_: "the bus")
    told(patch, setup.command, setup.SetupOptions(), config, tmp_path / "robot.toml")


def run_zero(patch: Patch, config: ZeroConfig, tmp_path: Path) -> None:
    box = boxed(patch, setup, config.robot, ready=True)
    turned = [
        (rf": {n}: ", lambda s=s: s.place(s.position + 300), None) for n, s in box.servos.items()
    ]
    script = Script([("straight", None, ""), *turned])
    patch.setattr(script, "close", lambda: None, raising=False)
    patch.setattr(setup, "TerminalPerson", lambda: script)
    options = setup.ZeroOptions(bus="the bus")
    told(patch, setup.zero, options, config, tmp_path / "robot.toml")


def run_jog(patch: Patch, config: JogConfig, tmp_path: Path) -> None:
    boxed(patch, setup, config.robot, ready=True)
    keys = iter("++-q")
    typed = contextlib.nullcontext(lambda _: [next(keys)])
    patch.setattr(setup, "typed_keys", lambda: typed)
    told(patch, setup.jog, setup.JogOptions(bus="the bus"), config)


def run_replay(patch: Patch, config: ReplayConfig, tmp_path: Path) -> None:
    log = logged(simulated(tmp_path, "paper", 0), tmp_path / "log", 20)
    patch.setattr(replay, "parse", lambda *_: (config, replay.ReplayOptions(log=str(log))))
    replay.command([])


def run_twin(patch: Patch, config: TwinConfig, tmp_path: Path) -> None:
    patch.setattr(twin, "parse_robot", lambda *_, **__: (config, twin.Places()))
    twin.command([])
    if config.factory or config.scene != "tunnel":
        return
    robot = watched(config)[0]
    clock = LockstepClock(robot)
    known = stated(fresh(config.robot))
    orders = DriveConfig(dry_run=0.1, duration=0.3, touch_check=False, robot=known, stand=0.0)
    walk(prepare(orders, BoardPort(robot, clock), clock, clock), orders, arm=True)


RUNS: dict[str, tuple[type[Params], Callable[..., None], list[dict[str, Any]]]] = {
    "drive": (
        DriveConfig,
        run_drive,
        [
            {
                **SHORT,
                "hold_to_run": True,
                "control": {"rate": 25.0},
                "drift": {"band": 0.02, "speed": 1.0},
            },
            {
                **SHORT,
                "touch_check": False,
                "touch": BRIEF,
                "bus_return": 0.1,
                "fault_time": 0.1,
                "robot": LIFTING,
            },
            {**SHORT, "robot": PLANAR, "controller": "test_legs_and_pitch:Lift"},
        ],
    ),
    "teleop": (
        TeleopConfig,
        run_teleop,
        [
            {
                **SHORT,
                "duration": 2.0,
                "control": {"rate": 25.0},
                "controller": "open",
                "drift": {"band": 0.02, "speed": 1.0},
            },
            {
                **SHORT,
                "controller": "open",
                "touch_check": False,
                "touch": BRIEF,
                "robot": LIFTING,
            },
        ],
    ),
    "doctor": (
        DoctorConfig,
        run_doctor,
        [
            {"doctor": {"reads": n}, "robot": LIFTING if n == 4 else INERTIAL if n == 3 else {}}
            for n in FAULTS
        ],
    ),
    "record": (
        RecordConfig,
        run_record,
        [
            {"marks": [0.0, 1.0], "hold": 0.05, "passes": 1},
            {"speed": 0.5, "passes": 1},
            {"duration": 0.1},
        ],
    ),
    "setup": (
        SetupConfig,
        run_setup,
        [
            {"setup": {"scan": 0.02}},
            {"setup": {"scan": 0.02}, "robot": LIFTING},
            {"setup": {"scan": 0.02}, "robot": HEXAPOD},
        ],
    ),
    "zero": (ZeroConfig, run_zero, [{}, {"robot": LIFTING}, {"robot": HEXAPOD}]),
    "jog": (JogConfig, run_jog, [{}, {"robot": LIFTING}, {"robot": HEXAPOD}]),
    "replay": (ReplayConfig, run_replay, [{}]),
    "twin": (
        TwinConfig,
        run_twin,
        [
            {"duration": 0.1, "fault": ["bus=discharge:0.01"]},
            {
                "duration": 0.05,
                "scene": "flat",
                "robot": {
                    **LIFTING,
                    "yaw": {"servo": "xl330_m288"},
                    "antenna": {"sensor": {"kind": "fsr"}},
                },
            },
            {"duration": 0.05, "factory": True},
            {
                "duration": 0.05,
                "seed": 2,
                "trial": 1,
                "scene": "corridors",
                "corridors": {"pieces": [2, 2], "room_share": 0.5, "arm_share": 0.5},
            },
            {
                "duration": 0.05,
                "seed": 2,
                "trial": 2,
                "scene": "corridors",
                "corridors": {"pieces": [2, 2], "room_share": 0.5, "arm_share": 0.5},
            },
            *({"duration": 0.05, "scene": scene} for scene in GROUND),
        ],
    ),
}


@pytest.mark.parametrize(
    "command",
    [pytest.param(c, marks=pytest.mark.ci if c in ("drive", "teleop") else ()) for c in RUNS],
)
def test_every_parameter_of_a_command_of_the_robot_is_read_or_refused(
    command: str, tmp_path: Path, monkeypatch: Patch
) -> None:
    monkeypatch.chdir(tmp_path)
    model, run, settings = RUNS[command]
    found: set[str] = set()
    for at, values in enumerate(settings):
        if command in ("drive", "teleop", "doctor"):  # else no torque, and no row of a direction
            robot = RobotSpec.model_validate(values.get("robot", {}))
            values = values | {"robot": stated(robot).model_dump()}
        config = model.model_validate(values).model_copy(deep=True)
        (folder := tmp_path / str(at)).mkdir()
        with recorded(config) as seen, contextlib.redirect_stdout(io.StringIO()):
            run(monkeypatch, config, folder)
        found |= seen
    every = set(leaves(model))
    assert tried(every) - found == tried(set(model.unread) - REPLACED)
    assert set(model.unread) <= every


def test_the_file_of_a_robot_may_hold_what_a_command_does_not_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "robot.toml"
    file.write_text('controller = "paper"\n[robot]\nmass = 3.0\n[control.gait]\nfrequency = 0.4\n')
    for command in ("doctor", "drive", "teleop", "jog", "zero", "setup", "record"):
        assert main([*command_words(command).split(), "--config", str(file), "--no-such-flag"]) == 2
        assert "--no-such-flag" in capsys.readouterr().err
    known = read_file(file, RobotFile)
    assert (
        known.part(DoctorConfig).control.gait.frequency
        == known.part(TeleopConfig).control.gait.frequency
    )
    assert known.part(DriveConfig).robot.mass == known.part(JogConfig).robot.mass == 3.0
