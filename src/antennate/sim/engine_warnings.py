"""Warnings of the engine, which it prints and writes to `MUJOCO_LOG.TXT`.

Commands and their workers drop them, as worlds read the engine's counters instead. In a program of
one's own they stay as they are, for models of one's own.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import Any

_dropping = [0]
"""How many hold on to that they are dropped."""


@contextlib.contextmanager
def dropped() -> Iterator[None]:
    """Drop them for a while, also if the engine is imported only then."""
    engine = _engine()
    before = engine.get_mju_user_warning() if engine is not None else None
    _dropping[0] += 1
    drop_if_asked()
    try:
        yield
    finally:
        _dropping[0] -= 1
        engine = _engine()
        if engine is not None:
            engine.set_mju_user_warning(before)


def drop_if_asked() -> None:
    """Drop them within `dropped`, once the engine is imported."""
    engine = _engine()
    if engine is not None and _dropping[0]:
        engine.set_mju_user_warning(lambda message: None)


def _engine() -> Any:
    """The engine if it is imported, and one that can be asked; None otherwise."""
    engine = sys.modules.get("mujoco")
    return engine if hasattr(engine, "get_mju_user_warning") else None
