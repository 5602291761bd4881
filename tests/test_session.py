"""A session before the twin, in invented time: nothing moves unless all is well."""

from __future__ import annotations

import math
import signal
from collections.abc import Callable

import numpy as np
import pytest
from pty_server import PtyServer
from twin_rig import Rig, rig

from antennate.control.registry import make_controller
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import require_quick, require_servos
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.report import Report
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.session import Session
from antennate.host import STOPS
from antennate.params.control import ControlParams
from antennate.params.safety import TouchCheckParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.replay import replay
from antennate.telemetry.ticks import Tick
from antennate.twin.config import TwinConfig
from antennate.twin.faults import Faults, read
from antennate.types import AntennaFrame, JointCommand, State
from dynamixel_bus.packets import Instruction, StatusError
from dynamixel_bus.parser import Parser
from dynamixel_bus.port import PortError
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import Fault, Trouble

DRY = 0.3
"""Dry run [s]; long enough for readings to be believed, and torque comes on right after it."""
EVENT = 1.0
"""When most faults happen [s]: the legs have turned for half a second."""
CONFIG = DriveConfig(dry_run=DRY, duration=1.2)
"""Half a second after the event."""
SLOW = ControlParams.model_validate({"gait": {"frequency": 0.4}})
"""Legs leave 2.7 of 5.26 rad/s to catch up with their gait after the start, not 1.5."""


class Log:
    """What was seen after every tick: time, state, causes, maneuver and goals."""

    def __init__(self, rig: Rig, act: Callable[[Rig, float], None] | None = None) -> None:
        self.rig, self._act, self.report = rig, act, Report()
        self.t: list[float] = []
        self.state: list[State] = []
        self.causes: list[set[Cause]] = []
        self.texts: list[str] = []
        self.goals: list[list[int]] = []

    def __call__(self, session: Session, t: float) -> None:
        out = session.outputs
        assert out is not None
        self.t.append(t)
        self.state.append(out.state)
        self.causes.append({active.cause for active in out.causes})
        self.texts.append("; ".join(active.text for active in out.causes))
        self.goals.append([servo.get("goal_position") for servo in self.rig.robot.servos])
        if self._act is not None:
            self._act(self.rig, t)

    def first(self, cause: Cause) -> float:
        times = [t for t, causes in zip(self.t, self.causes, strict=True) if cause in causes]
        assert times, f"no {cause.name} until {self.t[-1]:.2f} s, ended by {self.report.ended}"
        return times[0]


def walked(
    act: Callable[[Rig, float], None] | None = None,
    config: DriveConfig = CONFIG,
    params: ControlParams | None = None,
) -> Log:
    made = rig(TwinConfig())
    if params is not None:
        made.session.control.controller = make_controller("closed", params)
    log = Log(made, act)
    log.report = drive(made.session, config, arm=True, on_tick=log)
    return log


def at(when: float, demand: str) -> Callable[[Rig, float], None]:
    """Let a fault happen."""
    faults: list[Faults] = []

    def act(rig: Rig, t: float) -> None:
        if not faults:
            faults.append(Faults([read(f"{demand}@{when}s")], tuple(RobotSpec().ids)))
        faults[0].apply(rig.robot, t)

    return act


def written(made: Rig) -> list[dict[str, int]]:
    """All that can be written of each servo."""
    return [
        {r.name: servo.get(r.name) for r in servo.model.registers.values() if r.writable}
        for servo in made.robot.servos
    ]


def test_a_dry_run_writes_nothing_to_any_servo() -> None:
    """Servos that somebody else left with torque keep it."""
    made = rig(TwinConfig())
    for servo in made.robot.servos:
        servo.set("torque_enable", 1)
    before = written(made)
    heard: list[int] = []
    receive = made.robot.bus.receive

    def listen(t: float, data: bytes) -> None:
        heard.extend(packet.instruction for packet in Parser().feed(data))
        receive(t, data)

    made.robot.bus.receive = listen
    report = drive(made.session, DriveConfig(dry_run=0.5), arm=False)
    assert report.timing is not None
    assert report.timing.ticks == pytest.approx(50, abs=1)
    reads = {Instruction.READ, Instruction.SYNC_READ, Instruction.FAST_SYNC_READ}
    assert set(heard) <= reads
    assert len(heard) > 50
    assert written(made) == before
    assert report.on is None


