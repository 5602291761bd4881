"""What a controller is given is its own copy: no judge, log or other tick sees what it writes."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import antennate
from antennate.cli import main
from antennate.control.controllers import open_loop
from antennate.control.loop import CheckedController, run_loop
from antennate.control.registry import make_controller
from antennate.experiments.tunnel.physics import TrialResult
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, JointCommand, Maneuver

ATTACKS = '''
import numpy as np
from antennate.control.controllers import open_loop

class Plain:
    """`open`, which writes into what it is given for two seconds."""
    def __init__(self, control, robot, batch):
        self.inner, self.ticks = open_loop(control, robot, batch), 0
    def __getattr__(self, name):
        return getattr(self.inner, name)
    def reset(self, rows, phase=0.0):
        self.inner.reset(rows, phase)
    def step(self, frame):
        self.ticks += 1
        given = frame.copy()
        if self.ticks < 200:
            self.write(frame)
        return self.inner.step(given)
    def write(self, frame):
        pass

class Stops(Plain):
    def write(self, frame):
        frame.t[:] = 0.0

class Bases(Plain):
    def write(self, frame):
        t = frame.t
        while t is not None:
            t.setflags(write=True)
            t[:], t = 0.0, t.base

class Binds(Plain):
    def write(self, frame):
        object.__setattr__(frame, "t", np.zeros_like(frame.t))

class Honest(Plain):
    def write(self, frame):
        self.t0 = getattr(self, "t0", frame.t.copy())
        t = frame.t
        t -= self.t0 + 1.0
'''


def rows_of(tmp_path: Path, command: str, names: list[str], *words: str) -> list[dict[str, str]]:
    """Rows of a run of these controllers, the first of them `Plain`."""
    file = tmp_path / "attacks.py"
    file.write_text(ATTACKS)
    argv = [command, "--controllers", *(f"{file}:{name}" for name in names), "--no-figures"]
    assert main([*argv, "--workers", "1", "--out", str(tmp_path / "run"), *words]) == 0
    return list(csv.DictReader((tmp_path / "run" / "trials.csv").read_text().splitlines()))


@pytest.mark.ci
@pytest.mark.parametrize("name", ["Stops", "Bases", "Binds", "Honest"])
def test_a_trial_ends_at_its_limit_whatever_a_controller_writes(tmp_path: Path, name: str) -> None:
    words = ["--trials", "2", "--time-limit", "0.5", "--scene", "flat"]
    plain, written = np.split(np.array(rows_of(tmp_path, "tunnel", ["Plain", name], *words)), 2)
    for one, other in zip(plain, written, strict=True):
        assert (other["outcome"], float(other["time_s"])) == ("timeout", 0.5)
        assert {**one, "controller": ""} == {**other, "controller": ""}


@pytest.mark.ci
def test_a_competitor_cannot_stop_the_clock(tmp_path: Path) -> None:
    words = ["--trials", "1", "--scenes", "flat+time_limit=0.3"]
    plain, written = rows_of(tmp_path, "compete", ["Plain", "Stops"], *words)
    assert (written["outcome"], float(written["time_s"])) == ("timeout", 0.3)
    assert written["progress_m"] == plain["progress_m"]


class Keeps:
    """`open`, which writes into all that it has returned and was given."""

    def __init__(self, control: Any, robot: Any, batch: int) -> None:
        self.inner, self.past = open_loop(control, robot, batch), list[Any]()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def reset(self, rows: Any, phase: Any = 0.0) -> None:
        self.inner.reset(rows, phase)
        if isinstance(phase, np.ndarray):
            phase[:] = 9.0

    def step(self, frame: AntennaFrame) -> JointCommand:
        self.maneuver, given = np.array([0]), frame.copy()
        frame.counts[:] = frame.t[:] = 9.0
        self.past.append(self.inner.step(given))
        return self.past[-1]

    def spoil(self) -> None:
        """Write into what it has returned and decided."""
        self.past[-1].yaw[:], self.maneuver[:] = 9.0, Maneuver.HOLD


def test_what_a_controller_answered_stays_as_it_was() -> None:
    made = Keeps(ControlParams(), RobotSpec(), 1)
    checked, phase = CheckedController(made, RobotSpec(), 1), np.array([0.5])
    checked.reset(np.array([0]), phase)
    frame = AntennaFrame(np.zeros(1), np.full((1, 2), 1800.0))
    command = checked.step(frame)
    yaw = command.yaw.copy()
    made.spoil()
    assert np.array_equal(command.yaw, yaw)
    assert checked.maneuver.tolist() == [Maneuver.FORWARD]
    assert (frame.t.tolist(), frame.counts.tolist(), phase.tolist()) == ([0], [[1800] * 2], [0.5])


def test_a_loop_ends_by_what_was_read() -> None:
    frames = list[AntennaFrame]()

    class Body:
        clock: Any
        time = 0.0

        def __init__(self) -> None:
            self.clock = self

        def now(self) -> float:
            return self.time

        def sleep_until(self, t: float) -> None:
            self.time = t

        def read(self) -> AntennaFrame:
            return AntennaFrame(np.array([self.time]), np.full((1, 2), 1800.0))

        def write(self, command: JointCommand) -> None: ...

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        frames.append(frame)
        return len(frames) < 3

    run_loop(Body(), Keeps(ControlParams(), RobotSpec(), 1), 0.01, go_on)
    assert [float(frame.t[0]) for frame in frames] == pytest.approx([0.0, 0.01, 0.02])


def test_a_decision_that_changes_with_each_question_is_asked_once() -> None:
    class Fickle(Keeps):
        def step(self, frame: AntennaFrame) -> JointCommand:
            self.asked = 0
            return self.inner.step(frame)

        @property
        def maneuver(self) -> Any:
            self.asked += 1
            return np.array([min(self.asked, 2) - 1])

        @maneuver.setter
        def maneuver(self, value: Any) -> None: ...

    series = antennate.simulate(Fickle, scene="flat", time_limit=0.1)
    assert set(series.maneuver.tolist()) == {Maneuver.FORWARD}


def test_the_numbers_of_a_run_are_not_those_that_a_controller_holds() -> None:
    control, robot = ControlParams(), RobotSpec()

    def spoils(own: Any, body: Any, batch: int) -> Any:
        own.rule.__dict__["threshold"], body.__dict__["mass"] = 0.9, 99.0
        object.__setattr__(own, "rate", 5.0)
        return open_loop(ControlParams(), RobotSpec(), batch)

    make_controller(spoils, control, robot)
    assert (control, robot) == (ControlParams(), RobotSpec())


def test_empty_parts_of_frames_are_not_shared() -> None:
    """One that is given another shape would be that of every later frame."""
    first, second = (AntennaFrame(np.zeros(1), np.zeros((1, 2))) for _ in range(2))
    assert first.positions is not second.positions


def test_an_episode_goes_on_whatever_is_written_into_its_arrays() -> None:
    def walk(writes: bool) -> list[Any]:
        pytest.importorskip("gymnasium", reason="environments need Gymnasium")
        from antennate import envs

        env = envs.AntennaVectorEnv(2, "flat", time_limit=0.5)
        kept = list[Any]()
        observation, infos = env.reset(seed=3)
        for _ in range(8):
            actions = np.array([1, 0])
            kept.append((observation.copy(), infos["t"].copy(), infos["head"].copy()))
            if writes:
                for array in (observation, *infos.values()):
                    array[...] = None if array.dtype == object else 0
            observation, *_, infos = env.step(actions)
            actions[:] = 3
        return kept

    for one, other in zip(walk(False), walk(True), strict=True):
        assert all(map(np.array_equal, one, other))


# the limit

WON = """
from antennate.sim.scenes.scene import FlatScene

