"""One contract for all worlds: the control cannot tell which it is in.

The rules take a world that has run for TICKS ticks and was blind from tick BLIND on; the decisions
of all worlds are the same, bit by bit.
"""

from __future__ import annotations

import copy
import math
from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from worlds import (
    ARMED_AT,
    LAYOUT,
    TICKS,
    WORLDS,
    World,
    plain_tick,
    recorded,
    replayed,
    session,
    simulated,
    twin,
)

import antennate
from antennate.control.loop import run_loop
from antennate.control.registry import BUILT_IN, make_controller
from antennate.hardware.esp32.board import BoardReader
from antennate.hardware.esp32.clock import DeviceClock, Timed
from antennate.hardware.esp32.wire import Sample
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.replay import ReplayRobot, recorded_controller, replay
from antennate.telemetry.ticks import Tick
from antennate.telemetry.writer import LogWriter
from antennate.types import AntennaFrame, Contact, JointCommand, Maneuver

BLIND = 220
EMPTY = Sample(boot_id=1, seq=0, ticks=0, left=1800, right=1800, flags=0, drops=0)
SHAPES = {"yaw": (1, 5), "leg": (1, 6, 2), "antenna": (1, 2)}


@pytest.fixture(scope="module", params=WORLDS)
def world(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> World:
    """A world that has run. It was read before anything was written to it."""
    made = WORLDS[request.param](tmp_path_factory.mktemp("world"), "closed", 1, BLIND)
    made.early = [made.body.read()]
    made.run(TICKS)
    return made


# rules of the wall, for every world


def test_M7_frames_have_one_shape_and_type(world: World) -> None:
    assert len(world.seen) == TICKS
    for frame in [*world.early, *(seen.frame for seen in world.seen)]:
        assert frame.t.shape == (1,)
        assert frame.counts.shape == (1, 2)
        assert frame.t.dtype == frame.counts.dtype == np.float64
        assert np.isfinite(frame.t).all()
        assert frame.positions.size == 0 or frame.positions.shape == (1, len(LAYOUT.ids))
        counts = frame.counts[~np.isnan(frame.counts)]
        assert ((counts >= 0) & (counts <= 4095)).all()


def test_M7_time_goes_forward_and_every_sleep_lasts_until_its_end(world: World) -> None:
    period = world.header.params.period
    for before, after in pairwise(world.seen):
        assert after.frame.t[0] >= before.frame.t[0]  # a sample may be the newest twice
        assert after.now > before.now
    steps = np.diff([seen.frame.t[0] for seen in world.seen])
    assert np.median(steps) == pytest.approx(period, rel=1e-3)
    clock = world.body.clock
    for ahead in (0.3 * period, period, 2.5 * period):
        end = clock.now() + ahead
        clock.sleep_until(end)
        assert clock.now() >= end - 1e-9


def test_M7_a_sleep_until_the_past_never_turns_time_back(world: World) -> None:
    clock = world.body.clock
    for t in (clock.now(), clock.now() - 1.0, -math.inf):
        before = clock.now()
        clock.sleep_until(t)
        assert before <= clock.now() <= before + 1e-3


def test_M7_what_cannot_be_read_is_unknown_and_unknown_never_walks(world: World) -> None:
    """Of all ticks: a NaN means HOLD, with the command of the tick before."""
    blind = [bool(np.isnan(seen.frame.counts).any()) for seen in world.seen]
    assert blind.index(True, BLIND) <= BLIND + 10
    walked = 0
    for unknown, (before, seen) in zip(blind[1:], pairwise(world.seen), strict=True):
        if unknown:
            assert int(Contact.UNKNOWN) in seen.contact
            assert seen.maneuver == Maneuver.HOLD
        if seen.maneuver == Maneuver.HOLD:
            assert seen.decision()[1] == before.decision()[1]
        else:
            walked += seen.decision()[1] != before.decision()[1]
    assert walked > BLIND // 4


def test_M7_poses_have_one_shape_and_are_not_changed_by_the_world(world: World) -> None:
    for seen in world.seen:
        for name, shape in SHAPES.items():
            part = getattr(seen.command, name)
            assert part.shape == shape
            assert part.dtype == np.float64
            assert np.isfinite(part).all()
    command = world.seen[-1].command
    kept = copy.deepcopy(command)
    world.body.write(command)
    for name in SHAPES:
        np.testing.assert_array_equal(getattr(command, name), getattr(kept, name))


def test_M7_time_of_a_board_follows_the_host_whatever_comes_and_never_goes_back() -> None:
    """Samples of ages up to 50 ms, silences, and new epochs; no clock drifts."""
    rng = np.random.default_rng(4)

    class Chance:
        """A board whose newest usable sample is left to chance."""

        def __init__(self) -> None:
            self.epoch, self.taken = 0, -1.0
            self.clock = DeviceClock()

        def poll(self, clock: Callable[[], float]) -> int:
            self.epoch += rng.random() < 0.01
            self.taken = max(self.taken, clock() - rng.uniform(0.0, 0.05))
            return 1

        def newest(self, now: float) -> Timed | None:
            if now < 0.2 or rng.random() < 0.1:
                return None
            return Timed(EMPTY, self.epoch, 0, round(1e6 * self.taken), 0.0, 0.0)

    clock = Wandering(0, 0.01)
    reader = BoardReader(Chance(), clock)  # type: ignore[arg-type]
    times = []
    for tick in range(5000):
        clock.sleep_until(0.01 * tick)
        times.append(reader.read()[0])
    assert times == sorted(times)
    assert abs(np.array(times) - 0.01 * np.arange(5000)).max() <= 0.051


# the same decisions


def same_everywhere(folder: Path, name: str, trial: int, ticks: float) -> set[int]:
    """Run three worlds and the replays of two logs; the maneuvers that occurred."""
    worlds = {"simulation": simulated(folder, name, trial), "twin": twin(folder, name, trial)}
    logs = [recorded(world, folder / name, ticks) for name, world in worlds.items()]
    seen = [world.seen for world in worlds.values()] + [replayed(log).run() for log in logs]
    first = [one.decision() for one in seen[0]]
    counts = [one.frame.counts.tobytes() for one in seen[0]]
    for other in seen[1:]:
        assert [one.decision() for one in other] == first
        assert [one.frame.counts.tobytes() for one in other] == counts
    return {maneuver for maneuver, _ in first}


def test_M7_G7_all_worlds_decide_the_same_in_the_same_scene(tmp_path: Path) -> None:
    """Four seconds with a turn and a step back."""
    met = same_everywhere(tmp_path, "paper", 2, 400)
    assert {Maneuver.FORWARD, Maneuver.REVERSE} < met


@pytest.mark.slow
@pytest.mark.parametrize(("name", "trial"), [("closed", 1), ("paper", 0), ("paper", 2)])
def test_M7_G7_all_worlds_decide_the_same_for_a_whole_trial(
    tmp_path: Path, name: str, trial: int
) -> None:
    assert Maneuver.REVERSE in same_everywhere(tmp_path, name, trial, math.inf)


@pytest.mark.ci
def test_G7_a_session_with_a_silent_board_is_replayed_to_the_bit(tmp_path: Path) -> None:
    """Before torque, walking, held, and walking again: as the log says, and as it was."""
    live = session(tmp_path, "closed", 1, blind=200)
    path = recorded(live, tmp_path / "log", 350)
    again = replayed(path)
    assert [one.decision() for one in again.run()] == [one.decision() for one in live.seen]
    with LogReader(path) as log:
        found = replay(log, recorded_controller(log.header), log.header)
        assert (log.ticks, log.missing, log.bad, log.end) == (350, 0, 0, 350)
    assert (found.different, found.commands, found.failures) == (0, 0, 0)
    assert {"OFF", "OK", "HOLD"} < set(found.states)
    with LogReader(path) as log:
        ticks = list(log)
    held = [tick for tick in ticks[200:] if tick.state == "HOLD"]
    assert held[0].age > 0.05
    assert any("HOLD STALE" in cause for cause in held[0].causes)
    assert {tick.maneuver for tick in held[1:]} == {Maneuver.HOLD}
    assert ticks[-1].state in {"OK", "DEGRADED"}
    assert ticks[-1].sent > ticks[200].sent > 50
    assert math.isnan(ticks[60].counts[0])  # withheld before torque
    assert not math.isnan(ticks[60].reading[0])


def test_G7_joint_angles_of_a_session_are_those_that_servos_told_and_come_back(
    tmp_path: Path,
) -> None:
    """The first frame has none; after torque they follow the goals of the tick before."""
    live = session(tmp_path, "closed", 1)
    again = replayed(recorded(live, tmp_path / "log", TICKS))
    given = np.array([seen.frame.positions[0] for seen in live.seen])
    back = np.array([seen.frame.positions[0] for seen in again.run()])
    assert back.tobytes() == given.tobytes()
    assert np.isnan(given[0]).all()
    assert np.isfinite(given[1:]).all()
    goals = np.array([seen.command.yaw[0] for seen in live.seen])
    assert abs(given[-1, :5] - goals[-2]).max() < 0.2  # a servo lags behind its goal
    assert np.ptp(given[ARMED_AT:, :5], axis=0).min() > 0.1


def test_G7_joint_angles_of_a_simulation_come_back_with_the_errors_of_their_zeros(
    tmp_path: Path,
) -> None:
    frames: list[AntennaFrame] = []

    class Feeling:
        def __init__(self, control: ControlParams, robot: RobotSpec, batch: int) -> None:
            self._own = make_controller("closed", control, robot, batch)

        def __getattr__(self, name: str) -> object:
            return getattr(self._own, name)

        def step(self, frame: AntennaFrame) -> JointCommand:
            frames.append(frame)
            return self._own.step(frame)

    path = tmp_path / "walk.mcap"
    antennate.simulate(Feeling, time_limit=2.0, seed=5, log=path)
    with LogReader(path) as log:
        bias = log.header.joint_bias
        body = ReplayRobot(list(log), log.header)
        measured = []
        for frame in frames:
            again = body.read()
            assert again.positions.tobytes() == frame.positions.tobytes()
            measured.append(body.tick.positions if body.tick else ())
            body.sleep_until(body.now() + 1.0)
    assert len(bias) == 5
    assert min(map(abs, bias)) > 0.0
    off = np.array(measured)[:, :5] - np.array([frame.positions[0, :5] for frame in frames])
    assert off == pytest.approx(np.tile(bias, (len(frames), 1)))


class Wandering:
    """A world without physics: readings that wander, touch, jump and vanish."""

    def __init__(self, seed: int, period: float) -> None:
        self._rng = np.random.default_rng(seed)
        self._period = period
        self._ticks = 0
        self._at = np.array([1800.0, 1800.0])
        self._gone = np.zeros(2, int)

    @property
    def clock(self) -> Wandering:
        return self

    def now(self) -> float:
        return self._ticks * self._period

    def sleep_until(self, t: float) -> None:
        self._ticks = max(self._ticks, round(t / self._period))

    def read(self) -> AntennaFrame:
        self._at += self._rng.normal(0.0, 15.0, 2)
        self._at = np.where(self._rng.random(2) < 0.002, self._rng.uniform(1300, 1950, 2), self._at)
        self._at = np.clip(self._at, 1300.0, 1950.0)
        lost = self._rng.random(2) < 0.001
        self._gone = np.where(lost, self._rng.integers(1, 80, 2), np.maximum(self._gone - 1, 0))
        counts = np.where(self._gone > 0, math.nan, np.rint(self._at))
        return AntennaFrame(t=np.array([self.now()]), counts=counts[None])

    def write(self, command: JointCommand) -> None:
        pass


@pytest.mark.parametrize(
    ("logs", "ticks"), [(7, 1000), pytest.param(10, 100_000, marks=pytest.mark.slow)]
)
@pytest.mark.slow
def test_G7_logs_of_wandering_readings_are_replayed_to_the_bit(
    tmp_path: Path, logs: int, ticks: int
) -> None:
    met: Counter[int] = Counter()
    for seed in range(logs):
        name = list(BUILT_IN)[seed % len(BUILT_IN)]
        header = Header(controller=name, params=ControlParams(), seed=seed, phase=0.1 * seed)
        control = recorded_controller(header)
        body = Wandering(seed, header.params.period)
        path = tmp_path / str(seed)
        with LogWriter(path, header, least_free=0.0) as out:

            def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
                tick = plain_tick(control, frame, command, out.written + 1, body.now())  # noqa: B023
                out.write(tick)
                return out.written < ticks

            run_loop(body, control, header.params.period, go_on)
        with LogReader(path) as log:
            found = replay(log, recorded_controller(log.header), log.header)
            assert (log.ticks, log.missing, log.bad) == (ticks, 0, 0)
        assert (found.different, found.commands) == (0, 0)
        met += found.recorded
    assert set(met) == set(Maneuver)


def test_G7_another_controller_differs_and_the_first_difference_is_named(tmp_path: Path) -> None:
    world = simulated(tmp_path, "paper", 0)
    path = recorded(world, tmp_path / "log", 200)
    with LogReader(path) as log:
        found = replay(log, recorded_controller(log.header, "open"), log.header)
    decided = [one.maneuver for one in world.seen]
    turned = next(i for i, maneuver in enumerate(decided) if maneuver != Maneuver.FORWARD)
    assert found.first is not None
    assert found.first.number == turned + 1
    assert (found.first.recorded, found.first.replayed) == (decided[turned], Maneuver.FORWARD)
    assert found.different == sum(maneuver != Maneuver.FORWARD for maneuver in decided)


def test_a_tick_of_a_controller_of_anybody_is_kept_too() -> None:
    """It has no level and no phase, and its command is of a robot with one joint less."""

    class Odd:
        maneuver = np.array([3])
        contact = np.array([[0, 1]])
        gait = "none"

    seen = simulated(Path(), "open", 0).run(1)[0]
    seen.command.yaw.resize((1, 4), refcheck=False)
    tick = plain_tick(Odd(), seen.frame, seen.command, 1, 0.5)
    assert (tick.maneuver, tick.contact) == (3, (0, 1))
    assert all(map(math.isnan, (*tick.level, tick.phase)))
    parts = (seen.command.yaw, seen.command.leg, seen.command.antenna)
    assert tick.angles == tuple(np.concatenate([part.ravel() for part in parts]).tolist())
    assert Tick.unpack(tick.pack()).pack() == tick.pack()
