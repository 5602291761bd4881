"""One episode: a controller in one draw of a scene, with a time limit for each decision.

A decision has to be there before the readings are stale. Its time is that of the processor, with
that of programs that it began and that have ended, so that a machine with other work to do judges
alike; none may run on after it. Who waits or sleeps in a decision is stopped by the clock, after
`WAITING` times as long. The first decision, in which libraries are loaded, and a reset may take so
long on the processor, too. Episodes run in lockstep, and a step of all that stays within the limit
of one is within it for each. After one that does not, each episode runs alone, and is INVALID where
its own decision takes too long.
"""

from __future__ import annotations

import contextlib
import functools
import multiprocessing
import os
import resource
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from antennate import __version__
from antennate.control.knowledge import Kind, needs_of
from antennate.control.loop import Wrapped
from antennate.control.readings import condition
from antennate.control.registry import make_controller
from antennate.errors import ControllerError
from antennate.experiments.compete.scenes import tunnel_config
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.physics import TrialResult
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.scene import TIME_LIMIT
from antennate.sim.trial import Outcome, draw_scene, scene_of, time_limit_of
from antennate.studies.work import processor
from antennate.telemetry.header import versions
from antennate.types import AntennaFrame, Bools, Controller, Floats, Ints, JointCommand

WAITING = 20.0
"""How many times as long a decision may take on the clock as on the processor; the first one may
take so long on the processor, too."""


@dataclass(frozen=True, slots=True)
class Episode:
    """One row of the table.

    Attributes:
        controller: Name of the controller.
        scene: The scene, with its other parameters if it has some.
        seed: Seed of the run; with `trial` and `scene` it decides all chance.
        trial: Number of the draw.
        outcome: success, timeout, left, overturned, fell, or invalid, which counts as a failure.
        time_s: Time to the exit [s]; the limit for every failure.
        limit_s: Time limit [s].
        progress_m: How far the head came [m].
        overturned: Whether the robot lies on its back at the end.
        void_decisions: Decisions of a learned policy whose answer was no number: it held.
        given: What the simulation gave to the controller, in words; empty for its readings alone.
        drawn: Whether the seed was drawn when the run began, so that nobody knew it.
        version: Version of antennate.
        engine: Version of MuJoCo.
        processor: Model of the processor.
        reason: Why it is invalid; empty otherwise.
    """

    controller: str
    scene: str
    seed: int
    trial: int
    outcome: Outcome
    time_s: float
    limit_s: float = TIME_LIMIT
    progress_m: float = 0.0
    overturned: bool = False
    void_decisions: int = 0
    given: str = ""
    drawn: bool = False
    version: str = __version__
    engine: str = ""
    processor: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Draw:
    """What an episode is run from: its key and what decides beside it.

    `decision_limit` is in s; `drawn` is that of its row.
    """

    controller: str
    scene: str
    seed: int
    trial: int
    decision_limit: float
    drawn: bool = False


class Timed(Wrapped):
    """A controller whose decisions must not take longer than a limit.

    Args:
        made: The controller.
        limit: Processor time of a step [s].

    Raises:
        ControllerError: In a step or reset that took longer, or that left a program running.
    """

    def __init__(self, made: Controller, limit: float) -> None:
        super().__init__(made)
        self._limit, self._begun = limit, False
        self._needs = super().needs
        self._alarm = threading.current_thread() is threading.main_thread()
        if self._alarm:
            signal.signal(signal.SIGALRM, self._give_up)

    @property
    def needs(self) -> tuple[Kind, ...]:
        """What it needed when it was made: that it is given, whatever it says later."""
        return self._needs

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """As of a `Controller`."""
        with self._within(WAITING * self._limit):
            self._made.reset(rows, phase)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """As of a `Controller`."""
        with self._within(self._limit * (1.0 if self._begun else WAITING)):
            command = self._made.step(frame)
        self._begun = True
        return command

    @contextlib.contextmanager
    def _within(self, limit: float) -> Iterator[None]:
        """Refuse what takes longer on the processor [s], or waits for too long."""
        most = WAITING * self._limit
        if self._alarm:
            signal.setitimer(signal.ITIMER_REAL, most)
        begin, clock = _processor_time(), time.monotonic()
        try:
            yield
            used, waited = _processor_time() - begin, time.monotonic() - clock
        finally:
            if self._alarm:
                signal.setitimer(signal.ITIMER_REAL, 0.0)
        if used > limit or waited > most:
            self._give_up()
        if _leaves_programs():
            raise ControllerError("a program that it began runs on after a decision")

    def _give_up(self, *_: object) -> None:
        raise ControllerError(f"a decision took longer than {1e3 * self._limit:g} ms")


def _leaves_programs() -> bool:
    """Whether this worker has begun a program whose end it has not waited for."""
    if multiprocessing.parent_process() is None:
        return False  # no worker: who calls may have programs of its own
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return False
    return True


def _processor_time() -> float:
    """Processor time of this process and of those that it began and that have ended [s]."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + ended.ru_utime + ended.ru_stime


def run_episodes(draws: Sequence[tuple[Draw]], emit: Callable[[int, Any], None]) -> None:
    """Run episodes of one controller in one scene with one seed, in this process and in lockstep.

    Args:
        draws: What they are run from, each as the only argument of a task.
        emit: Takes the place of each and its row as it ends.
    """
    first = draws[0][0]
    config = tunnel_config(first.scene, first.controller, first.seed)
    places = {draw.trial: place for place, (draw,) in enumerate(draws)}
    needs: list[str] = []

    def take(item: tuple[TrialResult, Any]) -> None:
        place = places[item[0].trial]
        emit(place, _row_of(draws[place][0], item[0], " ".join(needs)))

    make = functools.partial(_timed, first.decision_limit, needs)
    run_trials(config, condition(first.controller, config.readings[0]), [*places], take, make=make)


def _timed(
    limit: float, needs: list[str], name: str, control: ControlParams, robot: RobotSpec, batch: int
) -> Controller:
    """The controller behind its limit; what it needs, and so is given, is put into `needs`."""
    made = Timed(make_controller(name, control, robot, batch), limit)
    needs[:] = needs_of(made)
    return made


def _row_of(draw: Draw, row: TrialResult, given: str) -> Episode:
    return Episode(
        *(draw.controller, draw.scene, draw.seed, draw.trial, row.outcome, row.time_s),
        limit_s=row.limit_s,
        progress_m=row.progress_m,
        overturned=row.overturned,
        void_decisions=row.void_decisions,
        given=given,
        drawn=draw.drawn,
        engine=versions()["mujoco"],
        processor=processor(),
        reason=row.reason,
    )


def lost(draw: Draw, reason: str) -> Episode:
    """The row of an episode whose process died, failed, or did not end."""
    config = tunnel_config(draw.scene, draw.controller, draw.seed)
    limit = time_limit_of(draw_scene(config, scene_of(config), draw.trial), config.time_limit)
    return Episode(
        *(draw.controller, draw.scene, draw.seed, draw.trial, "invalid", limit),
        limit_s=limit,
        drawn=draw.drawn,
        engine=versions()["mujoco"],
        processor=processor(),
        reason=reason,
    )


def restricted(rows: Iterable[Episode]) -> list[float]:
    """Time of each row as a share of its limit; 1 of a failure."""
    return [row.time_s / row.limit_s if row.outcome == "success" else 1.0 for row in rows]


def all_drawn(rows: Sequence[Episode]) -> bool:
    """Whether the seed of each row was drawn when its run began; False without rows."""
    return bool(rows) and all(row.drawn for row in rows)
