"""Keys of the terminal, each as it comes: without Enter, and without showing them."""

from __future__ import annotations

import contextlib
import os
import select
import sys
from collections.abc import Callable, Iterator

from antennate.cli.keys import single_keys
from antennate.errors import ConfigError

_MOST = 1024


@contextlib.contextmanager
def pressed_keys(flag: str) -> Iterator[Callable[[], bool]]:
    r"""Yield a function that says, without waiting, whether a key came since its last call.

    Ctrl-C, Ctrl-\ and Ctrl-Z do what they always do. The terminal is as before afterwards.

    Args:
        flag: What needs the keys, for the error.

    Raises:
        ConfigError: Standard input is no terminal, or another program has it.
    """
    stdin = sys.stdin
    if stdin is None or not stdin.isatty():
        raise ConfigError(
            f"{flag}: expected a terminal as standard input, whose keys can be held, found none"
        )
    handle = stdin.fileno()
    if os.tcgetpgrp(handle) != os.getpgrp():
        raise ConfigError(f"{flag}: expected to run in the foreground of its terminal, without &")
    with single_keys(handle):
        yield lambda: _came(handle)


def _came(handle: int) -> bool:
    """Whether something was typed; nothing comes from a terminal that is gone."""
    try:
        return bool(select.select([handle], [], [], 0.0)[0]) and bool(os.read(handle, _MOST))
    except OSError:
        return False