class Won(FlatScene):
    def draw(self, robot, rng):
        drawn = super().draw(robot, rng)
        return Instance(drawn)

class Instance:
    def __init__(self, drawn):
        self.drawn = drawn
    def __getattr__(self, name):
        return getattr(self.__dict__["drawn"], name)
    def succeeded(self, head):
        return True
"""


@pytest.mark.parametrize(
    ("limit", "outcome"), [(0.06, "success"), (0.055, "timeout"), (0.0599, "timeout")]
)
def test_what_is_seen_after_the_limit_is_a_timeout(
    tmp_path: Path, limit: float, outcome: str
) -> None:
    """The first look is at 0.06 s, the first tick of 10 ms that is not before the limit."""
    (tmp_path / "won.py").write_text(WON)
    scene = f"{tmp_path / 'won.py'}:Won"
    settings: Any = {"scene": scene, "time_limit": limit}
    (row,) = antennate.run("tunnel", trials=1, controllers=("open",), **settings).rows
    assert (row.outcome, row.time_s) == (outcome, limit)
    assert antennate.simulate("open", **settings).meta["outcome"] == outcome
    pytest.importorskip("gymnasium", reason="environments need Gymnasium")
    from antennate import envs

    env = envs.AntennaEnv(**settings)
    env.reset(seed=0)
    info, ended, cut = {}, False, False
    while not (ended or cut):
        *_, ended, cut, info = env.step(0)
    assert info["outcome"] == outcome


@pytest.mark.parametrize("time", [43.0, -0.1, np.nan, np.inf])
def test_there_is_no_row_of_a_time_beyond_its_limit(time: float) -> None:
    key: Any = {"seed": 0, "trial": 0, "controller": "open", "outcome": "success", "limit_s": 8.0}
    TrialResult(**key, time_s=8.0)
    with pytest.raises(
        ValueError, match="time_s: expected a finite number of 0 to limit_s, 8, found"
    ):
        TrialResult(**key, time_s=time)


def test_a_robot_that_climbs_is_not_watched_beyond_its_limit() -> None:
    """The flat floor is walked for all its time, and the first tick after it is at 0.06 s."""
    settings: Any = {"heights": (0.05,), "grounds": ("flat",), "divisors": (256.0,), "sensing": 1}
    rows = antennate.run("climb", conditions=("level",), time_limit=0.055, **settings).rows
    assert {"walked", "timeout", "felt"} <= {row.outcome for row in rows}
    assert {row.time_s for row in rows} == {0.055}
