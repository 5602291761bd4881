"""Controller of one rule: readings are conditioned, the rule decides, the gait makes a command."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from antennate.control.conditioning import ContactState, RunningMean, curves, level_and_fraction
from antennate.control.gait import Gait
from antennate.control.knowledge import Kind, Knowledge
from antennate.errors import ConfigError
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec, require_antennae
from antennate.types import AntennaFrame, Bools, Contact, Floats, Ints, JointCommand, Maneuver


class Rule(Protocol):
    """The decision of a controller."""

    @property
    def turn_offset(self) -> Floats | float:
        """Yaw offset of its turns [rad], one for all rows or of shape (B,)."""
        ...

    def reset(self, rows: Ints | Bools) -> None:
        """Forget everything about some rows."""
        ...

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """Decide.

        Args:
            t: Time of the frame [s], shape (B,).
            level: Bending levels b, 0 to 1, shape (B, 2).
            contact: One `Contact` an antenna, shape (B, 2).
            flex: Flex as a fraction of the calibrated range, 0 straight, shape (B, 2).

        Returns:
            One `Maneuver` a row, shape (B,).
        """
        ...


_PARTS = ("reset", "step", "turn_offset")
"""What a rule has to have."""


class Moves(Protocol):
    """What makes joint targets of maneuvers.

    Attributes:
        phase: Gait phase [rad], shape (B,).
    """

    phase: Floats

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows anew at a phase [rad]."""
        ...

    def step(self, maneuver: Ints, turn_offset: Floats | float | None = None) -> JointCommand:
        """The targets of a maneuver each, shape (B,); HOLD keeps them.

        Args:
            maneuver: One `Maneuver` a row.
            turn_offset: Yaw offset of its turns [rad].
        """
        ...


class RuleController:
    """Control of B robots by one rule.

    Args:
        rule: Decides the maneuver; made for B rows.
        control: All numbers of the control.
        robot: The robot.
        batch: Number of robots B.
        gait: What makes joint targets of its maneuvers; the `Gait` of the control if not given.

    Raises:
        ConfigError: The robot has no antennae, or the rule lacks a part.

    Attributes:
        level: Bending levels b of the last step, shape (B, 2).
        contact: `Contact` of the last step, shape (B, 2).
        maneuver: `Maneuver` of the last step, shape (B,).
        gait: The gait and its phase.
        fastest_gait: Fastest gait by which it walks [Hz]: the `frequency` of its gait, that of the
            control if that gait has none.
        knows: Kinds of knowledge that its rule can use, as of `Knowing`.
        needs: Those that it needs.
    """

    def __init__(
        self,
        rule: Rule,
        control: ControlParams,
        robot: RobotSpec,
        batch: int,
        gait: Moves | None = None,
    ) -> None:
        require_antennae(robot, "this controller")
        if lacking := [part for part in _PARTS if not hasattr(rule, part)]:
            raise ConfigError(
                "expected a rule with reset, step and turn_offset, the yaw offset of its turns "
                f"[rad]; found {type(rule).__name__} without {', '.join(lacking)}"
            )
        self._curves = curves(control)
        self._mean = RunningMean(control.conditioning, batch, control.period)
        self._contact = ContactState(control.rule, batch)
        self._rule: Any = rule
        self.knows: tuple[Kind, ...] = getattr(rule, "knows", ())
        self.needs: tuple[Kind, ...] = getattr(rule, "needs", ())
        self.gait: Moves = gait or Gait(control.gait, robot, batch, control.period)
        pace: Floats | float = getattr(self.gait, "frequency", control.gait.frequency)
        self.fastest_gait = float(np.max(pace))
        self.level: Floats = np.zeros((batch, 2))
        self.contact: Ints = np.full((batch, 2), int(Contact.FREE))
        self.maneuver: Ints = np.full(batch, int(Maneuver.FORWARD))

    @property
    def phase(self) -> Floats:
        """Gait phase [rad], shape (B,)."""
        return self.gait.phase

    @property
    def rule(self) -> Rule:
        """Rule that decides, for whoever watches it."""
        return self._rule

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Forget everything about some rows and start their gait at `phase` [rad]."""
        self._mean.reset(rows)
        self._contact.reset(rows)
        self._rule.reset(rows)
        self.gait.reset(rows, phase)

    def know(self, knowledge: Knowledge) -> None:
        """Take what a simulation knows now; its rule can use some of it."""
        self._rule.know(knowledge)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the command for this frame, both with B rows."""
        counts = self._mean.step(frame.counts)
        self.level, flex = level_and_fraction(self._curves, counts)
        self.contact = self._contact.step(self.level)
        self.maneuver = self._rule.step(frame.t, self.level, self.contact, flex)
        return self.gait.step(self.maneuver, self._rule.turn_offset)