@pytest.fixture(scope="module")
def walk() -> Log:
    """A walk without any fault."""
    return walked(config=DriveConfig(dry_run=DRY, duration=2.2))


def test_it_arms_walks_and_ends_without_torque(walk: Log) -> None:
    assert State.OK in walk.state
    assert walk.rig.session.tally.sent > 180
    assert not any(servo.torque for servo in walk.rig.robot.servos)
    legs = np.ptp([goals[5:17] for goals in walk.goals], axis=0)
    assert (legs > 4096).all()  # more than a turn in 2.2 s at 0.6 turns a second


def test_B10_torque_comes_on_with_goals_where_servos_stand_and_they_move_slowly() -> None:
    log = walked(config=DriveConfig(dry_run=DRY, duration=0.6))
    on = next(i for i, state in enumerate(log.state) if state is not State.OFF)
    standing = np.rint([servo.position for servo in rig(TwinConfig()).robot.servos])
    assert abs(np.array(log.goals[on]) - standing).max() <= 5
    steps = abs(np.diff(log.goals[on : on + 50], axis=0))
    rest, legs = (math.ceil(most * 0.01 / (2 * math.pi / 4096)) for most in (4.5, 5.26))
    assert (steps.max(axis=0) <= [rest] * 5 + [legs] * 12 + [rest] * 2).all()


@pytest.mark.parametrize(("silence", "armed"), [(0.6, True), (2.5, False)])
def test_B6_a_bus_that_is_silent_for_a_while_before_torque_delays_it(
    silence: float, armed: bool
) -> None:
    """As of a computer that stands still; one that stays silent is given up before torque."""
    made = rig(TwinConfig())
    receive, begin, torque = made.robot.bus.receive, list[float](), list[bool]()

    def listen(t: float, data: bytes) -> None:
        if t > DRY and not begin:
            begin.append(t)
        made.robot.bus.loss = float(bool(begin) and t < begin[0] + silence)
        receive(t, data)
        torque.append(any(servo.torque for servo in made.robot.servos))

    made.robot.bus.receive = listen
    report = drive(made.session, DriveConfig(dry_run=DRY, duration=3.5), arm=True)
    assert any(torque) == armed
    assert (report.worst is State.FAULT) == (not armed), report.why
    assert not any(servo.torque for servo in made.robot.servos)


def test_L8_L9_a_silent_board_makes_it_hold_within_100_ms_and_its_return_walk() -> None:
    def act(rig: Rig, t: float) -> None:
        rig.robot.board_silent = EVENT <= t < EVENT + 0.3

    log = walked(act, DriveConfig(dry_run=DRY, duration=2.2))
    t = np.array(log.t)
    state = np.array(log.state)
    held = t[(t > EVENT) & (state >= State.HOLD)]
    assert held[0] - EVENT <= 0.1
    still = [g for g, when in zip(log.goals, log.t, strict=True) if held[0] <= when < EVENT + 0.3]
    assert len({tuple(g) for g in still}) == 1
    again = state[t > EVENT + 1.3]
    assert len(again) > 10
    assert (again <= State.DEGRADED).all()


@pytest.mark.parametrize("when", [0.25, 0.52, 1.0])
def test_E1_every_tick_can_be_logged_whenever_the_board_resets(when: float) -> None:
    """In the dry run, while arming, on the way."""
    act = at(when, "esp32=reset")

    def keep(session: Session, t: float) -> None:
        act(made, t)
        tick = Tick.unpack(Tick.of(session, t).pack())
        lost.append(tick.lost)

    made, lost = rig(TwinConfig()), list[int]()
    report = drive(made.session, DriveConfig(dry_run=0.5, duration=1.0), arm=True, on_tick=keep)
    assert report.result(made.session)["resets"] == 1
    assert len(lost) == made.session.tally.ticks
    assert max(lost) < 10


def test_E1_a_board_that_resets_is_counted_and_used_again_within_a_second_of_its_greeting() -> None:
    log = walked(at(EVENT, "esp32=reset"), DriveConfig(dry_run=DRY, duration=2.4))
    clock = log.rig.session.board.clock
    assert clock.resets == 1
    assert "HARD" in " ".join(log.texts)
    t, state = np.array(log.t), np.array(log.state)
    assert (state[(t > EVENT + 0.11) & (t < EVENT + 0.5)] >= State.HOLD).all()
    again = state[t > EVENT + 1.5]
    assert len(again) > 10
    assert (again <= State.DEGRADED).all()


