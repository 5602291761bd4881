"""An episode: one robot in one drawn scene, from its start until its judge says how it ended.

It follows from a seed and a number, and a controller moves the robot. In `tunnel`, `climb` and
`compete` it is a trial, a row of the table; other experiments have trials of another kind, as a
push or a passage. `Trial.episode` of `sim/trial.py` makes it; the twin makes its own, without a
time limit. Who lets time pass tells it of every control tick, and stops when it has ended:
`experiments/tunnel/lockstep.py` for many trials at once, climbs among them, `envs/episodes.py` and
`studies/simulate.py`; the robot of the twin walks on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from numbers import Real
from typing import Any, Literal, Protocol

import numpy as np

from antennate.errors import SceneError, raised
from antennate.messages import shortened
from antennate.sim.scenes.geometry import crossing
from antennate.sim.scenes.scene import TIME_LIMIT, SceneInstance
from antennate.types import Floats

Outcome = Literal["success", "timeout", "left", "overturned", "fell", "invalid"]
"""How a trial ends. The judge says all but `invalid`: the physics, the controller or the scene
failed, or the worker process died. An environment says `timeout` also after its most steps."""
LOOK_EVERY = 10
"""Ticks between two looks at a trial: 10 Hz at the usual rate."""
FALL = 0.175
"""How far below the ground at the start a link has to be to have fallen [m] (assumed: half the
depth of a gap; robots walk down steps of 15 cm, docs/science/climb.md)."""


class Walker(Protocol):
    """A robot in its scene, on the CPU or in a batch on a device."""

    @property
    def t(self) -> float:
        """Time since its start [s]."""
        ...

    @property
    def head(self) -> Floats:
        """Position of the tip of the head [m], first x and y."""
        ...

    @property
    def overturned(self) -> bool:
        """Whether the undersides of most links point up."""
        ...

    def link_places(self) -> Floats:
        """Positions of the links, head first [m], shape (L, 3)."""
        ...


class Episode:
    """One robot in one drawn scene, until it has ended.

    The robot is looked at in every LOOK_EVERY-th tick, and from the time limit on in each. A scene
    with `ground` ends it for a robot on its back. In other scenes `tunnel`, `compete` and
    `simulate` let such a robot lie until the time limit; environments end its episode by
    `on_its_back`, and `climb` by a criterion of its own.

    Args:
        scene: The scene as it was drawn.
        limit: Time after which the episode has failed [s]; None for that of the scene.
        on_its_back: Whether a robot on its back ends it in any scene.
        seed: Seed of all chance.
        number: Number of the draw.

    Attributes:
        scene, seed, number: As given.
        limit: Time after which it has failed [s].
        judge: Says how it ends.
        ticks: Control ticks so far.
        progress: How far the head had come when that was last asked [m].
        outcome: How it ended, an `Outcome`, or what `look` of `tick` returned, as in
            `climb`; None while it goes on.
        reason: Why it is invalid, empty unless it is.
        error: What the scene did not answer; None if it did.
    """

    def __init__(
        self,
        scene: SceneInstance,
        limit: float | None = None,
        on_its_back: bool = False,
        seed: int = 0,
        number: int = 0,
    ) -> None:
        self.scene, self.seed, self.number = scene, seed, number
        self.limit = time_limit_of(scene, limit)
        self.judge = Judge(scene, self.limit, on_its_back)
        self.ticks, self.progress = 0, 0.0
        self.outcome: Any = None
        self.reason = ""
        self.error: SceneError | None = None

    def tick(
        self,
        world: Walker,
        failure: object = None,
        look: Callable[[Any], Any] | None = None,
    ) -> Any:
        """Let a control tick pass; the outcome, None if the episode goes on.

        It is invalid after a failure, and where the scene does not answer as its protocol says.

        Args:
            world: The robot.
            failure: What went wrong with it, as the physics; None if nothing did.
            look: Looks at the world in place of the judge, and returns the outcome or None.
        """
        self.ticks += 1
        if failure is not None:
            return self.fail(failure)
        if self.ticks % LOOK_EVERY and world.t < self.limit:
            return None
        try:
            self.outcome = (look or self.judge.watch)(world)
        except SceneError as error:
            self.error = error
            return self.fail(error)
        return self.outcome

    def fail(self, reason: object) -> Any:
        """End it as invalid, for a reason; the outcome."""
        self.outcome, self.reason = "invalid", str(reason)
        return self.outcome

    def progress_of(self, head: Floats) -> float:
        """How far a head at this position, shape (2,), has come [m]; kept as `progress`."""
        self.progress = progress_of(self.scene, head)
        return self.progress


class Judge:
    """Judge of one episode: says how it ends, from one look at the robot to the next.

    The head succeeds when it has crossed the exit between its ends more often outwards than
    inwards. A scene with a rule of its own, `succeeded(head)`, is asked instead. In a scene
    that has `ground` a robot on its back ends the episode, and so does a fall.

    Args:
        scene: The scene of the episode.
        limit: Time after which it has failed [s].
        on_its_back: Whether a robot on its back ends it in scenes without `ground`, too.

    Attributes:
        limit: As given.
    """

    def __init__(
        self, scene: SceneInstance, limit: float = math.inf, on_its_back: bool = False
    ) -> None:
        self._scene, self.limit, self._on_its_back = scene, limit, on_its_back
        self._head: Floats = np.array(scene.start[:2], float)
        self._crossings = 0

    def watch(self, world: Walker) -> Outcome | None:
        """How the episode has ended with the robot as it is now; None if it goes on."""
        seen = self.look(world.head[:2]) or self._mishap(world)
        return in_time(seen, world.t, self.limit)

    def look(self, head: Floats) -> Literal["success", "left"] | None:
        """How the episode ended with the head at this position, shape (2,); None if it goes on."""
        if self._succeeded(head):
            return "success"
        return "left" if _answer(self._scene, "left", head, "True or False", _is_bool) else None

    def _succeeded(self, head: Floats) -> bool:
        if hasattr(self._scene, "succeeded"):
            return bool(_answer(self._scene, "succeeded", head, "True or False", _is_bool))
        before, self._head = self._head, head.copy()
        self._crossings += crossing(_exit_of(self._scene), before, head)
        return self._crossings > 0

    def _mishap(self, world: Walker) -> Literal["overturned", "fell"] | None:
        """A robot on its back, or a fall."""
        ground = getattr(self._scene, "ground", None)
        if world.overturned and (self._on_its_back or ground is not None):
            return "overturned"
        fell = ground is not None and has_fallen(world.link_places(), float(ground))
        return "fell" if fell else None


def time_limit_of(scene: SceneInstance, wanted: float | None) -> float:
    """Time after which a trial has failed [s]: the one that is wanted, or else the scene's own."""
    if wanted is not None:
        return wanted
    limit = getattr(scene, "time_limit", TIME_LIMIT)
    if not _is_finite(limit) or limit <= 0:
        raise SceneError(
            f"scene: expected time_limit to be a time above 0 s, found {shortened(repr(limit))}"
        )
    return float(limit)


