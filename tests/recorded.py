"""A configuration that records which of its parameters are read.

Checks of the configuration itself, and writing it down, do not count.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from antennate.control.registry import make_controller
from antennate.params.base import Params
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Controller


@contextmanager
def recorded(config: Params) -> Iterator[set[str]]:
    """Yield the dotted parameters of this configuration that are read within the block."""
    read: set[str] = set()
    held: dict[int, tuple[Params, tuple[str, ...]]] = {}
    plain, copied = object.__getattribute__, Params.model_copy

    def watch(group: Params, path: tuple[str, ...]) -> None:
        held[id(group)] = group, path
        for name in type(group).model_fields:
            if isinstance(inner := plain(group, name), Params):
                watch(inner, (*path, name))

    def get(self: Params, name: str) -> Any:
        if id(self) in held and name in type(self).model_fields:
            read.add(".".join((*held[id(self)][1], name)))
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


def act(name: str, control: ControlParams, robot: RobotSpec) -> None:
    """Let a controller be pressed for longer than any of its times."""
    press(make_controller(name, control, robot, 1), control)


def press(controller: Controller, control: ControlParams) -> None:
    """Press a controller, with these numbers, for longer than any of its times."""
    controller.reset(np.zeros(1, dtype=np.int64))
    for tick in range(round(60.0 / control.period)):
        pressed = 1.0 < tick * control.period < 35.0
        counts = np.array([[1400.0 if pressed else 1870.0, 1410.0 if pressed else 1870.0]])
        controller.step(AntennaFrame(t=np.array([tick * control.period]), counts=counts))
