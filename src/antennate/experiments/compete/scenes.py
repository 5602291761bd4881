"""A scene with other parameters than its own, as text: `uturn+variation.reading_noise=3`.

Behind the name of the scene stands for each parameter a +, its dotted name, = and its value, as in
a TOML file; text needs no quotes. What belongs to the controller cannot be set: a controller with
other numbers is another controller.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any

from antennate.control.readings import YOKED
from antennate.errors import ConfigError
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.messages import shown
from antennate.params.base import from_values

_NEXT = re.compile(r"\+(?=[a-z_.]+=)")
_GROUPS = ("tunnel", "corridors", "robot", "variation", "physics", "readings", "time_limit")
"""What may be set: fields of `TunnelConfig`."""


def tunnel_config(text: str, controller: str, seed: int) -> TunnelConfig:
    """The run of one controller in such a scene.

    Raises:
        ConfigError: A parameter is unknown, cannot be set here, or has a value out of bounds.
    """
    scene, *parts = _NEXT.split(text)
    values: dict[str, Any] = {"scene": scene, "seed": seed, "controllers": (controller,)}
    for part in parts:
        path, _, value = part.partition("=")
        *groups, name = path.split(".")
        if path.partition(".")[0] not in _GROUPS:
            raise ConfigError(
                f"scenes: expected a parameter of {', '.join(_GROUPS)}, found {shown(path)} in "
                f"{shown(text)}"
            )
        place = values
        for group in groups:
            place = place.setdefault(group, {})
        place[name] = _value(value)
    if "readings" in values:
        values["readings"] = (values["readings"],)
        if values["readings"] == (YOKED,):
            raise ConfigError(f"scenes: expected readings of its own, found {shown(text)}")
    try:
        return from_values(TunnelConfig, values)
    except ConfigError as error:
        raise ConfigError(f"scenes: {shown(text)}: {error}") from None


def _value(text: str) -> Any:
    """A value as TOML has it, else the text itself."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def label(text: str) -> str:
    """A short name for tables: the scene, and of each parameter the last part of its name."""
    scene, *parts = _NEXT.split(text)
    pairs = (part.partition("=") for part in parts)
    return ", ".join([scene, *(f"{p.rpartition('.')[2]}={v}" for p, _, v in pairs)])
