"""Controllers by name, the same names in every command and in Python."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from numbers import Real
from typing import Any

from antennate import checks
from antennate.control.kind import ControllerFactory, ControllerKind, unread_of
from antennate.control.readers import UNREAD_BY_POLICIES, unread_lift
from antennate.control.readings import OWN, about_readings, parts_of
from antennate.errors import ConfigError, MissingPackageError, raised
from antennate.lookup import Registry, Shipped
from antennate.messages import shown
from antennate.params.base import paths_of
from antennate.params.climb import HeadingParams
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec, require_walking
from antennate.types import Controller

ControllerMaker = Callable[[str, ControlParams, RobotSpec, int], Controller]
"""Makes the controller of a name for B robots, as `make_controller` does."""

USUAL = ("open", "timed", "paper", "closed")
"""Controllers that are run if none is named; the others are further controls without touch."""
_MODULES = ("controllers", "blind", "geometric", "steering", "climbing.controllers")
"""Modules of `antennate.control` with a tuple `KINDS`, those of the usual controllers first."""


def _shipped(where: Callable[[ControllerKind], bool]) -> Shipped[ControllerKind]:
    """Controllers of ours, listed the usual ones first and last those that no robot may have."""

    def declared(module: Any) -> dict[str, ControllerKind]:
        return {kind.name: kind for kind in module.KINDS}

    def rank(kind: ControllerKind) -> tuple[bool, int]:
        return bool(kind.needs), USUAL.index(kind.name) if kind.name in USUAL else len(USUAL)

    return Shipped([f"antennate.control.{name}" for name in _MODULES], declared, where, rank)


KINDS = _shipped(lambda kind: True)
"""Controllers of ours by name."""
BUILT_IN = _shipped(lambda kind: not kind.needs)
"""Those of ours that a robot may have."""
RIVAL = "timed"
"""The controller that results are compared with, wherever it was run beside others."""


def _of_policy(name: str) -> ControllerFactory:
    """What makes controllers of a policy file."""
    from antennate.control.policy.controller import policy_factory  # only where one is named

    return policy_factory(name)


_FILES: dict[str, Callable[[str], ControllerFactory]] = {".onnx": _of_policy}
CONTROLLERS: Registry[ControllerFactory] = Registry(
    "controller", "antennate.controllers", KINDS, _FILES
)
"""All controllers: ours, of installed packages, one's own as MODULE:NAME or FILE.py:NAME, and
learned policies as FILE.onnx."""
_FOR_ROBOTS: Registry[ControllerFactory] = Registry(
    "controller", "antennate.controllers", BUILT_IN, _FILES
)


def check_for_robots(name: str) -> str:
    """Return the name of a controller if a robot may have it; no code of the user runs."""
    if name in KINDS and name not in BUILT_IN:
        raise ConfigError(
            f"expected a controller that lives on its readings, found {name!r}, which needs what "
            "only a simulation knows; `antennate tunnel` runs it"
        )
    return _FOR_ROBOTS.check(name)


def kind_of(name: str) -> ControllerKind | None:
    """The kind of a controller, if it has one and is known; no code of the user runs."""
    found = KINDS.get(name, CONTROLLERS.known(name))
    return found if isinstance(found, ControllerKind) else None


def looks(names: Iterable[str]) -> dict[str, tuple[str, Any]]:
    """Colour and line of controllers in figures, by name.

    Whoever has no colour of its own takes one in turn that no other of these controllers has.
    """
    kinds = {name: kind_of(name) for name in names}
    coloured = {kind.colour: name for name, kind in [*kinds.items()][::-1] if kind is not None}
    own = {name: colour for colour, name in coloured.items() if colour}
    others = _free(own.values())
    return {
        name: (own.get(name) or next(others), "solid" if kind is None else kind.line)
        for name, kind in kinds.items()
    }


def _free(taken: Collection[str]) -> Iterator[str]:
    """Colours in turn that none of these is; all colours if there is no other."""
    from antennate.figures import SERIES  # only where they are drawn

    ours = (kind.colour for kind in KINDS.values() if kind.colour)
    palette = [*dict.fromkeys([*SERIES, *ours])]
    yield from itertools.cycle([colour for colour in palette if colour not in taken] or palette)


def about(names: Iterable[str]) -> str:
    """What the controllers among these conditions do, a line each, then their readings."""
    plain = dict.fromkeys(parts_of(name)[0] for name in names)
    kinds = ((name, kind_of(name)) for name in plain)
    lines = [f"{name}: {kind.about}" for name, kind in kinds if kind is not None and kind.about]
    return "\n".join([*lines, *about_readings(names)])


def compared(names: Sequence[str]) -> tuple[str, str] | None:
    """The two conditions that a headline compares: the last one named, and its rival.

    The rival is `RIVAL`, else `open`, else the first one; None of fewer than two.
    Conditions with other than their own readings are left out, unless only one is left: then it is
    compared with the last one that has others.
    """
    if len(names) < 2:
        return None
    own = [name for name in names if parts_of(name)[1] == OWN]
    if len(own) == 1:
        return own[0], [name for name in names if name != own[0]][-1]
    names = own or names
    rival = next((name for name in (RIVAL, "open") if name in names), names[0])
    return [name for name in names if name != rival][-1], rival


def make_controller(
    name: str | ControllerFactory,
    control: ControlParams | None = None,
    robot: RobotSpec | None = None,
    batch: int = 1,
    walks: bool = True,
) -> Controller:
    """A controller of `batch` robots, as it begins.

    Args:
        name: A name that `CONTROLLERS` finds, or a factory.
        control: Numbers of the control, the defaults if not given.
        robot: The robot, the default one if not given.
        batch: Number of robots B, at least 1: the first axis of all its arrays.
        walks: Whether it moves the robot, as it does not in a replay; then goals of the legs have
            to keep up with its gait.

    Raises:
        ConfigError: There is no controller of that name, it cannot be made, it cannot walk the
            robot, its gait is too fast for the legs, or one of the others is none.
    """
    factory = CONTROLLERS.find(name) if isinstance(name, str) else name
    control = ControlParams() if control is None else control
    robot = RobotSpec() if robot is None else robot
    checks.instance("control", control, ControlParams)
    checks.instance("robot", robot, RobotSpec)
    require_walking(robot, f"the controller {name!r}" if isinstance(name, str) else "a controller")
    batch = checks.whole("batch", batch, least=1)
    own = control.model_copy(deep=True), robot.model_copy(deep=True)  # which it may spoil
    try:
        controller = factory(*own, batch)
    except (KeyboardInterrupt, MissingPackageError):
        raise
    except ConfigError as error:
        named = str(error).startswith(f"{name}: ")
        raise ConfigError(str(error) if named else f"{name!r}: {error}") from error
    except BaseException as error:
        raise ConfigError(
            f"expected a controller that is made from (control, robot, batch), found {name!r}: "
            f"{raised(error)}"
        ) from error
    if lacking := [
        part for part in ("reset", "step") if not callable(getattr(controller, part, None))
    ]:
        raise ConfigError(
            f"expected a controller with reset and step, found {name!r} without {lacking[0]}"
        )
    if walks:
        pace = getattr(controller, "fastest_gait", control.gait.frequency)
        if not isinstance(pace, Real) or math.isnan(pace):
            raise ConfigError(f"{name!r}: expected fastest_gait in Hz, found {shown(pace)}")
        own = "control.gait.frequency" if pace == control.gait.frequency else f"gait of {name}"
        robot.require_pace(own, float(pace))
    return controller


TELEOP, GOALS, PROTOCOL = "keys of teleop", "goals of other programs", "a protocol"
"""Stand for the controllers of `drive teleop`, `--accept` and `--protocol`, which have no name."""
_UNNAMED: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    TELEOP: (("gait.turn_offset",), ()),
    GOALS: ((), ()),
    PROTOCOL: (("gait.turn_offset",), ("gait.frequency",)),
}
"""What these read of turns, and what they do not read of the gait."""
KEPT_BY_CLIMBERS = ("robot.pitch.limit", "robot.elevation.limit")
"""Parameters of the hardware that controllers that climb keep, in a simulation too."""


def unread(name: str, control: ControlParams, knows: Collection[str] = ()) -> set[str]:
    """Parameters of the control, dotted, that a controller does not read on any robot.

    A controller of one's own may read all.

    Args:
        name: The controller.
        control: All numbers of the control.
        knows: What a simulation tells it; a robot tells nothing.
    """
    if name in _UNNAMED:
        reads, leaves = _UNNAMED[name]
        return unread_of(reads, False, control).union(leaves)
    if (kind := KINDS.get(name)) is not None:
        return unread_of(kind.reads, kind.climbs, control, knows)
    return set(UNREAD_BY_POLICIES) if name.endswith(".onnx") else set()


def unread_by_all(
    names: Sequence[str],
    control: ControlParams,
    robot: RobotSpec,
    knows: Collection[str] = (),
) -> dict[str, str]:
    """Parameters that none of these controllers reads, as `control.rule.strong`, and why."""
    who = f"{' and '.join(names)} {'does' if len(names) == 1 else 'do'} not read it"
    paths = set.intersection(*(unread(name, control, knows) for name in names))
    reasons = {f"control.{path}": who for path in sorted(paths)}
    if not all(name in _UNNAMED or name in KINDS for name in names):
        return reasons
    if not robot.has_imu:
        for path in paths_of(HeadingParams, "control.climb.heading"):
            reasons.setdefault(path, "the robot has no inertial sensor")
    return reasons | unread_lift(robot, "control.gait")


def unread_limits(names: Sequence[str]) -> dict[str, str]:
    """Limits of joints that none of these controllers keeps, and why."""
    kinds = [KINDS.get(name) for name in names if name not in _UNNAMED]
    if any(kind is None or kind.climbs for kind in kinds):
        return {}
    return dict.fromkeys(KEPT_BY_CLIMBERS, "only controllers that climb read it in a simulation")