def in_time(outcome: Any, t: float, limit: float, late: Any = "timeout") -> Any:
    """How a trial ends at time t [s], where a look at it says `outcome`; None if it goes on.

    An outcome counts up to the limit [s], with t rounded to µs as tables have it. After the limit,
    and from it on without an outcome, the trial ends as `late`.
    """
    if outcome is not None:
        return outcome if round(t, 6) <= limit else late
    return late if t >= limit else None


def require_times(time: float, limit: float, close: float = 0.0) -> None:
    """Check a time and a time limit of a table; the time may exceed the limit by `close` [s]."""
    if not 0.0 < limit < math.inf:
        raise ValueError(f"limit_s: expected a finite number above 0, found {limit}")
    if not 0.0 <= time <= limit + close:
        raise ValueError(
            f"time_s: expected a finite number of 0 to limit_s, {limit:g}, found {time}"
        )


def has_fallen(links: Floats, ground: float) -> bool:
    """Whether the centre of any link is lower than the ground at the start by more than FALL.

    Args:
        links: Places of the links [m], shape (L, 3).
        ground: Height of that ground [m].
    """
    return bool(links[:, 2].min() < ground - FALL)


def progress_of(scene: SceneInstance, head: Floats) -> float:
    """What a scene says of how far a head at this position, shape (2,), has come [m]."""
    return _answer(scene, "progress", head, "a finite number [m]", _is_finite)


def _exit_of(scene: SceneInstance) -> Floats:
    try:
        line = np.asarray(scene.exit, float)
    except Exception as error:
        raise SceneError(f"scene: exit raised {raised(error)}") from error
    if line.shape != (2, 2) or not np.isfinite(line).all():
        raise SceneError(
            "scene: expected exit to be two points, finite, shape (2, 2) [m], found "
            f"{shortened(repr(line.tolist()))}"
        )
    return line


def _answer(
    scene: SceneInstance, name: str, head: Floats, wanted: str, fits: Callable[[Any], bool]
) -> Any:
    try:
        answer = getattr(scene, name)(head.copy())
    except Exception as error:
        raise SceneError(f"scene: {name} raised {raised(error)}") from error
    if not fits(answer):
        raise SceneError(
            f"scene: expected {name} to return {wanted}, found {shortened(repr(answer))}"
        )
    return answer


def _is_finite(value: Any) -> bool:
    return isinstance(value, Real) and math.isfinite(value)


def _is_bool(value: Any) -> bool:
    return isinstance(value, bool | np.bool_)
