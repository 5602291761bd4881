"""`antennate twin --servos` as a process of its own, for programs of other people."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager


class Served:
    """A running twin of servos.

    Attributes:
        path: Its bus.
    """

    def __init__(self, program: subprocess.Popen[str]) -> None:
        self._program = program
        assert program.stdout is not None
        self.path: str = json.loads(program.stdout.readline())["bus"]

    def order(self, text: str) -> str:
        """Give an order; what the twin says to it."""
        assert self._program.stdin is not None
        assert self._program.stderr is not None
        self._program.stdin.write(text + "\n")
        self._program.stdin.flush()
        return self._program.stderr.readline().strip()


@contextmanager
def served(servos: str, *more: str) -> Iterator[Served]:
    """Serve while the block runs; `more` begins with further servos, if there are any."""
    head = [sys.executable, "-m", "antennate", "twin", "--orders", "-"]
    command = [*head, "--servos", servos, *more]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as program:
        try:
            yield Served(program)
        finally:
            program.terminate()
            program.communicate()
