"""A vector of robots in lockstep as an environment of Gymnasium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, SupportsIndex

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from antennate.control.policy.interface import PolicyInterface
from antennate.envs.config import EnvConfig
from antennate.envs.episodes import Episodes
from antennate.envs.reward import REWARD_VERSION, TERMS
from antennate.envs.spaces import action_space, answers_of, observation_space
from antennate.envs.truth import ONE_EACH, OUTCOMES, Truth
from antennate.errors import ConfigError
from antennate.messages import nearest, shown
from antennate.params.base import LARGEST_SEED, from_values
from antennate.types import Bools


class RenderModeError(ConfigError, TypeError):
    """There are no pictures. Stable-Baselines3 asks for some, and for none after a TypeError."""


class CopyError(ConfigError, TypeError):
    """There is no copy of an environment. It is a TypeError, as of all that cannot be pickled."""


class NotCopied:
    """An environment that has begun is neither copied nor pickled: its simulation would be lost."""

    _seeded = False

    def __copy__(self) -> Any:
        """Refuse: the copy would share its simulation."""
        raise _no_copy(self)

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> str | tuple[Any, ...]:
        """Be pickled or deeply copied before the first reset, and refuse it then."""
        if self._seeded:
            raise _no_copy(self)
        return super().__reduce_ex__(protocol)


def _no_copy(env: object) -> CopyError:
    return CopyError(
        f"{type(env).__name__}: expected no copy of a simulation, found one; make another "
        "environment by gymnasium.make with the same arguments, and begin the same episode by "
        "reset(seed=..., options={'episode_number': ...})"
    )


def config_of(scene: str, values: Mapping[str, Any]) -> EnvConfig:
    """The configuration of keyword arguments; `action` alone stands for `interface.action`."""
    values = dict(values)
    if "seed" in values:
        raise ConfigError("expected the seed in reset(seed=...), found it as an argument")
    if "action" in values:
        action, interface = values.pop("action"), values.get("interface", {})
        if isinstance(interface, PolicyInterface):
            interface = interface.model_dump(exclude_unset=True)
        if not isinstance(interface, Mapping):
            raise ConfigError(f"interface: expected values by name, found {shown(interface)}")
        if not np.array_equal(interface.get("action", action), action):
            raise ConfigError(
                f"action: expected one, found {shown(action)} and in interface "
                f"{shown(interface['action'])}"
            )
        values["interface"] = {**interface, "action": action}
    return from_values(EnvConfig, {"scene": scene, **values})


def require_no_pictures(render_mode: object) -> None:
    """Refuse a render mode."""
    if render_mode is not None:
        raise RenderModeError(
            f"render_mode: expected None, as environments draw nothing, found {render_mode!r}; "
            "`antennate tunnel --controllers FILE.onnx --video` makes a film"
        )


class AntennaVectorEnv(NotCopied, VectorEnv[Any, Any, Any]):
    """B robots in a scene, stepped in lockstep.

    Row i of an integer seed s plays the episodes i, i + B, i + 2 B ... of seed s; with a list of
    seeds it plays the episodes 0, 1, 2 ... of its own. Without a seed rows go on with their next
    ones. `options["episode_number"]`, shape (B,), chooses others.

    Args:
        num_envs: Number of robots B.
        scene: Name of the scene.
        autoreset_mode: When a row begins its next episode: as of Gymnasium, a member or its name.
        render_mode: None; there are no pictures.
        values: As of `EnvConfig`, and `action` for `interface.action`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        scene: str = "tunnel",
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: None = None,
        **values: Any,
    ) -> None:
        require_no_pictures(render_mode)
        self.config = config_of(scene, values)
        if whole("num_envs", num_envs) < 1:
            raise ConfigError(f"num_envs: expected at least 1, found {num_envs}")
        self.num_envs, self.render_mode = num_envs, render_mode
        self.autoreset_mode = _mode(autoreset_mode)
        self.metadata = {
            "render_modes": [],
            "reward_version": REWARD_VERSION,
            "autoreset_mode": self.autoreset_mode,
        }
        self.single_observation_space = observation_space(self.config)
        self.single_action_space = action_space(self.config)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._episodes = Episodes(self.config, num_envs)
        self._over: Bools = np.ones(num_envs, bool)
        self._seeded = False
        self._observation = np.zeros((num_envs, self._episodes.size), np.float32)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes in all rows, or in those of `options["reset_mask"]`, shape (B,)."""
        chosen = known_options(options, ("reset_mask", "episode_number"))
        rows = _mask(chosen.get("reset_mask"), self.num_envs)
        self._seed(seed, chosen.get("episode_number"), rows)
        observation, truth = self._episodes.begin(rows)
        self._over &= ~rows
        self._observation = np.where(rows[:, None], observation, self._observation)
        return self._observation.copy(), _infos(truth, rows, np.zeros(self.num_envs, bool))

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Walk one decision of all rows."""
        fresh = self._over
        if not self._seeded or (fresh.any() and self.autoreset_mode is AutoresetMode.DISABLED):
            raise ResetNeeded(f"expected a reset of rows {np.flatnonzero(fresh)} before a step")
        answers = answers_of(self.config, actions, self.num_envs)
        again = self.autoreset_mode is AutoresetMode.SAME_STEP
        decision = self._episodes.step(answers, fresh, again)
        truth, ended = decision.truth, decision.ended
        self._over = ended & ~decision.begun
        self._observation = decision.observation
        cut = ended & (truth.outcome == OUTCOMES.index("timeout"))
        rows = np.ones(self.num_envs, bool)
        infos = _infos(decision.start, rows, ended & ~decision.begun)
        if again and ended.any():
            infos["final_obs"] = np.full(self.num_envs, None, dtype=object)
            for row in np.flatnonzero(ended).tolist():
                infos["final_obs"][row] = decision.last[row].copy()
            infos["_final_obs"] = ended.copy()
            infos["final_info"] = _infos(truth, ended, ended)
            infos["_final_info"] = ended.copy()
        reward = truth.terms.sum(axis=1)
        return decision.observation.copy(), reward, ended & ~cut, cut, infos

    def _seed_by_chance(self, seed: Any) -> None:
        """Give every row episodes of a seed of its own, unless one seed is given or was."""
        if not self._seeded and not isinstance(seed, int | np.integer):
            chance = int(self.np_random.integers(2**32, LARGEST_SEED))
            for row in range(self.num_envs):
                self._episodes.seed(row, chance, row, self.num_envs)

    def _seed(self, seed: Any, episode: Any, rows: Bools) -> None:
        """Say which episodes some rows begin; a first seed is that of the others, too."""
        count = self.num_envs
        self._seed_by_chance(seed)
        if isinstance(seed, int | np.integer):
            number = whole("seed", seed)
            self._np_random, self._np_random_seed = np.random.default_rng(number), number
            for row in np.flatnonzero(rows | (not self._seeded)).tolist():
                self._episodes.seed(row, number, row, count)
        elif seed is not None:
            seeds = _each("seed", seed, count)
            for row in np.flatnonzero(rows).tolist():
                if seeds[row] is not None:
                    self._episodes.seed(row, whole("seed", seeds[row]), 0, 1)
        if episode is not None:
            numbers = episode if _is_list(episode) else [episode] * count
            numbers = _each("episode_number", numbers, count)
            for row in np.flatnonzero(rows).tolist():
                self._episodes.choose(row, whole("episode_number", numbers[row]))
        self._seeded = True


