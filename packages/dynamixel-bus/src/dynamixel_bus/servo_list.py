"""Servos by a list of words: `1:xl330-m288 2:xl430-w250@1000000 1:xc430-w240x17`."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import NamedTuple

from dynamixel_bus.errors import ConfigError
from dynamixel_bus.model import BAUD_RATES
from dynamixel_bus.models import MODELS, not_served, servo_model
from dynamixel_bus.packets import LAST_ID
from dynamixel_bus.servo import Servo

FACTORY_BAUD = 57_600
"""Speed of a servo as delivered [bit/s]."""
MIDDLE = 2048.0
"""Position at the angle 0 [ticks]."""
FORM = "ID:MODEL[@BAUD][xCOUNT]"
"""How a servo stands in a list."""
_FORM = re.compile(
    r"(?P<id>\d{1,3}):(?P<model>[a-z0-9-]+?|.+?\.toml)(@(?P<baud>\d+))?(x(?P<count>\d{1,3}))?"
)


class ListedServo(NamedTuple):
    """One servo of a list.

    Attributes:
        id: Its id.
        model: Name of its model, or a file with one.
        baud: Its speed on the bus [bit/s].
    """

    id: int
    model: str
    baud: int


def is_listed(word: str) -> bool:
    """Whether a word has the form of one."""
    return _FORM.fullmatch(word) is not None


def read_list(
    words: Sequence[str], expected: str = f"expected {FORM}, such as 1:xl330-m288"
) -> list[ListedServo]:
    """Servos from words, each `ID:MODEL[@BAUD][xCOUNT]`.

    Args:
        words: The words.
        expected: What is said of a word of another form, before the word.
    """
    found: list[ListedServo] = []
    for word in words:
        match = _FORM.fullmatch(word)
        if match is None:
            raise ConfigError(f"{expected}, found {word!r}")
        model, count = match["model"], match["count"]
        if count and not match["baud"] and model not in MODELS and not model.endswith(".toml"):
            model, count = f"{model}x{count}", None  # the x is part of its name
        listed = ListedServo(int(match["id"]), model, int(match["baud"] or FACTORY_BAUD))
        found += [listed] * int(count or 1)
    return found


def make_servo(listed: ListedServo, position: float = MIDDLE, flag: str = "") -> Servo:
    """A servo of a list, all else as delivered.

    Args:
        listed: What the list says.
        position: Where its shaft is [ticks].
        flag: What named it, for errors, such as `--servos: `.
    """
    if listed.id > LAST_ID:
        raise ConfigError(f"{flag}expected an id from 0 to {LAST_ID}, found {listed.id}")
    if not listed.model.endswith(".toml"):
        if why := not_served(listed.model):
            raise ConfigError(
                f"{flag}expected a servo of the X series, found {listed.model}: {why}"
            )
        _require(listed.model, MODELS, f"{flag}expected as model")
    model = servo_model(listed.model)
    speeds = BAUD_RATES[: (model["baud_rate"].high or 0) + 1]
    _require(listed.baud, speeds, f"{flag}expected as speed of {listed.model}")
    servo = Servo(model, listed.id, position)
    servo.set("baud_rate", speeds.index(listed.baud))
    return servo


def _require(value: object, known: Collection[object], expected: str) -> None:
    if value not in known:
        raise ConfigError(f"{expected} one of {', '.join(map(str, known))}, found {value}")
