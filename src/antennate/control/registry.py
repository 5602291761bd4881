"""Controllers by name, the same names in every command and in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from antennate import checks
from antennate.control import blind, controllers, geometric, steering
from antennate.control.climbing import controllers as climbing
from antennate.control.readings import OWN, about_readings, parts_of
from antennate.errors import ConfigError, MissingPackageError, raised
from antennate.lookup import Registry
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import Controller

ControllerFactory = Callable[[ControlParams, RobotSpec, int], Controller]
"""Makes a controller of B robots. A class whose `__init__` takes these three is one."""

ControllerMaker = Callable[[str, ControlParams, RobotSpec, int], Controller]
"""Makes the controller of a name for B robots, as `make_controller` does."""

BUILT_IN: dict[str, ControllerFactory] = {
    "open": controllers.open_loop,
    "timed": blind.timed,
    "paper": controllers.paper,
    "closed": controllers.closed_loop,
    "closed-1": controllers.closed_1,
    "geometric": geometric.geometric,
    "follow": steering.follow,
    "centre": steering.centre,
    "schedule": blind.schedule,
    "zigzag": blind.zigzag,
    "random": blind.RandomController,
    "climb": climbing.climb,
    "lifted": climbing.lifted,
    "rhythm": climbing.rhythm,
}
USUAL = ("open", "timed", "paper", "closed")
"""Those of ours that are run if none is named; the others are further controls without touch."""
PRIVILEGED: dict[str, ControllerFactory] = {
    "map": controllers.by_map,
    "edges": climbing.edges,
}
"""Controllers that need what only a simulation knows."""

ABOUT = {
    "open": "walks forward whatever its antennae feel; it shows what a robot does without touch",
    "timed": "backs off and turns by the clock, whatever it feels: what closed has to beat",
    "paper": "turns away from the side that touches, backs off where both do: the published table",
    "closed": "walks on until its readings repeat: then it backs off and searches for the way on",
    "closed-1": "the closed of former versions: stuck, it backs off and turns, then the other way",
    "geometric": "closed by a faster gait; its escapes are in metres and degrees, by a model",
    "follow": "steers along a wall that one antenna feels, by PD control; it never backs off",
    "centre": "steers away from the antenna that is bent more, by as much; it never backs off",
    "schedule": "blind: backs off by the clock and turns right and left, farther and farther",
    "zigzag": "blind: turns right and left by the clock, always by as much",
    "random": "blind: backs off and turns at random times, to random sides, by random angles",
    "climb": "feels steps and drops with lowered antennae, climbs steps, steers by walls as closed",
    "lifted": "blind: walks with its head up, so that it gets on to low steps",
    "rhythm": "blind: climbs by the clock, as climb does where it feels a step",
    "edges": "climbs at edges that only a simulation can tell it, to show what knowing is worth",
    "map": "walks along the route, which only a simulation can tell it, to show what that is worth",
}
"""What ours do, for who meets them for the first time."""
RIVAL = "timed"
"""The controller that results are compared with, wherever it was run beside others."""


def _of_policy(name: str) -> ControllerFactory:
    """What makes controllers of a policy file."""
    from antennate.control.policy.controller import policy_factory  # only where one is named

    return policy_factory(name)


_FILES: dict[str, Callable[[str], ControllerFactory]] = {".onnx": _of_policy}
CONTROLLERS: Registry[ControllerFactory] = Registry(
    "controller", "antennate.controllers", BUILT_IN | PRIVILEGED, _FILES
)
"""All controllers: ours, of installed packages, one's own as MODULE:NAME or FILE.py:NAME, and
learned policies as FILE.onnx."""
_FOR_ROBOTS: Registry[ControllerFactory] = Registry(
    "controller", "antennate.controllers", BUILT_IN, _FILES
)


def check_for_robots(name: str) -> str:
    """Return the name of a controller if a robot may have it; no code of the user runs.

    Raises:
        ConfigError: There is none of that name, or it needs what only a simulation knows.
    """
    if name in PRIVILEGED:
        raise ConfigError(
            f"expected a controller that lives on its readings, found {name!r}, which needs what "
            "only a simulation knows; `antennate tunnel` runs it"
        )
    return _FOR_ROBOTS.check(name)


def about(names: Iterable[str]) -> str:
    """What the controllers of ours among these conditions do, a line each, then their readings."""
    plain = dict.fromkeys(parts_of(name)[0] for name in names)
    lines = [f"{name}: {ABOUT[name]}" for name in plain if name in ABOUT]
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
) -> Controller:
    """A controller of `batch` robots, as it begins.

    Args:
        name: A name that `CONTROLLERS` finds, or a factory.
        control: Numbers of the control, the defaults if not given.
        robot: The robot, the default one if not given.
        batch: Number of robots B, at least 1: the first axis of all its arrays.

    Raises:
        ConfigError: There is no controller of that name, it cannot be made, it cannot walk the
            robot, or one of the others is none.
    """
    factory = CONTROLLERS.find(name) if isinstance(name, str) else name
    control = ControlParams() if control is None else control
    robot = RobotSpec() if robot is None else robot
    checks.instance("control", control, ControlParams)
    checks.instance("robot", robot, RobotSpec)
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
    return controller