@pytest.mark.parametrize(
    ("fault", "cause", "side"),
    [
        ("open_left", Cause.OPEN, "left"),
        ("open_right", Cause.OPEN, "right"),
        ("short_left", Cause.SHORT_LO, "left"),
        ("right:4095", Cause.SHORT_HI, "right"),
    ],
)
def test_S1_S2_a_broken_wire_is_named_with_its_side_through_bytes_within_100_ms(
    fault: str, cause: Cause, side: str
) -> None:
    log = walked(at(EVENT, f"esp32={fault}"))
    assert log.first(cause) <= EVENT + 0.1 + 0.02  # the reading after the fault, and its way here
    t, state = np.array(log.t), np.array(log.state)
    assert (state[t > EVENT + 0.11] >= State.HOLD).all()
    assert log.texts[-1].startswith(f"HOLD {cause.name}: {cause.text} ({side})")
    assert log.report.why.startswith(f"HOLD {cause.name}: ")


def test_B1_a_silent_servo_is_named_within_100_ms_and_the_others_keep_their_torque() -> None:
    with_torque: list[int] = []

    def act(rig: Rig, t: float) -> None:
        silence(rig, t)
        with_torque.append(sum(servo.torque for servo in rig.robot.servos))

    silence = at(1.5, "servo:7=silent")
    log = walked(act, DriveConfig(dry_run=DRY, fault_time=0.5, duration=4.0))
    named = next(t for t, s in zip(log.t, log.texts, strict=True) if "servo 7" in s)
    assert named - 1.5 <= 0.1
    fault = log.state.index(State.FAULT)
    assert with_torque[fault:] == [19] * len(with_torque[fault:])
    assert log.t[-1] - log.t[fault] == pytest.approx(0.5, abs=0.05)
    goals = np.array(log.goals[fault:])
    assert (goals == goals[0]).all()
    left = [servo.get("id") for servo in log.rig.robot.servos if servo.torque]
    assert left == [7], "which hears nothing"


@pytest.mark.parametrize(
    "what", ["overload", pytest.param("overheat", marks=pytest.mark.slow), "voltage"]
)
def test_B12_a_hardware_error_is_named_within_200_ms_and_it_holds(what: str) -> None:
    log = walked(at(EVENT, f"servo:9={what}"))
    at_error = log.first(Cause.SERVO_ERROR)
    assert at_error - EVENT <= 0.2
    assert any("servo 9" in text for text in log.texts)
    assert log.state[-1] >= State.FAULT


def test_B7_T5_servos_stop_by_themselves_within_120_ms_of_the_last_packet() -> None:
    made = rig(TwinConfig())
    drive_until(made, EVENT)
    end = made.clock.now()
    made.clock.sleep_until(end + 0.120)
    assert all(servo.get("bus_watchdog") == -1 for servo in made.robot.servos)
    stood = [servo.position for servo in made.robot.servos]
    made.clock.sleep_until(end + 0.5)
    moved = abs(np.array([servo.position for servo in made.robot.servos]) - stood)
    assert moved.max() < 100  # settling, not walking: a leg would turn by 780 ticks


def drive_until(made: Rig, t: float) -> None:
    """Walk, then stop dead, as a killed program does."""

    class Killed(BaseException):
        pass

    def kill(session: Session, now: float) -> None:
        if now >= t:
            made.session.release = list  # type: ignore[method-assign]
            raise Killed

    with pytest.raises(Killed):
        drive(made.session, CONFIG, arm=True, on_tick=kill)


def test_T2_a_controller_that_hangs_stops_every_servo_within_120_ms_of_the_last_packet() -> None:
    """It never comes back from its decision: nobody sends, and nobody has to."""

    made = rig(TwinConfig())
    sound, servos, wait = (
        made.session.control.controller.step,
        made.robot.servos,
        made.clock.sleep_until,
    )
    tripped: list[float] = []
    seen: list[list[float]] = []

    def step(frame: AntennaFrame) -> JointCommand:
        seen.append([servo.position for servo in servos])
        if made.clock.now() < EVENT:
            return sound(frame)
        last = max(servo.last_fed for servo in servos)
        while not all(servo.get("bus_watchdog") == -1 for servo in servos):
            wait(made.clock.now() + 0.001)
            if made.clock.now() > last + 1.0:
                raise KeyboardInterrupt
        tripped.append(made.clock.now() - last)
        for _ in range(2):
            seen.append([servo.position for servo in servos])
            wait(made.clock.now() + 0.4)
        raise KeyboardInterrupt

    made.session.control.controller.step = step  # type: ignore[method-assign]
    made.session.release = list  # type: ignore[method-assign]
    drive(made.session, CONFIG, arm=True)
    assert tripped[0] <= 0.120
    walked, stopped = np.ptp(seen[-43:-2], axis=0), np.ptp(seen[-2:], axis=0)
    assert walked[5:17].min() > 700
    assert stopped.max() < 100  # settling, not walking


