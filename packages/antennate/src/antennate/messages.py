"""Wording of messages: one line, values as found, and a hint at the nearest valid choice."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from difflib import SequenceMatcher, get_close_matches
from typing import Any

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]+")
_LONGEST = 80
"""Most characters of a found value that are shown."""
_SIMILAR = 0.7
"""Least similarity of a word to the choice that is hinted at, from 0 to 1."""
_SIMILAR_END = 0.6
"""Least similarity of what follows the last dot of both, from 0 to 1."""


def one_line(text: str) -> str:
    """The text without line breaks and control characters."""
    return " ".join(_CONTROL.sub(" ", text).split())


def shortened(text: str) -> str:
    """The text on one line, cut if it is long; a text of blanks in quotes, so that it is seen."""
    text = one_line(text) or repr(text)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def ended_by(status: int) -> str:
    """How a process ended, by its return code as `subprocess` has it."""
    return f"was ended by signal {-status}" if status < 0 else f"ended with exit code {status}"


COMMAND_GROUPS = {
    "bench": ("wall", "touch", "sweep", "force"),
    "study": ("merge",),
    "setup": ("zero", "jog"),
    "drive": ("teleop",),
    "log": ("replay", "view"),
}
"""Commands that are typed behind the name of their group."""
_OF_ANTENNA = ("springs", "taper", "sensor", "ringdown")
FORMER = {
    f"{group}{part}": "`{antenna}` now, which does springs, taper, sensor and ring-down at once"
    for group in ("", "antenna ")
    for part in _OF_ANTENNA
} | dict.fromkeys(
    ("design", "study design"),
    'a plan of `{study}` now: plan = "optuna" in its file (docs/studies.md)',
)
"""Former commands, by what was typed, and what does their work now."""
_GROUP_OF = {name: group for group, names in COMMAND_GROUPS.items() for name in names}


def command_words(name: str) -> str:
    """A command as it is typed: its name, behind that of its group if it has one."""
    return f"{_GROUP_OF[name]} {name}" if name in _GROUP_OF else name


def command_of(words: Sequence[str]) -> str:
    """The name of the command that typed words begin with, empty if there are none."""
    name, part = [*words, "", ""][:2]
    return part if part in COMMAND_GROUPS.get(name, ()) else name


def without_group(name: str) -> str:
    """A command without its group, `wall` for `bench wall`; any other text as it is."""
    command = command_of(name.split())
    return command if command_words(command) == name else name


def typed(command: str, *words: str) -> str:
    """The words that a person types to run a command of this program, as it was called itself.

    `uv run` sets the variable UV for what it runs; there the command is `uv run antennate`.
    """
    program = ["uv", "run", "antennate"] if os.environ.get("UV") else ["antennate"]
    return shlex.join([*program, *command_words(command).split(), *words])


def former(words: Sequence[str]) -> str:
    """What is said of a command that another one does now; empty of any other words."""
    for name in (" ".join(words[:2]), " ".join(words[:1])):
        if name in FORMER:
            return (
                f"{name} is {FORMER[name].format(antenna=typed('antenna'), study=typed('study'))}"
            )
    return ""


INSTALLATION = "`pip install ./antennate/packages/*`, with the clone as ./antennate"
"""How to get all distributions of ours; it follows words such as `install it with`."""


def extra(name: str, package: str = "antennate") -> str:
    """How to get an extra of a package of ours; it follows words such as `install it with`."""
    return (
        f"`uv run --extra {name} antennate ...` in a clone, or, with the clone as ./antennate, by "
        f"`pip install ./antennate/packages/* './antennate/packages/{package}[{name}]'`"
    )


def shown(value: Any) -> str:
    """A value as Python writes it, in one short line."""
    return shortened(repr(value))


_RENAMED = {
    "arms": ("controllers", "profiles"),
    **dict.fromkeys(_OF_ANTENNA, ("antenna",)),
}
"""New names of what had another one in an earlier version."""
_GONE = ("solver",)
"""Parameters that are no more; all is done as with their defaults."""


def nearest(
    word: str, known: Iterable[str], former: Mapping[str, Sequence[str]] | None = None
) -> str:
    """A hint at the choice that was perhaps meant or at what to do instead, or nothing.

    A flag or key is also found by its last part: `--free-width` by `--tunnel.free-width`.

    Args:
        word: What was given.
        known: The valid choices.
        former: What choices were called in an earlier version, and their names of now.
    """
    choices = {choice.lstrip("-"): choice for choice in known}
    wanted = word.lstrip("-").lower()
    if wanted in _GONE:
        return " (it is gone: leave it out)"
    ends = [name for name in choices if name.endswith(f".{wanted}")]
    renamed = [name for name in (_RENAMED | dict(former or {})).get(wanted, ()) if name in choices]
    close = (
        renamed
        or ends[:2]
        or [
            name
            for name in get_close_matches(wanted, choices, n=1, cutoff=_SIMILAR)
            if SequenceMatcher(None, _last(wanted), _last(name)).ratio() >= _SIMILAR_END
        ]
    )
    return f" (did you mean {' or '.join(choices[name] for name in close)}?)" if close else ""


def _last(path: str) -> str:
    return path.rpartition(".")[2]
