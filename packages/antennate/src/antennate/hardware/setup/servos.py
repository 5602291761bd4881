"""Servos become joints, one at a time: id, speed, mode, limits and return delay.

The servo may be factory-new (id 1 at 57600 bit/s) or have any other id and speed. What it has to
hold is the rule that drive and doctor know (`hardware.joints`). Its id and speed are changed
last: one that was interrupted before is found as a new one again.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from functools import partial
from typing import Literal, NamedTuple

from antennate.hardware.doctor.bus_survey import master
from antennate.hardware.doctor.check import Opener
from antennate.hardware.doctor.fix import Change, apply
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.joints import all_settings, settings_of
from antennate.hardware.setup.person import Person, SetupError, agrees, confirm
from antennate.robots.spec import RobotSpec
from dynamixel_bus.bus import Bus
from dynamixel_bus.inquiry import FOUND, Present, look, read_some
from dynamixel_bus.model import BAUD_RATES
from dynamixel_bus.models import XC430_W240, model_name
from dynamixel_bus.port import PortError

FACTORY_BAUD = 57_600
"""Speed of a new servo [bit/s]: the manual's default of `baud_rate` in both models."""
_FASTEST = 4_000_000
"""Fastest that a usual adapter does [bit/s]; the SDK takes no more either."""


class Joint(NamedTuple):
    """A joint and the servo that it needs.

    Attributes:
        name: Name in the robot's description.
        servo: Id of its servo.
        model: Model number of its servo.
    """

    name: str
    servo: int
    model: int

    def __str__(self) -> str:
        return f"{self.name} (id {self.servo}, {model_name(self.model)})"


def joints_of(robot: RobotSpec) -> list[Joint]:
    """All joints that servos move, in the order of the robot."""
    models = robot.models
    return [Joint(n, i, models[i]) for n, i in zip(robot.joint_names, robot.ids, strict=True)]


class OwnedError(SetupError):
    """The servo is that of another joint, which is done; nothing was changed.

    Attributes:
        owner: The other joint.
    """

    def __init__(self, joint: Joint, owner: Joint) -> None:
        super().__init__(
            f"expected the servo of {joint}, found that of {owner}, which is done; connect the "
            "next one in its place"
        )
        self.owner = owner


