"""The whole of `antennate setup`: ports, then one servo after the other, and what is done."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import Literal, NamedTuple

from antennate.hardware.doctor.fix import Change
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.setup.person import Person, SetupError, agrees, confirm
from antennate.hardware.setup.servos import Joint, OwnedError, ServoSetup
from antennate.port import PortError

Keep = Callable[[tuple[str, ...]], None]
"""Keeps the names of the joints that are done."""


class JointState(NamedTuple):
    """How far a joint is.

    Attributes:
        joint: The joint.
        state: "set up"; "wrong", its servo answers and is not as it has to be; "to do".
        note: How that is known, or what is wrong.
    """

    joint: Joint
    state: Literal["set up", "wrong", "to do"]
    note: str = ""


class Assembly:
    """Servos of a robot, set up one by one.

    Args:
        servos: What sets them up.
        done: Names of the joints that were done before.
        keep: Called with all that is done after each.

    Attributes:
        done: Names of the joints that are done, in the order of the robot.
    """

    def __init__(self, servos: ServoSetup, done: Iterable[str], keep: Keep) -> None:
        known = set(done)
        self._servos, self._keep = servos, keep
        self.done = [joint.name for joint in servos.joints if joint.name in known]

    def look(self) -> list[JointState]:
        """All joints; those whose servo answers as it has to are done.

        Raises:
            PortError: The port is gone or cannot be opened.
        """
        present = self._servos.present()
        fit = {name for name, lacks in present.items() if not lacks}
        if fit - set(self.done):
            self._add(fit)
        return [self._state(joint, present.get(joint.name)) for joint in self._servos.joints]

    def run(self, person: Person, states: Iterable[JointState], only: Collection[str] = ()) -> None:
        """Ask for the servo of each joint that is not set up, and set it up.

        Args:
            person: Who is asked.
            states: All joints.
            only: Names of the joints to set up, done or not; all that are not done if empty.

        Raises:
            Quit: The person wants to end.
            BadInputError: No answer can come.
        """
        left = [
            state.joint
            for state in states
            if (state.joint.name in only if only else state.state != "set up")
        ]
        for number, joint in enumerate(left, 1):
            self._one(person, joint, f"{number} of {len(left)}")

    def _one(self, person: Person, joint: Joint, where: str) -> None:
        """One joint, until it is done or left out."""
        while confirm(person, f"{where}: connect the servo of {joint} alone"):
            try:
                changes = self._set_up(person, joint)
            except (SetupError, BringUpError, PortError) as error:
                person.say(str(error))
                continue
            for change in changes:
                person.say(f"  {change}")
            person.say(f"  {joint.name} is set up, read back" if changes else "  set up before")
            self._add({joint.name})
            return

    def _set_up(self, person: Person, joint: Joint) -> list[Change]:
        """Set up what is connected; the servo of another joint, a spare, only if the person agrees.

        The other joint is to do again then, until its servo is seen.
        """
        try:
            return self._servos.set_up(joint, self.done)
        except OwnedError as error:
            person.say(str(error))
            other = error.owner.name
            if not agrees(person, f"is it a spare, to become the servo of {joint.name} instead?"):
                raise SetupError(f"nothing was changed; connect the servo of {joint}") from None
            person.say(f"  {other} is not set up, until a servo answers as that of {other}")
            self.done.remove(other)
            self._keep(tuple(self.done))
            return self._servos.set_up(joint, self.done)

    def _add(self, names: set[str]) -> None:
        known = {*self.done, *names}
        self.done = [joint.name for joint in self._servos.joints if joint.name in known]
        self._keep(tuple(self.done))

    def _state(self, joint: Joint, lacks: str | None) -> JointState:
        if lacks:
            return JointState(joint, "wrong", lacks)
        if lacks is not None:
            return JointState(joint, "set up", "answers")
        return (
            JointState(joint, "set up", "as noted before")
            if joint.name in self.done
            else JointState(joint, "to do")
        )
