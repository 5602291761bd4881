"""Which parameters of the control each controller of ours does not read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from antennate.params.base import paths_of
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
_SEARCH = paths_of(SearchParams, "search")
_OTHER_ESCAPE = tuple(
    path for path in paths_of(EscapeParams, "escape") if path != "escape.turn_offset"
)
"""What the search has in place of an escape: all but how fast it turns."""
UNREAD: Mapping[str, tuple[str, ...]] = {
    "open": ("gait.turn_offset", *_BLOCKED, "rule.hold_time", *_ESCAPE, *_SEARCH),
    "paper": (*_ESCAPE, *_SEARCH),
    "closed": ("gait.turn_offset", *_BLOCKED, "rule.hold_time", *_OTHER_ESCAPE),
    "closed-1": ("gait.turn_offset", *_BLOCKED, "rule.hold_time", *_SEARCH),
    BY_CONTACT: ("gait.turn_offset", "rule.hold_time", *_REPEATED, *_SEARCH),
    TELEOP: (*_BLOCKED, "rule.hold_time", *_ESCAPE, *_SEARCH),
}
"""Parameters of `ControlParams`, dotted, that a controller of ours does not read."""


def unread(name: str, control: ControlParams) -> set[str]:
    """Parameters of the control, dotted, that a controller does not read on any robot.

    A controller of one's own may read all.
    """
    by_contact = name == "closed-1" and control.escape.trigger == "contact"
    return set(UNREAD.get(BY_CONTACT if by_contact else name, ()))


def unread_by_all(names: Sequence[str], control: ControlParams, robot: RobotSpec) -> dict[str, str]:
    """Parameters that none of these controllers reads, as `control.rule.strong`, and why."""
    who = f"{' and '.join(names)} {'does' if len(names) == 1 else 'do'} not read it"
    paths = set.intersection(*(unread(name, control) for name in names))
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
