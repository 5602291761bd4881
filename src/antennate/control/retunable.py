"""A controller whose numbers can be changed while it runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from antennate.control.knowledge import Kind, Knowing, Knowledge
from antennate.params.control import ControlParams
from antennate.types import AntennaFrame, Bools, Controller, Floats, Ints, JointCommand


class Retunable:
    """A controller of one robot that is made anew with other numbers and keeps its gait phase.

    What it remembered is forgotten then: means, the maneuver that it held, an escape.

    Args:
        make: Makes the controller of such numbers.
        control: The numbers at first.

    Attributes:
        control: The numbers in force.
    """

    def __init__(self, make: Callable[[ControlParams], Controller], control: ControlParams) -> None:
        self._make, self.control = make, control
        self._made = make(control)

    def retune(self, control: ControlParams) -> None:
        """Go on with other numbers.

        Raises:
            ConfigError: There is no such controller with these.
        """
        phase: Any = getattr(self._made, "phase", None)
        self._made = self._make(control)
        self.control = control
        self._made.reset(np.array([0]), 0.0 if phase is None else np.array(phase))

    @property
    def maneuver(self) -> Ints:
        """As of a `Controller`."""
        return self._made.maneuver

    @property
    def contact(self) -> Ints:
        """As of a `Controller`."""
        return self._made.contact

    @property
    def level(self) -> Floats:
        """As of a `Controller`."""
        return self._made.level

    @property
    def phase(self) -> Floats | None:
        """Gait phase [rad], shape (1,); None if the controller tells none."""
        return getattr(self._made, "phase", None)

    @property
    def knows(self) -> tuple[Kind, ...]:
        """As of `Knowing`; none of a controller that is none."""
        return self._made.knows if isinstance(self._made, Knowing) else ()

    @property
    def needs(self) -> tuple[Kind, ...]:
        """As of `Knowing`; none of a controller that is none."""
        return self._made.needs if isinstance(self._made, Knowing) else ()

    def know(self, knowledge: Knowledge) -> None:
        """As of `Knowing`."""
        if isinstance(self._made, Knowing):
            self._made.know(knowledge)

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """As of a `Controller`."""
        self._made.reset(rows, phase)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """As of a `Controller`."""
        return self._made.step(frame)
