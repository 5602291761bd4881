"""Controllers by name, the same names in every command and in Python."""

from __future__ import annotations

from collections.abc import Callable

from antennate import checks
from antennate.control import controllers
from antennate.errors import ConfigError, raised
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
    "paper": controllers.paper,
    "closed": controllers.closed_loop,
}

CONTROLLERS: Registry[ControllerFactory] = Registry("controller", "antennate.controllers", BUILT_IN)
"""All controllers: ours, of installed packages, and one's own as MODULE:NAME or FILE.py:NAME."""


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
    try:
        made = factory(control, robot, batch)
    except KeyboardInterrupt:
        raise
    except ConfigError as error:
        raise ConfigError(f"{name!r}: {error}") from error
    except BaseException as error:
        raise ConfigError(
            f"expected a controller that is made from (control, robot, batch), found {name!r}: "
            f"{raised(error)}"
        ) from error
    if lacking := [part for part in ("reset", "step") if not callable(getattr(made, part, None))]:
        raise ConfigError(
            f"expected a controller with reset and step, found {name!r} without {lacking[0]}"
        )
    return made