@pytest.mark.parametrize("volts", [11.1, 10.5])
def test_B8_servos_stop_within_120_ms_when_only_the_controller_fails(
    volts: float,
) -> None:
    """The loop still reads the board in every tick; a packet to any servo would feed them all."""
    made = rig(TwinConfig())
    sound, servos = made.session.control.controller.step, made.robot.servos
    heard: list[float] = []
    tripped: list[float] = []

    def step(frame: AntennaFrame) -> JointCommand:
        servos[0].set("present_input_voltage", round(10 * volts))  # at 10.5 V it goes at half pace
        if made.clock.now() < EVENT:
            heard[:] = [max(servo.last_fed for servo in servos)]
            return sound(frame)
        if all(servo.get("bus_watchdog") == -1 for servo in servos):
            tripped.append(made.clock.now())
        raise ValueError("a bug")

    made.session.control.controller.step = step  # type: ignore[method-assign]
    drive(made.session, CONFIG, arm=True)
    assert (made.session.actuators.state.supply < 10.8) == (volts < 10.8)
    assert tripped
    assert tripped[0] - heard[0] <= 0.120 + 0.02  # its last tick, and the one that looks


def test_L9_the_gait_stands_still_during_a_hold_so_that_no_leg_has_to_catch_up() -> None:
    """Goals move at a limited speed: a gait that had gone on meanwhile would be out of reach.

    They have caught up 1.2 s after the start. One tick of the gait, 0.025 rad, is caught up in 1.3;
    half a second of it would be in 63.
    """
    limited: list[int] = []

    def act(rig: Rig, t: float) -> None:
        rig.robot.board_silent = 1.8 <= t < 2.3
        if t >= 1.8:
            limited.append(rig.session.tally.limited)

    log = walked(act, DriveConfig(dry_run=DRY, duration=2.4), SLOW)
    assert log.state[-2] <= State.DEGRADED
    assert (limited[-1] - limited[0]) / 12 < 3


def test_G6_a_robot_whose_record_is_required_holds_while_none_is_kept() -> None:
    """For 0.3 s; it walks on by itself."""

    def lose(made: Rig, t: float) -> None:
        made.session.unrecorded = 1.005 <= t < 1.305

    made = rig(TwinConfig(scene="flat"))
    log = Log(made, lose)
    config = DriveConfig(dry_run=DRY, duration=1.6)
    report = drive(made.session, config, arm=True, on_tick=log)
    t, states = np.array(log.t), np.array(log.state)
    lost = (t > 1.015) & (t < 1.315)
    assert (states[lost] == State.HOLD).all()
    assert len({tuple(log.goals[i]) for i in np.flatnonzero(lost)[1:]}) == 1
    assert (states[(t > 1.45) & (t < 1.85)] == State.OK).all()  # once the average is full
    assert report.worst is State.HOLD
    assert "one is required" in report.why


@pytest.mark.parametrize("number", STOPS)
def test_B19_a_signal_holds_the_pose_and_takes_torque_off_within_2_s(number: int) -> None:
    """However often it comes; while the torque goes off too."""
    made = rig(TwinConfig())
    before = signal.getsignal(number)

    def stop(session: Session, t: float) -> None:
        if t > EVENT:
            signal.raise_signal(number)

    stand = made.session.stand

    def again(time: float) -> None:
        assert time == 0.4
        signal.raise_signal(number)
        goals = [servo.get("goal_position") for servo in made.robot.servos]
        stand(time)
        assert [servo.get("goal_position") for servo in made.robot.servos] == goals
        signal.raise_signal(number)

    made.session.stand = again
    config = CONFIG.model_copy(update={"stand": 0.4})
    report = drive(made.session, config, arm=True, on_tick=stop)
    assert made.clock.now() - EVENT <= 2.0
    assert report.safe
    assert not any(servo.torque for servo in made.robot.servos)
    assert signal.getsignal(number) == before


