"""One robot in a scene as an environment of Gymnasium."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import Env
from gymnasium.error import ResetNeeded

from antennate.envs.episodes import Episodes
from antennate.envs.reward import REWARD_VERSION, TERMS
from antennate.envs.spaces import action_space, answers_of, observation_space
from antennate.envs.truth import ONE_EACH, OUTCOMES, Truth
from antennate.envs.vector import NotCopied, config_of, known_options, require_no_pictures, whole
from antennate.params.base import LARGEST_SEED
from antennate.sim.world import World


class AntennaEnv(NotCopied, Env[Any, Any]):
    """One robot in a scene.

    A seed s begins episode 0 of it, and each reset without a seed the next one;
    `options["episode_number"]` chooses another.

    Args:
        scene: Name of the scene.
        render_mode: None; there are no pictures.
        values: As of `EnvConfig`, and `action` for `interface.action`.
    """

    def __init__(self, scene: str = "tunnel", render_mode: None = None, **values: Any) -> None:
        require_no_pictures(render_mode)
        self.config = config_of(scene, values)
        self.metadata = {"render_modes": [], "reward_version": REWARD_VERSION}
        self.render_mode = render_mode
        self.observation_space = observation_space(self.config)
        self.action_space = action_space(self.config)
        self._episodes = Episodes(self.config, 1)
        self._every = np.ones(1, bool)
        self._seeded = False

    @property
    def world(self) -> World:
        """The world of the running episode: what only the simulation knows, and its engine."""
        if not self._episodes.running.all():
            raise ResetNeeded("expected a reset before the world of an episode")
        return self._episodes.world(0)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        chosen = known_options(options, ("episode_number",))
        super().reset(seed=None if seed is None else whole("seed", seed))
        if seed is None and not self._seeded:
            seed = int(self.np_random.integers(2**32, LARGEST_SEED))
        if seed is not None:
            self._episodes.seed(0, int(seed), 0, 1)
        self._seeded = True
        if (episode := chosen.get("episode_number")) is not None:
            self._episodes.choose(0, whole("episode_number", episode))
        observation, truth = self._episodes.begin(self._every)
        return observation[0], _info(truth)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Walk one decision."""
        if not self._episodes.running.all():
            raise ResetNeeded("expected a reset before a step")
        answers = answers_of(self.config, action, None)
        decision = self._episodes.step(answers, ~self._every, again=False)
        truth, ended = decision.truth, bool(decision.ended[0])
        cut = ended and OUTCOMES[truth.outcome[0]] == "timeout"
        reward = float(truth.terms[0].sum())
        return decision.observation[0], reward, ended and not cut, cut, _info(truth)


def _info(truth: Truth) -> dict[str, Any]:
    """The truth about the first row, and how its episode ended if it did."""
    info: dict[str, Any] = {name: getattr(truth, name)[0].item() for name in ONE_EACH}
    info["head"] = truth.head[0].copy()
    info |= {f"reward_{term.name}": float(truth.terms[0, i]) for i, term in enumerate(TERMS)}
    if truth.outcome[0] >= 0:
        info["outcome"] = OUTCOMES[truth.outcome[0]]
        info["reason"] = truth.reason.get(0, "")
    return info
