"""A configuration that records which of its parameters are read.

Checks of the configuration itself, and writing it down, do not count.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from antennate.control.climbing.controllers import climb
from antennate.control.climbing.rule import Stage
from antennate.control.registry import make_controller
from antennate.params.base import Params
from antennate.params.control import ControlParams
from antennate.robots.servos import ServosParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Controller


@contextmanager
def recorded(config: Params) -> Iterator[set[str]]:
    """Yield the dotted parameters of this configuration that are read within the block."""
    read: set[str] = set()
    held: dict[int, tuple[Params, tuple[str, ...], dict[str, str]]] = {}
    plain, copied = object.__getattribute__, Params.model_copy

    def watch(group: Params, path: tuple[str, ...]) -> None:
        fields = type(group).model_fields
        held[id(group)] = group, path, {name: ".".join((*path, name)) for name in fields}
        for name in fields:
            if isinstance(inner := plain(group, name), Params):
                watch(inner, (*path, name))

    def get(self: Params, name: str) -> Any:
        known = held.get(id(self))
        if known and name in known[2]:
            read.add(known[2][name])
        return plain(self, name)

    def copy(self: Params, **changes: Any) -> Any:
        new = copied(self, **changes)
        if id(self) in held:
            watch(new, held[id(self)][1])
        return new

    watch(config, ())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Params, "__getattribute__", get, raising=False)
        patch.setattr(Params, "model_copy", copy)
        yield read


def leaves(model: type[Params], path: tuple[str, ...] = ()) -> Iterator[str]:
    """Every parameter of a configuration, dotted."""
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, Params):
            yield from leaves(kind, (*path, name))
        else:
            yield ".".join((*path, name))


def tried(paths: set[str]) -> set[str]:
    """Those of them that a few runs can show: of the servo models the first three stand for all."""
    later = tuple(ServosParams.model_fields)[3:]
    return {path for path in paths if not any(f"servos.{name}." in path for name in later)}


def robot_for(name: str) -> RobotSpec:
    """A robot that a controller can walk."""
    return RobotSpec.named("scuttle3d" if name in ("climb", "lifted", "rhythm") else "scuttle")


def act(name: str, control: ControlParams, robot: RobotSpec) -> None:
    """Let a controller be pressed for longer than any of its times."""
    press(make_controller(name, control, robot, 1), control)


def press(controller: Controller, control: ControlParams) -> None:
    """Press a controller, with these numbers, for longer than any of its times."""
    controller.reset(np.zeros(1, dtype=np.int64))
    for tick in range(round(40.0 / control.period)):
        pressed = 1.0 < tick * control.period < 30.0
        counts = np.array([[1400.0 if pressed else 1870.0, 1410.0 if pressed else 1870.0]])
        controller.step(at_rest(tick * control.period, counts))


def at_rest(t: float, counts: np.ndarray) -> AntennaFrame:
    """The frame of a robot whose head does not move, at t [s]; counts of shape (1, 2)."""
    still, upwards = np.zeros((1, 3)), np.array([[0.0, 0.0, 9.81]])
    return AntennaFrame(np.array([t]), counts, angular_velocity=still, linear_acceleration=upwards)


def meet_ground(control: ControlParams, robot: RobotSpec) -> None:
    """Let `climb` meet all kinds of ground, and `lifted` and `rhythm` climb."""
    climb_all(control, robot)
    for name in ("lifted", "rhythm"):
        act(name, control, robot)


def climb_all(control: ControlParams, robot: RobotSpec) -> None:
    """Let `climb` meet low and high steps, drops with and without a floor, and walk on behind."""
    straight, floor, bent = 1870.0, 1745.0, 1500.0
    controller = climb(control, robot, 1)
    controller.reset(np.zeros(1, dtype=np.int64))
    rule: Any = controller.rule
    visits, before = Counter[int](), -1
    for tick in range(ticks := round(100.0 / control.period)):
        stage = int(rule.stage[0])
        visits[stage] += stage != before
        before, even = stage, visits[stage] % 2 == 0
        level = tick < 0.5 * ticks  # later it is stopped by what it climbs
        even &= level
        slipped = visits[stage] == 1 and controller.body.raised[0] > 0.3  # over a low step
        counts = {
            Stage.WALK: straight if even or (level and controller.body.climbs[0]) else bent,
            Stage.PROBE_UP: straight if slipped or visits[stage] == 2 else bent,
            Stage.PROBE_DOWN: straight if even else bent,
            Stage.CHECK: bent if visits[stage] == 2 else floor,
        }.get(Stage(stage), floor)
        controller.step(at_rest(tick * control.period, np.full((1, 2), counts)))
    rule.stage[0] = Stage.RETREAT  # as after a climb that failed
    controller.step(at_rest(0.0, np.full((1, 2), floor)))