def test_B19_an_exception_takes_torque_off_and_is_not_swallowed() -> None:
    made = rig(TwinConfig())

    def fail(session: Session, t: float) -> None:
        if t > EVENT:
            raise RuntimeError("a bug")

    with pytest.raises(RuntimeError, match="a bug"):
        drive(made.session, CONFIG, arm=True, on_tick=fail)
    assert made.session.tally.sent > 50
    assert not any(servo.torque for servo in made.robot.servos)


def test_B19_a_servo_that_does_not_confirm_is_named() -> None:
    made = rig(TwinConfig())

    def stop(session: Session, t: float) -> None:
        if t > EVENT:
            made.robot.bus.trouble[4] = Trouble(Fault.SILENT)
            raise KeyboardInterrupt

    report = drive(made.session, CONFIG, arm=True, on_tick=stop)
    assert report.on == [4]
    assert not report.safe


def test_T6_tracebacks_of_a_controller_are_kept_once_a_second() -> None:
    session = rig(TwinConfig()).session

    class Broken:
        contact = maneuver = np.zeros((1, 2), int)

        def step(self, frame: object) -> object:
            raise ZeroDivisionError("of the plugin")

    session.control.controller = Broken()  # type: ignore[assignment]
    session.clock.sleep_until(1.0)
    for tick in range(251):
        session.clock.sleep_until(1.0 + 0.01 * tick)
        session.control.step(session.frame)
    kept = session.control.tracebacks.kept
    assert (len(kept), session.control.tracebacks.left_out) == (3, 248)
    assert "in step" in kept[0]
    assert "ZeroDivisionError: of the plugin" in kept[0]
    assert Report().result(session)["tracebacks"] == list(kept)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda robot: robot.bus.servos.pop(6), "id 7: silent"),
        (
            lambda robot: robot.servos[6].set("id", 8),
            "id 7: silent, perhaps it answers as 8; id 8: two servos answer with this id; leave",
        ),
        (lambda robot: robot.servos[0].set("model_number", 1200), "id 1: expected model XC430"),
        (lambda robot: robot.servos[8].set("operating_mode", 3), r"mode .* \[9\]"),
    ],
)
def test_B15_servos_that_are_not_as_expected_are_refused(
    spoil: Callable[[object], object], said: str
) -> None:
    made = rig(TwinConfig())
    spoil(made.robot)
    with pytest.raises(BringUpError, match=said):
        require_servos(made.session.actuators.bus, RobotSpec())


def test_B11_a_servo_that_reboots_alone_is_a_fault_within_a_second() -> None:
    log = walked(at(EVENT, "servo:6=reboot"), DriveConfig(dry_run=DRY, duration=1.8))
    t, state = np.array(log.t), np.array(log.state)
    assert t[(t > EVENT) & (state >= State.FAULT)][0] - EVENT <= 1.0
    assert any("servo 6" in text for text in log.texts)


def test_B9_a_tripped_watchdog_is_named_within_200_ms() -> None:
    done: list[float] = []

    def act(rig: Rig, t: float) -> None:
        if t >= EVENT and not done:
            done.append(t)
            rig.robot.servos[11].set("bus_watchdog", -1)

    log = walked(act)
    assert log.first(Cause.WATCHDOG) - done[0] <= 0.2
    assert any("servo 12" in text for text in log.texts)


def spoil(servo: int, *registers: str) -> Callable[[Rig, float], None]:
    """At the event registers become 0, and nothing else happens."""
    done: list[float] = []

    def act(rig: Rig, t: float) -> None:
        if t >= EVENT and not done:
            done.append(t)
            for register in registers:
                rig.robot.servos[servo - 1].set(register, 0)

    return act


@pytest.mark.parametrize(
    ("servo", "registers"),
    [
        (1, ("torque_enable",)),
        (7, ("torque_enable",)),
        (7, ("bus_watchdog",)),
        (19, ("torque_enable", "bus_watchdog")),
        pytest.param(1, ("bus_watchdog",), marks=pytest.mark.slow),
        pytest.param(1, ("torque_enable", "bus_watchdog"), marks=pytest.mark.slow),
        pytest.param(7, ("torque_enable", "bus_watchdog"), marks=pytest.mark.slow),
        pytest.param(19, ("torque_enable",), marks=pytest.mark.slow),
        pytest.param(19, ("bus_watchdog",), marks=pytest.mark.slow),
    ],
)
def test_B11_B9_a_servo_without_torque_or_watchdog_is_a_fault_within_a_second(
    servo: int, registers: tuple[str, ...]
) -> None:
    log = walked(spoil(servo, *registers))
    assert log.first(Cause.DISARMED) - EVENT <= 0.25
    assert log.state[-1] >= State.FAULT
    assert any(f"(servo {servo})" in text for text in log.texts if "DISARMED" in text)


