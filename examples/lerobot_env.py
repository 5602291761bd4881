"""An environment for LeRobot's EnvHub: publish this file as env.py, or load it from a folder.

The observation is LeRobot's state, the action a gait. Needs the extra `gym`.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym

import antennate.envs  # noqa: F401  registers them

NAME = "antennate/Tunnel-v1"
TASK = "Walk through the tunnel by touch."


class Walk(gym.Wrapper):
    """One robot as LeRobot asks for it: the state by name, a task in words, success in `info`."""

    def __init__(self, name: str = NAME) -> None:
        super().__init__(gym.make(name, action="gait"))
        self.observation_space = gym.spaces.Dict({"agent_pos": self.env.observation_space})
        config = self.env.unwrapped.config
        fps = config.control.rate / config.interface.ticks
        self.metadata = {"render_modes": [], "render_fps": fps}
        self.task = self.task_description = TASK
        self._max_episode_steps = round((config.time_limit or 100.0) * fps)

    def reset(self, **words: Any) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        observation, info = self.env.reset(**words)
        return {"agent_pos": observation}, info | {"is_success": False}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Walk one decision."""
        observation, reward, ended, cut, info = self.env.step(action)
        success = info.get("outcome") == "success"
        return {"agent_pos": observation}, reward, ended, cut, info | {"is_success": success}


def make_env(n_envs: int = 1, use_async_envs: bool = False) -> gym.vector.VectorEnv:
    """What LeRobot calls."""
    kind = gym.vector.AsyncVectorEnv if use_async_envs else gym.vector.SyncVectorEnv
    return kind([Walk] * n_envs, autoreset_mode=gym.vector.AutoresetMode.SAME_STEP)
