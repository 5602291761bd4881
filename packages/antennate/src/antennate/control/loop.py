"""The control loop of all robots: read, decide, write, wait for the next tick.

What stands between robot and controller: copies of what either gives and a check of every answer,
since a controller may be anybody's code, and new numbers for a controller that runs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from typing import Any, Protocol

import numpy as np

from antennate.control.knowledge import Kind, Knowing, Knowledge
from antennate.errors import ControllerError, is_ctrl_c, raised
from antennate.messages import shortened
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import (
    AntennaFrame,
    Bools,
    Contact,
    Controller,
    Floats,
    Ints,
    JointCommand,
    Maneuver,
    Robot,
)

_ROUNDING = 1e-6


class Stepper(Protocol):
    """The part of a controller that the loop needs."""

    def step(self, frame: AntennaFrame) -> JointCommand:
        """The joint targets for this tick."""
        ...


def run_loop(
    body: Robot,
    control: Stepper,
    period: float,
    go_on: Callable[[AntennaFrame, JointCommand], bool],
) -> int:
    """Run until `go_on` says no.

    The n-th tick is due at start + n * period. A tick that takes too long delays none but the next;
    ticks whose time has passed by then are left out.

    Args:
        body: The robot.
        control: The controller; it is given a copy of each frame.
        period: Control period [s].
        go_on: Called after each write with what was read and written; False ends the loop.

    Returns:
        Number of ticks run.
    """
    start = body.clock.now()
    ticks = due = 0
    while True:
        frame = body.read()
        command = control.step(frame.copy())
        body.write(command)
        ticks += 1
        if not go_on(frame, command):
            return ticks
        due = next_tick(due, body.clock.now() - start, period)
        body.clock.sleep_until(start + due * period)


def next_tick(number: int, elapsed: float, period: float) -> int:
    """The first tick after one of this number that is not yet due, a time [s] after the start."""
    return max(number + 1, math.ceil(elapsed / period - _ROUNDING))


_LAST, _MOST_CONTACT = max(Maneuver), max(Contact)
_KINDS = (
    ("maneuver", "whole numbers", "iu"),
    ("contact", "whole numbers", "iu"),
    ("level", "real numbers", "fiu"),
)
"""What the numbers of a decision are, and the kinds of NumPy that hold them."""


@contextmanager
def _errors_of(what: str) -> Iterator[None]:
    """Raise a ControllerError for whatever a method of a controller raises, but Ctrl-C."""
    try:
        yield
    except ControllerError:
        raise
    except BaseException as error:
        if is_ctrl_c(error):
            raise
        raise ControllerError(f"{what} raised {raised(error)}") from error


class CheckedController:
    """A controller, and what is wrong with its last step.

    It is given a copy of each frame, and its answers are copied: what it writes into either, at
    once or later, changes nothing here. Who judges or logs it reads the copies.

    An exception, an array of another shape or a decision that is no integer affects all rows and
    raises `ControllerError`. An angle that is not finite, an infinite level, or a number that is no
    `Maneuver` or `Contact`, affects one row and is listed in `faults`.

    Args:
        controller: The controller of `batch` robots.
        robot: The robot.
        batch: Number of robots B.

    Attributes:
        maneuver, contact, level: Of the last step, as of a `Controller`.
        faults: What is wrong with a row of the last step, by row.
    """

    def __init__(self, controller: Controller, robot: RobotSpec, batch: int) -> None:
        self._controller = controller
        self._shapes = robot.command_shapes(batch)
        self._attributes = {"maneuver": (batch,), "contact": (batch, 2), "level": (batch, 2)}
        self.maneuver: Ints = np.full(batch, int(Maneuver.FORWARD))
        self.contact: Ints = np.full((batch, 2), int(Contact.UNKNOWN))
        self.level: Floats = np.full((batch, 2), np.nan)
        self.faults: dict[int, str] = {}

    @property
    def phase(self) -> Any:
        """What the controller tells as its gait phase [rad], None if it tells none."""
        return getattr(self._controller, "phase", None)

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows anew."""
        with _errors_of("reset"):
            self._controller.reset(copy(rows), copy(phase))

    def know(self, knowledge: Knowledge) -> None:
        """Give it what a simulation knows, if it can use any."""
        if isinstance(self._controller, Knowing):
            with _errors_of("know"):
                self._controller.know(knowledge)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period of all rows."""
        self.faults = {}
        try:
            command = self._controller.step(frame.copy())
            if command is None:  # pyright: ignore[reportUnnecessaryComparison] `return` forgotten
                raise ControllerError("expected a JointCommand from step, found None")
            command = self._take(command)
            sound = self._all_sound(command)
        except ControllerError:
            raise
        except BaseException as error:
            if is_ctrl_c(error):
                raise
            raise ControllerError(f"step raised {raised(error)}") from error
        if not sound:
            self._find_faults(command)
        return command

    def _take(self, answer: JointCommand) -> JointCommand:
        """Copy a command and the decision behind it: arrays of the right shapes."""
        own: dict[str, Any] = {}
        for owner, shapes in ((answer, self._shapes), (self._controller, self._attributes)):
            for name, shape in shapes.items():
                value = getattr(owner, name, None)
                if not isinstance(value, np.ndarray):
                    found = "none" if value is None else type(value).__name__
                    raise ControllerError(f"expected an array as {name}, found {found}")
                if value.shape != shape:
                    raise ControllerError(f"expected {name} of shape {shape}, found {value.shape}")
                own[name] = np.array(value)
        command = JointCommand(**{name: own[name] for name in self._shapes})
        for name in self._shapes:
            if (kind := own[name].dtype).kind not in "fiu":
                raise ControllerError(f"expected real numbers as {name}, found an array of {kind}")
        for name, words, kinds in _KINDS:
            if (kind := own[name].dtype).kind not in kinds:
                raise ControllerError(f"expected {words} as {name}, found an array of {kind}")
            setattr(self, name, own[name])
        return command

    def _all_sound(self, command: JointCommand) -> bool:
        """Whether no row has a fault. A product that is finite has finite factors."""
        maneuvers, contacts = self.maneuver.tolist(), self.contact.ravel().tolist()
        angles = [getattr(command, name) for name in self._shapes]
        squares = sum(float(np.vdot(a, a)) for a in angles)
        known = min(contacts) >= 0 and max(contacts) <= _MOST_CONTACT
        known = known and not np.isinf(self.level).any()
        return known and math.isfinite(squares) and min(maneuvers) >= 0 and max(maneuvers) <= _LAST

    def _find_faults(self, command: JointCommand) -> None:
        for name in self._shapes:
            angles: Floats = getattr(command, name)
            for row in np.flatnonzero(~np.isfinite(angles.reshape(len(angles), -1)).all(axis=1)):
                self.faults[int(row)] = (
                    f"expected finite angles in {name}, found {shortened(str(angles[row]))}"
                )
        for row in np.flatnonzero((self.maneuver < 0) | (self.maneuver > _LAST)):
            self.faults[int(row)] = f"expected a maneuver of 0 to 4, found {self.maneuver[row]}"
        wrong = (self.contact < 0) | (self.contact > _MOST_CONTACT)
        for row in np.flatnonzero(wrong.any(axis=1)):
            self.faults[int(row)] = f"expected contacts of 0 to 2, found {self.contact[row]}"
        for row in np.flatnonzero(np.isinf(self.level).any(axis=1)):
            self.faults[int(row)] = f"expected levels of 0 to 1, or NaN, found {self.level[row]}"


def void_decisions(controller: object, row: int = 0) -> int:
    """Decisions of a learned policy in which its answer was no number; 0 of other controllers."""
    counts = getattr(controller, "void_decisions", None)
    return int(counts[row]) if isinstance(counts, np.ndarray) else 0


def void_sentence(counts: Mapping[str, int]) -> str:
    """Which policies answered with no number and how often; empty if none did."""
    some = ", ".join(f"{name} {count}" for name, count in counts.items() if count)
    return f"Decisions whose answer was no number, so that the robot held: {some}." if some else ""


class Wrapped:
    """A controller that stands before another one, and answers as that does.

    Args:
        made: The other one.
    """

    def __init__(self, made: Controller) -> None:
        self._made = made

    @property
    def maneuver(self) -> Ints:
        """`Maneuver` of the last step, shape (B,)."""
        return self._made.maneuver

    @property
    def contact(self) -> Ints:
        """`Contact` of each antenna in the last step, shape (B, 2)."""
        return self._made.contact

    @property
    def level(self) -> Floats:
        """Bending level b of each antenna in the last step, 0 to 1, shape (B, 2)."""
        return self._made.level

    @property
    def phase(self) -> Floats | None:
        """Gait phase [rad], shape (B,); None if the controller tells none."""
        return getattr(self._made, "phase", None)

    @property
    def void_decisions(self) -> Ints | None:
        """Decisions of a learned policy without a number, shape (B,); None of any other."""
        return getattr(self._made, "void_decisions", None)

    @property
    def knows(self) -> tuple[Kind, ...]:
        """Kinds of knowledge that the other controller can use."""
        return self._made.knows if isinstance(self._made, Knowing) else ()

    @property
    def needs(self) -> tuple[Kind, ...]:
        """Kinds of knowledge without which the other controller cannot walk."""
        return self._made.needs if isinstance(self._made, Knowing) else ()

    def know(self, knowledge: Knowledge) -> None:
        """Pass knowledge on to a controller that can use it."""
        if isinstance(self._made, Knowing):
            self._made.know(knowledge)

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start rows of the other controller anew, their gait at a phase [rad]."""
        self._made.reset(rows, phase)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period of the other controller: the joint targets for this frame."""
        return self._made.step(frame)


class Retunable(Wrapped):
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
        super().__init__(make(control))

    def retune(self, control: ControlParams) -> None:
        """Go on with other numbers."""
        phase: Any = getattr(self._made, "phase", None)
        self._made = self._make(control)
        self.control = control
        self._made.reset(np.array([0]), 0.0 if phase is None else np.array(phase))