class ServoSetup:
    """Makes servos fit for the joints of a robot.

    Args:
        opener: Opens the bus at any speed.
        robot: The robot.
        scan: Time for the answers of all servos [s].
        now: Monotonic time [s].
    """

    def __init__(
        self, opener: Opener, robot: RobotSpec, scan: float, now: Callable[[], float]
    ) -> None:
        self.joints = joints_of(robot)
        self._opener, self._scan, self._now = opener, scan, now
        self._master = partial(master, opener, now=now)
        self._baud = robot.baud
        self._rules = all_settings(robot)

    def present(self) -> dict[str, str]:
        """What each servo that answers at the robot's speed lacks, by joint; "" is nothing."""
        with self._master(self._baud) as bus:
            answering = {status.id for status in bus.scan(self._scan)}
            return {j.name: self._lacks(bus, j) for j in self.joints if j.servo in answering}

    def set_up(self, joint: Joint, done: Collection[str]) -> list[Change]:
        """Make the one servo on the bus that of a joint: the changes that were made.

        Args:
            joint: The joint.
            done: Names of joints that have their servo.
        """
        baud, servo = self.alone()
        if servo.state != "ok":
            raise SetupError(f"expected one servo alone, found {FOUND[servo.state]}")
        if servo.model != joint.model:
            raise SetupError(
                f"expected the servo of {joint}, found an {model_name(servo.model)} (id "
                f"{servo.servo}); connect one of the right model"
            )
        if other := self._owner(baud, servo.servo, done, joint):
            raise OwnedError(joint, other)
        changes = self._plan(baud, servo.servo, joint)
        for change in changes:
            apply(self._opener, change, self._now)
        with self._master(self._baud) as bus:
            lacks = self._lacks(bus, joint)
        if lacks:
            raise SetupError(f"expected the servo of {joint} to be set up, found {lacks}")
        return changes

    def alone(self) -> tuple[int, Present]:
        """The one servo on the bus and its speed."""
        present: list[tuple[int, Present]] = []
        usual = (FACTORY_BAUD, self._baud)
        others = [b for b in BAUD_RATES if b not in usual and b <= _FASTEST]
        for speeds in (tuple(dict.fromkeys(usual)), others):
            for baud in speeds:
                with self._master(baud) as bus:
                    present += [(baud, servo) for servo in self._answering(bus)]
            if present:
                break
        if not present:
            raise SetupError(
                "expected one servo, found none at any speed; check its cable and its supply"
            )
        if len(present) > 1:
            names = ", ".join(f"id {servo.servo} at {baud}" for baud, servo in present)
            raise SetupError(
                f"expected one servo alone, found {len(present)}: {names}; unplug the others"
            )
        return present[0]

    def _answering(self, bus: Bus) -> list[Present]:
        """Servos that answer at the speed of a bus."""
        ids = sorted({status.id for status in bus.scan(self._scan)})
        if not ids and bus.tally.bad_crc:
            return [Present(0, None, None, "broken")]
        return [present for servo in ids if (present := look(bus, servo)) is not None]

    def _owner(self, baud: int, servo: int, done: Collection[str], joint: Joint) -> Joint | None:
        """The joint, done already, whose servo this is."""
        owners = [j for j in self.joints if j.servo == servo and j.name in done and j != joint]
        if baud != self._baud or not owners:
            return None
        with self._master(baud) as bus:
            lacks = self._lacks(bus, owners[0])
        return owners[0] if not lacks else None

    def _plan(self, baud: int, servo: int, joint: Joint) -> list[Change]:
        """What differs, in the order in which it is to be changed."""
        with self._master(baud) as bus:
            there = self._read(bus, servo)
        changes = [
            Change(servo, baud, name, there[name], rule.cure)
            for name, rule in settings_of(self._rules, joint.servo).items()
            if not rule.allows(there[name])
        ]
        if servo != joint.servo:
            changes.append(Change(servo, baud, "id", servo, joint.servo))
        if baud != self._baud:
            old, new = BAUD_RATES.index(baud), BAUD_RATES.index(self._baud)
            changes.append(Change(joint.servo, baud, "baud_rate", old, new))
        return changes

    def _lacks(self, bus: Bus, joint: Joint) -> str:
        """What is wrong with the servo of a joint, empty if nothing is."""
        servo = look(bus, joint.servo)
        if servo is None:
            return "no answer"
        if servo.state != "ok":
            return FOUND[servo.state]
        if servo.model != joint.model:
            return f"an {model_name(servo.model)}"
        there = self._read(bus, joint.servo)
        return "; ".join(
            f"{name.replace('_', ' ')} {there[name]} (expected {rule})"
            for name, rule in settings_of(self._rules, joint.servo).items()
            if not rule.allows(there[name])
        )

    def _read(self, bus: Bus, servo: int) -> dict[str, int]:
        """The registers of a servo that have to hold something."""
        values: dict[str, int] = {}
        for name in self._rules:
            value = read_some(bus, [servo], XC430_W240[name]).get(servo)
            if value is None:
                raise SetupError(
                    f"expected {name.replace('_', ' ')} of servo {servo}, found no answer; check "
                    "its cable"
                )
            values[name] = value
        return values


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
        forget: Called with a joint that may get another servo, whose zero nobody knows.

    Attributes:
        done: Names of the joints that are done, in the order of the robot.
    """

    def __init__(
        self, servos: ServoSetup, done: Iterable[str], keep: Keep, forget: Callable[[Joint], object]
    ) -> None:
        known = set(done)
        self._servos, self._keep, self._forget = servos, keep, forget
        self.done = [joint.name for joint in servos.joints if joint.name in known]

    def look(self) -> list[JointState]:
        """All joints; those whose servo answers as it has to are done."""
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
            self._forget(joint)  # before a servo is changed, and the program may end
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
            self._forget(error.owner)
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