def test_B11_a_restart_that_answers_at_once_is_a_fault_and_arming_sets_all_of_it_anew() -> None:
    made = rig(TwinConfig(scene="flat"))
    session, servo = made.session, made.robot.servos[5]
    causes: list[set[Cause]] = []

    def tick(n: int) -> None:
        for _ in range(n):
            session.write(session.control.step(session.read()))
            assert session.outputs is not None
            causes.append({active.cause for active in session.outputs.causes})
            made.clock.sleep_until(made.clock.now() + session.period / 2)

    tick(100)
    session.orders.arm = True
    tick(200)
    assert servo.torque
    assert session.outputs is not None
    assert session.outputs.state is State.OK
    servo.restart(made.clock.now(), 0.0)
    began = len(causes)
    session.orders.arm = False
    tick(30)
    assert any(Cause.DISARMED in found for found in causes[began : began + 25])
    assert session.outputs.state is State.FAULT
    assert not servo.torque
    session.orders.arm = True
    tick(30)
    assert session.outputs.state <= State.DEGRADED
    assert (servo.torque, servo.get("bus_watchdog")) == (True, 5)


def test_B11_nothing_is_said_of_torque_in_a_dry_run() -> None:
    made = rig(TwinConfig())
    log = Log(made, spoil(7, "bus_watchdog"))
    drive(made.session, DriveConfig(dry_run=EVENT + 0.5), arm=False, on_tick=log)
    assert Cause.DISARMED not in set().union(*log.causes)


def test_B18_a_walk_writes_no_eeprom(walk: Log) -> None:
    assert walk.rig.session.tally.sent > 50
    assert sum(servo.eeprom_writes for servo in walk.rig.robot.servos) == 0


def test_B13_a_supply_that_cannot_be_read_any_more_is_not_known_after_4_s() -> None:
    def act(rig: Rig, t: float) -> None:
        if t >= 0.5:
            rig.robot.bus.trouble[1] = Trouble(Fault.SILENT)

    made = rig(TwinConfig())
    log = Log(made, act)
    supply: list[float] = []

    def note(session: Session, t: float) -> None:
        log(session, t)
        supply.append(session.actuators.state.supply)

    drive(made.session, DriveConfig(dry_run=5.0), arm=False, on_tick=note)
    known = np.isfinite(supply)
    assert known[(np.array(log.t) > 0.3) & (np.array(log.t) < 0.7)].all()
    assert not known[np.array(log.t) > 4.6].any()
    assert Cause.SUPPLY_UNKNOWN in log.causes[-1]


@pytest.mark.parametrize("what", ["servo", "command"])
def test_B10_arming_that_fails_half_way_leaves_no_servo_with_torque(what: str) -> None:
    made = rig(TwinConfig())
    servos, sound = made.robot.servos, made.session.control.controller.step
    had_torque: list[int] = []

    def step(frame: AntennaFrame) -> JointCommand:
        command = sound(frame)
        if what == "command":
            command.yaw[0, 2] = 2.0
        return command

    def note(session: Session, t: float) -> None:
        had_torque.append(sum(servo.torque for servo in servos))

    made.session.control.controller.step = step  # type: ignore[method-assign]
    if what == "servo":
        servos[11].write = refusing(servos[11])  # type: ignore[method-assign]
    log = Log(made)

    def both(session: Session, t: float) -> None:
        log(session, t)
        note(session, t)

    config = DriveConfig(dry_run=DRY, duration=0.8, touch=TouchCheckParams(patience=0.5))
    drive(made.session, config, arm=True, on_tick=both)
    assert max(had_torque) == 0
    assert log.state[-1] >= State.FAULT
    said = "torque_enable" if what == "servo" else "0.5087 rad for servo 3"
    assert any(said in text for text in log.texts)


def refusing(servo: Servo) -> Callable[[int, bytes], StatusError]:
    """How a servo writes that takes anything but torque."""
    write = servo.write

    def taken(address: int, data: bytes) -> StatusError:
        return StatusError.RESULT_FAIL if (address, data) == (64, b"\1") else write(address, data)

    return taken


