"""A scene or a controller with other parameters, as text: `uturn+variation.reading_noise=3`.

Behind the name stands for each parameter a +, its dotted name, = and its value, as in a TOML file;
text needs no quotes, and `robot=FILE` is another robot. Numbers of the control belong to the
controller, `closed+search.patience=4`, all others to the scene: a controller with other numbers is
another controller.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from typing import Any

from antennate.control.readings import YOKED, short_names
from antennate.control.registry import unread
from antennate.errors import ConfigError
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.messages import shown
from antennate.params.base import from_values
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.sim.episode import time_limit_of
from antennate.sim.trial import draw_scene, scene_of
from antennate_lab.compete.config import PART, plain

_GROUPS = (
    *("tunnel", "corridors", "ground", "robot", "variation", "physics"),
    *("readings", "time_limit"),
)
"""What may be set: fields of `TunnelConfig`."""


def tunnel_config(text: str, controller: str, seed: int) -> TunnelConfig:
    """The run of one controller in such a scene."""
    scene, *parts = PART.split(text)
    name, *numbers = PART.split(controller)
    values: dict[str, Any] = {"scene": scene, "seed": seed, "controllers": (name,)}
    for part in parts:
        path, _, value = part.partition("=")
        if path.partition(".")[0] not in _GROUPS:
            raise ConfigError(
                f"scenes: expected a parameter of {', '.join(_GROUPS)}, found {shown(path)} in "
                f"{shown(text)}"
            )
        _put(values, path, _value(value), "scenes", text)
    if numbers:
        values["control"] = _control(name, numbers, controller)
    if "readings" in values:
        values["readings"] = (values["readings"],)
        if values["readings"] == (YOKED,):
            raise ConfigError(f"scenes: expected readings of its own, found {shown(text)}")
    try:
        if isinstance(robot := values.get("robot"), str):
            values["robot"] = RobotSpec.named(robot)
        return from_values(TunnelConfig, values)
    except ConfigError as error:
        raise ConfigError(f"scenes: {shown(text)}: {error}") from None


def _control(name: str, numbers: Sequence[str], text: str) -> ControlParams:
    """The control of a controller with these numbers, each of which it reads."""
    values: dict[str, Any] = {}
    for part in numbers:
        path, _, value = part.partition("=")
        _put(values, path, _value(value), "controllers", text)
    try:
        control = from_values(ControlParams, values)
    except ConfigError as error:
        raise ConfigError(f"controllers: {shown(text)}: {error}") from None
    for part in numbers:
        if (path := part.partition("=")[0]) in unread(name, control):
            raise ConfigError(f"controllers: {shown(text)}: {name} does not read {path}")
    return control


def _put(values: dict[str, Any], path: str, value: Any, what: str, text: str) -> None:
    """Set a value at its dotted path."""
    *groups, name = path.split(".")
    place: Any = values
    for group in groups:
        place = place.setdefault(group, {}) if isinstance(place, dict) else None
    if not isinstance(place, dict) or name in place:
        raise ConfigError(
            f"{what}: expected each parameter once, as a group or as a value, found {shown(path)} "
            f"again in {shown(text)}"
        )
    place[name] = value


def require_different_scenes(texts: Iterable[str], controller: str) -> None:
    """Check that no two texts are the same scene with the same parameters.

    Args:
        texts: The scenes.
        controller: One that runs in all of them.
    """
    seen: dict[str, str] = {}
    for text in texts:
        config = tunnel_config(text, controller, 0)
        limit = time_limit_of(draw_scene(config, scene_of(config), 0), config.time_limit)
        key = config.model_copy(update={"time_limit": limit}).model_dump_json()
        if (other := seen.setdefault(key, text)) != text:
            raise ConfigError(
                f"scenes: expected different ones, found {shown(other)} and {shown(text)}, which "
                "are the same"
            )


def _value(text: str) -> Any:
    """A value as TOML has it, else the text itself."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):  # no TOML, a number that is too long, or too deep
        return text


def label(text: str) -> str:
    """A short name for tables: of each parameter behind the name the last part of its own."""
    scene, *parts = PART.split(text)
    pairs = (part.partition("=") for part in parts)
    return ", ".join([scene, *(f"{p.rpartition('.')[2]}={v}" for p, _, v in pairs)])


def labels(names: Sequence[str]) -> dict[str, str]:
    """A short name of each controller, and its parameters as `label` has them."""
    short = short_names(map(plain, names))
    return {name: label(short[plain(name)] + name[len(plain(name)) :]) for name in names}
