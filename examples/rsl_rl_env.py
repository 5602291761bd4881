"""The environments for rsl_rl, which has an interface of its own and resets within a step.

    runner = OnPolicyRunner(RslRlEnv("antennate/Tunnel-v1", num_envs=24), config)

Needs the extra `gym`, and rsl-rl-lib 5.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

import antennate.envs  # noqa: F401  registers them


class RslRlEnv(VecEnv):
    """A vector of robots; the observations are the group `policy`.

    Args:
        name: Id of the environment.
        num_envs: Number of robots B.
        seed: Seed of the episodes.
        values: As of `gym.make_vec`, a gait if they name no action; corridors need `time_limit`.

    Raises:
        ValueError: The action is no vector of numbers.
    """

    def __init__(self, name: str, num_envs: int, seed: int = 0, **values: Any) -> None:
        own = values.get("interface", {})
        action = {} if "action" in getattr(own, "model_fields_set", own) else {"action": "gait"}
        values = {**action, "autoreset_mode": "SAME_STEP", **values}
        self._envs: Any = gym.make_vec(name, num_envs=num_envs, **values)
        if not isinstance(self._envs.single_action_space, gym.spaces.Box):
            raise ValueError("expected the action gait or joints, which rsl_rl can answer")
        self.num_envs, self.device, self.cfg = num_envs, torch.device("cpu"), values
        self.num_actions = self._envs.single_action_space.shape[0]
        config = self._envs.config
        limit = (config.time_limit or 100.0) * config.control.rate / config.interface.ticks
        self.max_episode_length = round(limit)
        self.episode_length_buf = torch.zeros(num_envs, dtype=torch.long)
        self._observation, _ = self._envs.reset(seed=seed)

    def get_observations(self) -> TensorDict:
        """The newest observations."""
        return TensorDict({"policy": torch.from_numpy(self._observation)}, [self.num_envs])

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        """One decision; robots whose episode ended begin the next one."""
        answers = actions.detach().cpu().numpy().astype(np.float32)
        self._observation, reward, ended, cut, _ = self._envs.step(answers)
        over = torch.from_numpy(ended | cut)
        self.episode_length_buf = torch.where(over, 0, self.episode_length_buf + 1)
        extras = {"time_outs": torch.from_numpy(cut)}
        return self.get_observations(), torch.from_numpy(reward).float(), over.long(), extras