def test_B13_a_sagging_supply_warns_then_holds_then_switches_off() -> None:
    """From 11.1 V by 1 V a second, less under load; the limit of the XC430-W240 is 6.0 V."""
    log = walked(at(EVENT, "bus=discharge:1.0"), DriveConfig(dry_run=DRY, duration=5.0))
    order = [log.first(c) for c in (Cause.SUPPLY_WARN, Cause.SUPPLY_HOLD, Cause.SUPPLY_OFF)]
    assert order == sorted(set(order))
    states = dict(zip(log.t, log.state, strict=True))
    assert states[log.first(Cause.SUPPLY_WARN)] is State.DEGRADED
    assert states[log.first(Cause.SUPPLY_HOLD)] is State.HOLD
    assert states[log.first(Cause.SUPPLY_OFF)] is State.OFF
    assert not any(Cause.SERVO_ERROR in causes for causes in log.causes)
    assert not any(servo.torque for servo in log.rig.robot.servos)
    assert not any(servo.get("hardware_error_status") for servo in log.rig.robot.servos)


@pytest.mark.ci
def test_B13_below_the_first_level_it_walks_at_half_the_pace_and_replays_alike() -> None:
    """The gait turns each leg 0.4 times in 1 s."""
    ticks = list[Tick]()

    def on_tick(made: Rig, now: float) -> None:
        if now >= 2.6:
            made.robot.servos[0].set("present_input_voltage", 105)
        ticks.append(Tick.of(made.session, now))

    made = walked(on_tick, DriveConfig(dry_run=DRY, duration=3.8), SLOW).rig
    legs = {tick.number: np.array(tick.angles)[5:17] for tick in ticks}
    assert {Cause.SUPPLY_WARN} <= {active.cause for active in made.session.outputs.causes}
    assert legs[260] - legs[160] == pytest.approx(np.full(12, 0.8 * math.pi), rel=0.03)
    assert legs[400] - legs[300] == pytest.approx(np.full(12, 0.4 * math.pi), rel=0.03)
    found = replay(ticks, make_controller("closed", SLOW), Header(controller="closed", params=SLOW))
    assert (len(found.maneuvers), found.different, found.commands) == (len(ticks), 0, 0)


def test_B19_torque_goes_off_in_the_configured_order() -> None:
    spec = RobotSpec(release=("legs", "antennae", "yaw"))
    made = rig(TwinConfig(robot=spec))
    begun: list[int] = []
    receive = made.robot.bus.receive

    def listen(t: float, data: bytes) -> None:
        packets = [p for p in Parser().feed(data) if p.instruction == Instruction.SYNC_WRITE]
        begun.extend(p.params[4] for p in packets if p.params[:2] == b"\x40\0")
        receive(t, data)

    config = DriveConfig(dry_run=0.5, duration=0.5, robot=spec)
    made.robot.bus.receive = listen
    report = drive(made.session, config, arm=True)
    assert begun[-3:] == [6, 18, 1]
    assert report.safe
    assert not any(servo.torque for servo in made.robot.servos)
    with pytest.raises(ValueError, match="each group once"):
        RobotSpec(release=("legs", "legs", "yaw"))


@pytest.mark.parametrize("latency", [0.0, 0.016])
def test_B17_an_adapter_that_keeps_bytes_back_is_refused_with_its_cure(latency: float) -> None:
    made = rig(TwinConfig())
    made.clock.latency = latency
    words = (made.clock, (1, 2), 1_000_000, made.clock.now, "/dev/ttyUSB1")
    if latency:
        with pytest.raises(BringUpError, match=r"found 16\.\d ms.*echo 1 \| sudo tee .*ttyUSB1/"):
            require_quick(*words)
    else:
        assert require_quick(*words) == pytest.approx(0.0005, abs=0.0005)


def test_L15_B16_a_second_program_on_a_port_is_refused() -> None:
    serial_port = pytest.importorskip("antennate.hardware.ports.serial_line")
    with PtyServer(rig(TwinConfig()).robot.bus) as server:
        first = serial_port.SerialPort(server.path, 1_000_000)
        with pytest.raises(PortError, match=server.path):
            serial_port.SerialPort(server.path, 1_000_000)
        first.close()
        serial_port.SerialPort(server.path, 1_000_000).close()
