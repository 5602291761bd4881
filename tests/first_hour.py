"""Commands as processes: a twin that takes orders, and a person who does what is asked."""

from __future__ import annotations

import json
import os
import re
import select
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType

ANTENNATE = [sys.executable, "-c", "import sys; from antennate.cli import main; sys.exit(main())"]
_PATIENCE = 90.0
"""Longest silence of a command [s]; the machine may be busy."""


def start(words: Sequence[str], folder: Path) -> subprocess.Popen[bytes]:
    """A command of `antennate` in a folder, all its streams piped."""
    pipe = subprocess.PIPE
    return subprocess.Popen([*ANTENNATE, *words], stdin=pipe, stdout=pipe, stderr=pipe, cwd=folder)


class OrderedTwin:
    """`antennate twin` that takes orders on its standard input.

    Args:
        words: Its words, the command's name first.
        folder: Where it runs.
    """

    def __init__(self, words: Sequence[str], folder: Path) -> None:
        self._process = start(words, folder)
        assert self._process.stdout is not None
        self.paths: dict[str, str] = json.loads(self._process.stdout.readline())

    def order(self, text: str) -> str:
        """One order; what the twin says to it."""
        process = self._process
        assert process.stdin is not None
        assert process.stderr is not None
        process.stdin.write(text.encode() + b"\n")
        process.stdin.flush()
        said = process.stderr.readline().decode().strip()
        assert said == text, said
        return said

    def __enter__(self) -> OrderedTwin:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._process.terminate()
        self.said = self._process.communicate(timeout=30)[1].decode()


class Command:
    """A command with scripted standard input.

    Attributes:
        words: Its words behind `antennate`.
        text: All that it said on stderr.
        output: All that it wrote on stdout; once it has ended.
    """

    def __init__(self, words: Sequence[str], folder: Path) -> None:
        self.words = list(words)
        self._process = start(words, folder)
        self.text = self.output = ""
        self._read = 0

    def until(self, pattern: str) -> re.Match[str]:
        """What it says next that matches; all before that is read."""
        assert self._process.stderr is not None
        end = time.monotonic() + _PATIENCE
        while not (found := re.compile(pattern).search(self.text, self._read)):
            assert time.monotonic() < end, f"{pattern!r} was never said: {self.text[-2000:]}"
            if select.select([self._process.stderr], [], [], 1.0)[0]:
                data = os.read(self._process.stderr.fileno(), 65536)
                assert data, f"{pattern!r} was never said: {self.text[-2000:]}"
                self.text += data.decode()
        self._read = found.end()
        return found

    def type(self, text: str = "\n") -> None:
        """Type on its standard input."""
        assert self._process.stdin is not None
        self._process.stdin.write(text.encode())
        self._process.stdin.flush()

    def end(self, patience: float = _PATIENCE) -> int:
        """Wait for its end, at most so long [s]: the exit code."""
        out, err = self._process.communicate(timeout=patience)
        self.output, self.text = out.decode(), self.text + err.decode()
        return self._process.returncode


def plug_in(command: Command, ports: dict[str, tuple[Path, str]]) -> None:
    """Unplug and plug in each adapter when asked.

    Args:
        command: `setup`.
        ports: A link for each that is asked for, and what it leads to.
    """
    for what, (link, target) in ports.items():
        command.until(f"unplug the {what}")
        link.unlink()
        command.type()
        command.until("plug it in again")
        link.symlink_to(target)
        command.type()


def connect_each(command: Command, order: Callable[[str], object], names: Sequence[str]) -> None:
    """Connect the servo of each joint when asked, then all of them."""
    for name in names:
        command.until(rf"connect the servo of {name} ")
        order(f"only {name}")
        time.sleep(0.4)  # it starts for a quarter second
        command.type()
        command.until(f"{name} is set up, read back")
    command.until("connect all servos")
    order("plug all")
    time.sleep(0.4)
    command.type()


def move_each(command: Command, order: Callable[[str], object], names: Sequence[str]) -> None:
    """Hold the robot straight, then move each joint as asked."""
    command.until("hold (the robot straight|the antenna at its mounting angle)")
    order("push all=0deg")
    time.sleep(0.8)
    command.type()
    for name in names:
        command.until(rf"\d+ of \d+: {name}: ")
        order(f"push {name}=20deg")
        command.until(f"{name}: direction")
