"""Spaces of Gymnasium, made of the tables of an interface, and answers of their actions."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import Space
from gymnasium.spaces import Box, Discrete

from antennate.control.policy.interface import CHOICES, actions, bounds, observations
from antennate.envs.config import EnvConfig
from antennate.errors import ConfigError
from antennate.messages import shown
from antennate.types import Floats


def observation_space(config: EnvConfig) -> Box:
    """The space of one observation."""
    quantities = observations(config.interface, config.control, config.robot)
    low, high = bounds(quantities)
    return Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


def action_space(config: EnvConfig) -> Space[Any]:
    """The space of one action: a number for a maneuver, else numbers from -1 to 1."""
    if config.interface.action == "maneuver":
        return Discrete(len(CHOICES))
    size = len(actions(config.interface, config.robot))
    return Box(-1.0, 1.0, (size,), np.float32)


def answers_of(config: EnvConfig, given: Any, batch: int | None) -> Floats:
    """The answers that actions stand for, shape (B, k): of a batch, or of one robot if it is None.

    NaN is HOLD.
    """
    try:
        given = np.asarray(given)
    except ValueError:  # lists of several lengths
        raise ConfigError(f"action: expected numbers of one shape, found {shown(given)}") from None
    rows = () if batch is None else (batch,)
    if config.interface.action == "maneuver":
        if given.shape != rows or given.dtype.kind not in "iu":
            what = "a whole number" if batch is None else f"whole numbers of shape ({batch},)"
            raise _refused(what, given)
        if given.min() < 0 or given.max() >= len(CHOICES):
            raise _refused(f"maneuvers of 0 to {len(CHOICES) - 1}", given)
        return np.eye(len(CHOICES))[np.atleast_1d(given)]
    shape = (*rows, len(actions(config.interface, config.robot)))
    if given.shape != shape or given.dtype.kind not in "fiu":
        raise _refused(f"real numbers of shape {shape}", given)
    return np.atleast_2d(given).astype(float)


def _refused(expected: str, given: np.ndarray) -> ConfigError:
    return ConfigError(
        f"action: expected {expected}, found {shown(given.tolist())} of shape {given.shape}"
    )
