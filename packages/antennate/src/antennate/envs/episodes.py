"""Episodes of B robots in lockstep: trials of a scene, walked one decision after the other.

An episode follows from its seed and number alone, as a trial of `antennate tunnel` does; the
readings, the looks that end it and the physics are the same, so it is the same trial.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from antennate.antenna import sensor
from antennate.control.policy.actors import make_actor
from antennate.control.policy.observer import Observer, Vector
from antennate.control.readings import make_readings
from antennate.envs.config import EnvConfig, Randomisation, varied
from antennate.envs.reward import terms_of
from antennate.envs.truth import OUTCOMES, Truth, replace_rows
from antennate.errors import SceneError
from antennate.sim.episode import Episode
from antennate.sim.knowledge import mean_direction, route_of, side_ahead
from antennate.sim.scenes.scene import Scene
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import Trial, draw_trial, require_room, scene_of
from antennate.sim.world import World
from antennate.types import AntennaFrame, Bools, Floats, Ints

_MOST_SKIPPED = 100
"""Episodes in a row without room for the robot, after which a scene is given up."""


@dataclass(slots=True)
class Decision:
    """What came of one decision.

    Attributes:
        observation: Newest observations, shape (B, n); of an episode that ended here its last one,
            unless another has begun in its row.
        truth: What only the simulation knows at the end of the decision.
        ended: Rows whose episode ended, shape (B,).
        begun: Rows in which another episode begins with this observation, shape (B,).
        last: Last observations of the episodes that ended, shape (B, n).
        start: Truth of the episodes that begin, else as `truth`.
    """

    observation: Vector
    truth: Truth
    ended: Bools
    begun: Bools
    last: Vector
    start: Truth


class Episodes:
    """B robots in episodes of a scene.

    Args:
        config: What decides them.
        batch: Number of robots B.

    Attributes:
        size: Numbers of an observation.
        running: Rows that hold an episode, shape (B,).
    """

    def __init__(self, config: EnvConfig, batch: int) -> None:
        self.config, self._batch = config, batch
        control, robot = config.control, config.robot
        self._scene = scene_of(config)
        self._body = SimRobot(batch, robot, control.period, config.physics.timestep)
        self._actor = make_actor(config.interface, control, robot, batch)
        self._observer = Observer(config.interface, control, robot, batch)
        self._readings = make_readings(config.readings, control, batch)
        self._episodes: dict[int, Episode] = {}
        self._seeds: Ints = np.zeros(batch, np.int64)
        self._next: Ints = np.arange(batch)
        self._stride: Ints = np.full(batch, batch)
        self._gains, self._offsets = np.ones((batch, 2)), np.zeros((batch, 2))
        self._straight = float(sensor.counts(robot.antenna.sensor, np.zeros(1))[0])
        self._affine = config.randomise.sensor_gain != (1.0, 1.0)
        self._affine |= config.randomise.sensor_offset != (0.0, 0.0)
        self._ticks, self._most = 0, config.max_episode_steps
        self._routes: dict[int, Floats | None] = {}
        self._headings: dict[int, list[float]] = {}
        frequency = config.interface.fastest_gait(control.gait.frequency) or control.gait.frequency
        decision = control.period * config.interface.ticks
        self._looks = max(1, round(1.0 / (frequency * decision)))
        self.size = self._observer.size

    @property
    def running(self) -> Bools:
        """Rows that hold an episode, shape (B,)."""
        rows = np.zeros(self._batch, dtype=bool)
        rows[[*self._episodes]] = True
        return rows

    def world(self, row: int) -> World:
        """The world of the episode in a row."""
        return self._body.world(row)

    def seed(self, row: int, seed: int, number: int, stride: int) -> None:
        """Choose the next episode of a row; the numbers of those after it are a stride apart."""
        self._seeds[row], self._next[row], self._stride[row] = seed, number, stride

    def choose(self, row: int, number: int) -> None:
        """The next episode of a row has this number."""
        self._next[row] = number

    def begin(self, rows: Bools) -> tuple[Vector, Truth]:
        """Begin the next episodes of some rows, shape (B,); the others stand still meanwhile.

        Returns:
            Observations, shape (B, n), and the truth; both only of the rows that begin.
        """
        self._load(rows)
        some = rows if (~rows & self.running).any() else None
        self._observer.feel(self._given(self._body.read(some)), some)
        return self._observer.look(self._actor, rows), self._begun(rows)

    def step(self, answers: Floats, fresh: Bools, again: bool) -> Decision:
        """Walk one decision.

        Args:
            answers: Of the table of actions, shape (B, k).
            fresh: Rows that begin their next episode in this decision; their answer is not read.
            again: Whether a row whose episode ends here begins its next one at once.
        """
        running, period = self.running, self.config.control.period
        ended, begun = np.zeros((2, self._batch), bool)
        last = np.zeros((self._batch, self.size), np.float32)
        truth = Truth.empty(self._batch)
        self._actor.decide(answers, running)
        for tick in range(1, self.config.interface.ticks + 1):
            whole = tick == self.config.interface.ticks
            command = self._actor.step(self._observer.unknown)
            self._body.write(command)
            self._observer.told(command)
            self._ticks += 1
            over = self._judge(truth, whole)
            if over.any():
                last[over] = self._observer.look(self._actor, over)[over]
                ended |= over
            if whole:
                begun = fresh | (ended & again)
                self._load(begun)
            self._body.sleep_until(self._ticks * period)
            self._observer.feel(self._given(self._body.read()))
        observation = self._observer.look(self._actor)
        stays = ended & ~begun
        observation[stays] = last[stays]
        self._note(truth, np.flatnonzero(running & ~ended).tolist())
        start = replace_rows(truth, self._begun(begun), begun) if begun.any() else truth
        return Decision(observation, truth, ended, begun, last, start)

    def _given(self, frame: AntennaFrame) -> AntennaFrame:
        """What the policy is given of a frame."""
        if self._affine:
            change = self._gains * (frame.counts - self._straight) + self._offsets
            counts = np.clip(np.rint(self._straight + change), 0.0, sensor.FULL_SCALE)
            frame = replace(frame, counts=counts)
        return self._readings.change(frame)

    def _load(self, rows: Bools) -> None:
        """Put the next episode into some rows."""
        for row in np.flatnonzero(rows).tolist():
            one, phase = np.array([row]), self._draw(row)
            self._actor.reset(one, phase)
            self._observer.reset(one)
            self._readings.reset(one)

    def _draw(self, row: int) -> float:
        """Put the next episode with room for the robot into a row; its gait phase [rad]."""
        trouble: SceneError | None = None
        for _ in range(_MOST_SKIPPED):
            seed, number = int(self._seeds[row]), int(self._next[row])
            self._next[row] += self._stride[row]
            try:
                trial, gains, offsets = draw_episode(self.config, self._scene, seed, number)
                require_room(trial.world)
                episode = trial.episode(self.config.time_limit, on_its_back=True)
                episode.progress_of(trial.world.head[:2])
                route = route_of(episode.scene)
            except SceneError as error:
                trouble = error
                continue
            self._body.load(row, trial.world, trial.chance)
            self._gains[row], self._offsets[row] = gains, offsets
            self._episodes[row] = episode
            self._routes[row], self._headings[row] = route, []
            return trial.phase
        raise SceneError(
            f"expected an episode that can begin, found {_MOST_SKIPPED} that cannot: {trouble}"
        )

    def _judge(self, truth: Truth, whole: bool) -> Bools:
        """End the episodes that are over at this tick; their rows, shape (B,)."""
        over, failures = np.zeros(self._batch, bool), self._body.failures
        for row, episode in self._episodes.items():
            episode.tick(self._body.world(row), failures.get(row))
            if whole and episode.outcome is None and self._decisions(episode) == self._most:
                episode.outcome = "timeout"
            over[row] = episode.outcome is not None
        for row in np.flatnonzero(over).tolist():
            self._end(row, truth)
        return over

    def _decisions(self, episode: Episode) -> int:
        """Decisions of an episode so far, that which goes on among them."""
        return math.ceil(episode.ticks / self.config.interface.ticks)

    def _end(self, row: int, truth: Truth) -> None:
        """Note how the episode of a row ended, and empty the row."""
        episode = self._episodes[row]
        truth.outcome[row] = OUTCOMES.index(episode.outcome)
        if episode.reason:
            truth.reason[row] = episode.reason
        self._note(truth, [row])
        del self._episodes[row]
        self._body.unload(row)

    def _note(self, truth: Truth, rows: Iterable[int], begins: bool = False) -> None:
        """Write the truth about some rows; of those that begin without a reward."""
        for row in rows:
            episode, world = self._episodes[row], self._body.world(row)
            scene, head = episode.scene, world.head[:2].copy()
            truth.seed[row], truth.episode_number[row] = episode.seed, episode.number
            truth.t[row], truth.length[row] = world.t, scene.length
            truth.head[row, :2], truth.head[row, 2] = head, world.heading
            truth.force[row] = world.obstacle_force()
            truth.maneuver[row] = self._actor.maneuver[row]
            if truth.outcome[row] != OUTCOMES.index("invalid"):
                self._headings[row] = [*self._headings[row], world.heading][-self._looks :]
                if (route := self._routes[row]) is not None:
                    truth.side[row] = side_ahead(route, head, mean_direction(self._headings[row]))
                before, progress = episode.progress, episode.progress_of(head)
                if not begins:
                    out = truth.outcome[row] == OUTCOMES.index("success")
                    gain = progress - before
                    failed = not out and truth.outcome[row] >= 0
                    remaining = self._remaining(episode, world.t) if failed else 0
                    truth.terms[row] = terms_of(scene, gain, head, out, remaining)
            truth.progress[row] = episode.progress

    def _remaining(self, episode: Episode, t: float) -> int:
        """Whole decisions that remain at time t [s] until the limit of an episode."""
        seconds = self.config.interface.ticks * self.config.control.period
        remaining = math.floor((episode.limit - t) / seconds + 1e-6)
        if self._most is not None:
            remaining = min(remaining, self._most - self._decisions(episode))
        return max(0, remaining)

    def _begun(self, rows: Bools) -> Truth:
        """The truth about rows that have just begun."""
        truth = Truth.empty(self._batch)
        self._note(truth, np.flatnonzero(rows).tolist(), begins=True)
        return truth


def draw_episode(
    config: EnvConfig, scene: Scene, seed: int, number: int
) -> tuple[Trial, Floats, Floats]:
    """An episode at its start; gains and offsets [counts] of its antennae, shapes (2,).

    Without randomisation it is the trial of this number of `antennate tunnel` with this seed.
    """
    chance = np.random.default_rng(np.random.SeedSequence([seed, number], spawn_key=(3,)))
    drawn = config.randomise.draw(chance)
    robot = config.robot
    if config.randomise != Randomisation():
        robot = varied(robot, drawn)
    own = config.model_copy(update={"seed": seed, "robot": robot})
    gait, period = config.control.gait, config.control.period
    trial = draw_trial(own, scene, number, gait, period)
    return trial, drawn["sensor_gain"], drawn["sensor_offset"]