def _each(name: str, values: Any, count: int) -> list[Any]:
    """A value for each row."""
    if not _is_list(values):
        raise ConfigError(
            f"{name}: expected a whole number, or {count} of them, found {shown(values)}"
        )
    if len(values) != count:
        raise ConfigError(f"{name}: expected {count} of them, found {len(values)}")
    return list(values)


def _is_list(values: Any) -> bool:
    array = isinstance(values, np.ndarray) and values.ndim > 0
    return array or (isinstance(values, Sequence) and not isinstance(values, str))


def known_options(options: Mapping[str, Any] | None, names: Sequence[str]) -> Mapping[str, Any]:
    """The options of a reset."""
    if not isinstance(options, Mapping | None):
        raise ConfigError(f"options: expected values by name, found {shown(options)}")
    for name in options or {}:
        if name not in names:
            raise ConfigError(
                f"options: expected {' or '.join(names)}, found {shown(name)}"
                f"{nearest(str(name), names)}"
            )
    return options or {}


def whole(name: str, value: Any) -> int:
    """A seed or the number of an episode."""
    is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not is_whole or not 0 <= value <= LARGEST_SEED:
        raise ConfigError(
            f"{name}: expected a whole number of 0 to {LARGEST_SEED}, found {shown(value)}"
        )
    return int(value)


def _mode(name: AutoresetMode | str) -> AutoresetMode:
    """The autoreset mode of a member, its name or its value."""
    if isinstance(name, AutoresetMode):
        return name
    for mode in AutoresetMode:
        if name in (mode.name, mode.value):
            return mode
    names = [mode.name for mode in AutoresetMode]
    raise ConfigError(
        f"autoreset_mode: expected one of {', '.join(names)}, found {shown(name)}"
        f"{nearest(str(name), names)}"
    )


def _mask(mask: Any, batch: int) -> Bools:
    """Rows to begin: all without a mask."""
    if mask is None:
        return np.ones(batch, bool)
    mask = np.asarray(mask)
    if mask.shape != (batch,) or mask.dtype != np.bool_ or not mask.any():
        raise ConfigError(
            f"reset_mask: expected {batch} booleans, one True at least, found "
            f"{shown(mask.tolist())}"
        )
    return mask.copy()


def _infos(truth: Truth, rows: Bools, ended: Bools) -> dict[str, Any]:
    """The truth about some rows as infos of a vector: arrays, and masks of what they hold."""
    infos: dict[str, Any] = {name: getattr(truth, name).copy() for name in ("head", *ONE_EACH)}
    infos |= {f"reward_{term.name}": truth.terms[:, i].copy() for i, term in enumerate(TERMS)}
    infos |= {f"_{name}": rows.copy() for name in [*infos]}
    if ended.any():
        infos["outcome"] = np.full(len(rows), None, dtype=object)
        infos["reason"] = np.full(len(rows), None, dtype=object)
        for row in np.flatnonzero(ended).tolist():
            infos["outcome"][row] = OUTCOMES[truth.outcome[row]]
            infos["reason"][row] = truth.reason.get(row, "")
        infos["_outcome"], infos["_reason"] = ended.copy(), ended.copy()
    return infos
