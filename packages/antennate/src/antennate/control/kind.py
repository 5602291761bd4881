"""Controller with a name as one object: what it does, reads and needs, how it is made and drawn.

`control/registry.py` lists the modules of ours; commands take the names of their `KINDS`, or
FILE.py:NAME of your own (docs/controllers.md).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

from antennate.control.knowledge import Kind
from antennate.errors import ConfigError
from antennate.messages import shown
from antennate.params.base import Params, paths_of
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import Controller

ControllerFactory = Callable[[ControlParams, RobotSpec, int], Controller]
"""Makes a controller of B robots. A class whose `__init__` takes these three is one."""

Reads = tuple[str, ...] | Callable[[ControlParams, Collection[str]], tuple[str, ...]]
"""Parameters of the control, dotted, or groups of them; a function where they depend on others, and
on the knowledge, such as the side of a turn, that a simulation may give to a controller."""

_COLOUR = re.compile("(#[0-9A-Fa-f]{6})?").fullmatch
_SWEEP = tuple(f"gait.antenna_{name}" for name in ("mean", "amplitude", "frequency"))
"""How the gait sweeps the antenna bases; controllers that climb sweep them themselves."""
_SHARED = tuple(
    path
    for path in paths_of(ControlParams)
    if path.split(".")[0] in ("rate", "gait", "conditioning", "conditioning_right")
    or path in ("rule.threshold", "rule.hysteresis")
)


@dataclass(frozen=True, repr=False)
class ControllerKind:
    """Controller with a name. The module of a controller lists its kinds as a tuple `KINDS`.

    One in a file of your own is taken, too. Its `reads`, `needs` and `climbs` are not used: it may
    read all parameters, and what it needs is asked of its controller (docs/controllers.md).

    Attributes:
        name: Name, as commands take it.
        about: Sentence on what it does, for somebody who meets it for the first time.
        make: Makes it of (control, robot, batch).
        reads: Parameters of the control that it reads; one that no controller of a run reads is
            refused. All read the rate, the
            conditioning, the rule's threshold and hysteresis, and the gait but for `turn_offset`;
            those that climb read no sweep of the antenna bases either.
        colour: Colour in figures, #RRGGBB; where it is empty, one that no other controller has.
        line: Line in figures, as matplotlib takes it, to tell controllers apart in grey print.
        needs: Knowledge that it cannot do without, and only a simulation has.
        climbs: Whether it raises links and antennae of the robot.

    Raises:
        ConfigError: Name or sentence is no text, `make` no function, the colour none, or `reads`
            neither a tuple nor a function.
    """

    name: str
    about: str
    make: ControllerFactory
    reads: Reads = ()
    colour: str = ""
    line: Any = "solid"
    needs: tuple[Kind, ...] = ()
    climbs: bool = False

    def __post_init__(self) -> None:
        parts: dict[str, tuple[Any, bool]] = {
            "name: expected a text": (self.name, isinstance(self.name, str)),
            "about: expected a text": (self.about, isinstance(self.about, str)),
            "make: expected a function": (self.make, callable(self.make)),
            "colour: expected #RRGGBB or nothing": (self.colour, bool(_COLOUR(str(self.colour)))),
            "reads: expected a tuple or a function": (
                self.reads,
                isinstance(self.reads, tuple) or callable(self.reads),
            ),
        }
        for expected, (found, fits) in parts.items():
            if not fits:
                raise ConfigError(f"controller kind: {expected}, found {shown(found)}")

    @property
    def __name__(self) -> str:
        """Name, as a factory has one."""
        return self.name

    def __repr__(self) -> str:
        return f"<ControllerKind {self.name}>"

    def __call__(self, control: ControlParams, robot: RobotSpec, batch: int) -> Controller:
        """The controller of `batch` robots."""
        return self.make(control, robot, batch)


def unread_of(
    reads: Reads, climbs: bool, control: ControlParams, knows: Collection[str] = ()
) -> set[str]:
    """Parameters of the control, dotted, that are neither read by all nor among `reads`.

    Args:
        reads: Those that a controller reads.
        climbs: Whether it climbs.
        control: All numbers of the control.
        knows: What a simulation tells it; a robot tells nothing.
    """
    own = reads if isinstance(reads, tuple) else reads(control, knows)
    apart = {"gait.turn_offset", *(_SWEEP if climbs else ())}
    read = {*own, *(path for path in _SHARED if path not in apart)}
    return {path for path in paths_of(ControlParams) if not read & {path, *_groups(path)}}


def all_but(model: type[Params], group: str, *names: str) -> tuple[str, ...]:
    """Parameters of a group, dotted, but for some names in it."""
    left_out = {f"{group}.{name}" for name in names}
    return tuple(path for path in paths_of(model, group) if path not in left_out)


def _groups(path: str) -> list[str]:
    """Groups around a parameter."""
    parts = path.split(".")[:-1]
    return [".".join(parts[: i + 1]) for i in range(len(parts))]
