"""How far a twin has come in its scene."""

from __future__ import annotations

import math
from collections.abc import Callable

from antennate.sim.scenes.scene import SceneInstance
from antennate.sim.trial import LOOK_EVERY, Judge, progress_of
from antennate.sim.world import World


class Passage:
    """Follows the head through a scene.

    Args:
        scene: Where the robot walks.

    Attributes:
        progress: How far the head has come [m].
        passed: Time of walking at which the head passed the exit [s], inf before.
        on_pass: Called when it does.
        on_tick: Called with the world after every tick.
    """

    def __init__(self, scene: SceneInstance) -> None:
        self._scene = scene
        self.on_pass: Callable[[], None] = lambda: None
        self.on_tick: Callable[[World], None] = lambda world: None
        self.reset()

    def reset(self) -> None:
        """The robot stands at the start again."""
        self._ticks, self._judge = 0, Judge(self._scene)
        self.progress = 0.0
        self.passed = math.inf

    def watch(self, world: World) -> None:
        """Look at the world after a tick.

        Raises:
            SceneError: The scene does not answer as its protocol says.
        """
        self.on_tick(world)
        self._ticks += 1
        if self._ticks % LOOK_EVERY:
            return
        head = world.head[:2]
        self.progress = progress_of(self._scene, head)
        if self.passed == math.inf and self._judge.look(head) == "success":
            self.passed = world.t
            self.on_pass()

    @property
    def summary(self) -> str:
        """The same in one sentence."""
        length = self._scene.length
        if self.passed < math.inf:
            return f"the head passed the exit after {self.passed:.1f} s of walking"
        return f"the head came {min(self.progress, length):.2f} m of {length:.2f} m"
