"""An episode: one robot in one drawn scene, from its start until its judge says how it ended.

It follows from a seed and a number, and a controller moves the robot. In `tunnel`, `climb` and
`compete` it is a trial, a row of the table; other experiments have trials of another kind, as a
push or a passage. `Trial.episode` makes it. Who lets time pass tells it of every control tick, and
stops when it has ended: `experiments/tunnel/lockstep.py` for many trials at once, climbs among
them, `envs/episodes.py` and `studies/simulate.py`; the robot of the twin walks on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from antennate.errors import SceneError
from antennate.sim.judge import LOOK_EVERY, Judge, Walker, progress_of, time_limit_of
from antennate.sim.scenes.scene import SceneInstance
from antennate.types import Floats


class Episode:
    """One robot in one drawn scene, until it has ended.

    The robot is looked at in every LOOK_EVERY-th tick, and from the time limit on in each. A scene
    with `ground` ends it for a robot on its back. Elsewhere trials of tables let such a robot lie
    until the time limit, and environments end its episode: `on_its_back`.

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
        outcome: How it ended, an `Outcome` unless another judge was asked; None while it goes on.
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
