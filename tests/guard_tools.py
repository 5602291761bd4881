"""A guard, and how to switch one off: by one small change of the library."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from antennate.hardware.safety.supervisor import Outputs, Supervisor
from antennate.params.base import Params

Patch = pytest.MonkeyPatch
Off = Callable[[Patch], None]


@dataclasses.dataclass(frozen=True)
class Guard:
    """One guard.

    Attributes:
        name: What it guards against.
        off: Switches it off.
        notice: A test that fails without it.
        by: How it fails.
    """

    name: str
    off: Off
    notice: Callable[[], Any]
    by: tuple[type[BaseException], ...] = (AssertionError, pytest.fail.Exception)


def runs_by_itself(notice: Callable[[], Any]) -> bool:
    """Whether this is a test, or one of its cases, that every run of the suite has."""
    test = notice.func if isinstance(notice, partial) else notice
    words = notice.args if isinstance(notice, partial) else ()
    if not test.__name__.startswith("test_"):
        return False
    given = inspect.signature(test).bind_partial(*words).arguments
    for mark in getattr(test, "pytestmark", ()):
        if mark.name != "parametrize":
            return False
        names, cases = mark.args
        if isinstance(names, str):
            names, cases = [names], [case if _marked(case) else (case,) for case in cases]
        wanted = tuple(given.pop(name, None) for name in names)
        if wanted not in [tuple(case) for case in cases if not _marked(case)]:
            return False
    return not given


def _marked(case: Any) -> bool:
    return bool(getattr(case, "marks", ()))


def put(target: Any, name: str, value: Any) -> Off:
    """Replace one thing."""
    return lambda patch: patch.setattr(target, name, value)


def given(place: Any, kind: type[Params], **values: Any) -> Off:
    """Give a module's objects other parameters, beyond their limits too."""

    def made(**known: Any) -> Params:
        return kind(**known).model_copy(update=values)

    return put(place, kind.__name__, made)


def together(*offs: Off) -> Off:
    """Several changes."""

    def off(patch: Patch) -> None:
        for each in offs:
            each(patch)

    return off


def around(target: Any, name: str, wrap: Callable[..., Any]) -> Off:
    """Replace a function by one that is given it first."""
    return lambda patch: patch.setattr(target, name, partial_method(wrap, getattr(target, name)))


def partial_method(wrap: Callable[..., Any], old: Callable[..., Any]) -> Callable[..., Any]:
    def wrapped(*args: Any, **kwargs: Any) -> Any:
        return wrap(old, *args, **kwargs)

    return wrapped


def blind(**seen: Any) -> Off:
    """A supervisor to which something always looks well; "now" stands for the time."""

    def step(old: Any, self: Supervisor, now: float, inputs: Any) -> Outputs:
        known = {key: now if value == "now" else value for key, value in seen.items()}
        return old(self, now, dataclasses.replace(inputs, **known))

    return around(Supervisor, "step", step)


def before(target: Any, name: str, prepare: Callable[..., None]) -> Off:
    """Do something first whenever a method is called."""

    def wrap(old: Any, self: Any, *args: Any, **kwargs: Any) -> Any:
        prepare(self, *args, **kwargs)
        return old(self, *args, **kwargs)

    return around(target, name, wrap)


def after(target: Any, name: str, change: Callable[..., None]) -> Off:
    """Do something whenever a method has been called."""

    def wrap(old: Any, self: Any, *args: Any, **kwargs: Any) -> Any:
        result = old(self, *args, **kwargs)
        change(self, *args, **kwargs)
        return result

    return around(target, name, wrap)


def constant(value: Any) -> Callable[..., Any]:
    return lambda *args, **kwargs: value
