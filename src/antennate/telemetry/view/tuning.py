"""The numbers of a controller that a person can change on a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from antennate.control.registry import BUILT_IN
from antennate.control.retunable import Retunable
from antennate.params.base import Params
from antennate.params.control import ControlParams
from antennate.params.reading import from_values
from antennate.types import Controller

_PLACES = {
    "threshold": ("rule", "threshold"),
    "averaging_time": ("conditioning", "averaging_time"),
    "hold_time": ("rule", "hold_time"),
    "turn_offset": ("gait", "turn_offset"),
}
"""Where each of them stands in `ControlParams`."""
_READ = {
    "open": {name: _PLACES[name] for name in ("threshold", "averaging_time")},
    "closed": {name: _PLACES[name] for name in ("threshold", "averaging_time")}
    | {"turn_offset": ("escape", "turn_offset")},
}
"""What a controller of ours reads; all others are taken to read all."""


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
        self._places: Mapping[str, tuple[str, str]] = _PLACES
        if name in BUILT_IN:
            self._places = _READ.get(name, _PLACES)

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
