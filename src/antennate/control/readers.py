"""Which parameters of the control each controller of ours does not read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from antennate.params.base import paths_of
from antennate.params.blind import RandomParams, ScheduleParams, TimedParams, ZigzagParams
from antennate.params.control import ControlParams, EscapeParams, RepetitionParams, SearchParams
from antennate.params.gaits import LiftParams
from antennate.robots.spec import RobotSpec

TELEOP = "keys of teleop"
"""Stands for the controller of `teleop`, which has no name."""
BY_CONTACT = "closed-1 by contact"
"""Stands for `closed-1` with `escape.trigger` `contact`."""
_BLOCKED = ("rule.strong", "rule.similar")
"""When the published table backs off."""
_REPEATED = ("repetition.window_cycles", "repetition.change")
"""When readings repeat."""
_ESCAPE = (*paths_of(RepetitionParams, "repetition"), *paths_of(EscapeParams, "escape"))
_TIMED = paths_of(TimedParams, "timed")
_SCHEDULE = paths_of(ScheduleParams, "schedule")
_ZIGZAG = paths_of(ZigzagParams, "zigzag")
_RANDOM = paths_of(RandomParams, "random")
_BLIND = (*_TIMED, *_SCHEDULE, *_ZIGZAG, *_RANDOM)
_SEARCH = paths_of(SearchParams, "search")
_TABLE = ("gait.turn_offset", *_BLOCKED, "rule.hold_time")
"""What the published table reads and a walk or an escape does not."""
_TURNING = tuple(path for path in _ESCAPE if path != "escape.turn_offset")
"""All of an escape but how it turns."""
_OTHER_ESCAPE = tuple(path for path in _TURNING if path.startswith("escape."))
"""What the search has in place of an escape: all but how fast it turns."""
_FELT = (
    *paths_of(RepetitionParams, "repetition"),
    *(f"escape.{name}" for name in ("trigger", "first_turn", "memory_time", "memory_delay")),
    *("escape.lost_time", "escape.return_time", "escape.retry_time"),
)
"""What an escape does not read where nothing is felt."""


def _without(read: tuple[str, ...], *others: str) -> tuple[str, ...]:
    """Parameters of the blind controllers but those that one of them reads, and others."""
    return (*_TABLE, *_SEARCH, *(path for path in _BLIND if path not in read), *others)


_MAP = ("escape.reverse_time", "escape.return_time", "escape.turn_offset")
"""Of an escape what `map` reads."""
UNREAD: Mapping[str, tuple[str, ...]] = {
    "open": (*_TABLE, *_ESCAPE, *_BLIND, *_SEARCH),
    "timed": _without(_TIMED, *_FELT),
    "paper": (*_ESCAPE, *_BLIND, *_SEARCH),
    "closed": (*_TABLE, *_BLIND, *_OTHER_ESCAPE),
    "closed-1": (*_TABLE, *_BLIND, *_SEARCH),
    BY_CONTACT: ("gait.turn_offset", "rule.hold_time", *_REPEATED, *_BLIND, *_SEARCH),
    "schedule": _without(_SCHEDULE, *_TURNING),
    "zigzag": _without(_ZIGZAG, *_TURNING),
    "random": _without(_RANDOM, *_TURNING),
    "map": (*_TABLE, *_BLIND, *_SEARCH, *(path for path in _ESCAPE if path not in _MAP)),
    TELEOP: (*_BLOCKED, "rule.hold_time", *_ESCAPE, *_BLIND, *_SEARCH),
}
"""Parameters of `ControlParams`, dotted, that a controller of ours does not read."""


def unread(name: str, control: ControlParams, knows: Sequence[str] = ()) -> set[str]:
    """Parameters of the control, dotted, that a controller does not read on any robot.

    A controller of one's own may read all.

    Args:
        name: The controller.
        control: All numbers of the control.
        knows: What a simulation tells it; a robot tells nothing.
    """
    by_contact = name == "closed-1" and control.escape.trigger == "contact"
    paths = set(UNREAD.get(BY_CONTACT if by_contact else name, ()))
    if name == "closed-1" and "jam" in knows:
        paths |= {"escape.trigger", *_REPEATED, *_BLOCKED}
    if name == "closed" and "jam" in knows:
        paths |= {"search.patience", *_REPEATED}
    if name == "timed" and "jam" in knows:
        paths |= set(_TIMED)
    if name == "timed" and {"facing", "map"} & set(knows):
        paths -= {"escape.return_time", *(["escape.lost_time"] if "facing" in knows else [])}
    return paths


def unread_by_all(
    names: Sequence[str], control: ControlParams, robot: RobotSpec, knows: Sequence[str] = ()
) -> dict[str, str]:
    """Parameters that none of these controllers reads, as `control.rule.strong`, and why."""
    who = f"{' and '.join(names)} {'does' if len(names) == 1 else 'do'} not read it"
    paths = set.intersection(*(unread(name, control, knows) for name in names))
    found = {f"control.{path}": who for path in sorted(paths)}
    return found | (unread_lift(robot, "control.gait") if set(names) <= set(UNREAD) else {})


def unread_lift(robot: RobotSpec, gait: str) -> dict[str, str]:
    """Parameters of the step of lifting legs that our gait does not read, and why.

    Args:
        robot: The robot that walks.
        gait: Where the gait stands in a configuration, dotted.
    """
    paths = () if robot.legs.kind == "lifting" else paths_of(LiftParams, f"{gait}.lift")
    return dict.fromkeys(paths, "legs that roll do not read it")
