"""The numbers of a controller that a person can change on a page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from antennate.control.loop import Retunable
from antennate.control.readers import unread
from antennate.params.base import Params, from_values
from antennate.params.control import ControlParams
from antennate.types import Controller

_PLACES = ("rule.threshold", "conditioning.averaging_time", "rule.hold_time")
_TURNS = ("gait.turn_offset", "escape.turn_offset")
"""Of these the first that is read."""


class Tuning:
    """A controller and its numbers.

    Args:
        name: Name of the controller, as `make_controller` takes it.
        control: Its numbers at first.
        make: Makes it of such numbers.

    Attributes:
        controller: It.
    """

    def __init__(
        self, name: str, control: ControlParams, make: Callable[[ControlParams], Controller]
    ) -> None:
        self.controller = Retunable(make, control)
        read = [place for place in _PLACES + _TURNS if place not in unread(name, control)]
        self._places: dict[str, tuple[str, str]] = {}
        for group, _, field in (place.partition(".") for place in read):
            self._places.setdefault(field, (group, field))

    @property
    def values(self) -> dict[str, float]:
        """The numbers in force, by their names on the page."""
        control = self.controller.control
        return {
            name: getattr(getattr(control, group), field)
            for name, (group, field) in self._places.items()
        }

    def set(self, name: str, value: Any) -> str:
        """Change one of them; what was changed, empty if there is none of that name.

        Raises:
            ConfigError: It is out of bounds.
        """
        if name not in self._places:
            return ""
        group, field = self._places[name]
        control = self.controller.control
        old: Params = getattr(control, group)
        made: Any = from_values(type(old), old.model_dump() | {field: value})
        self.controller.retune(control.model_copy(update={group: made}))
        return f"control.{group}.{field} = {getattr(made, field):g}"
