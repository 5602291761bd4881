"""How the script of a peer answers: a line of JSON for each line that it is asked."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

Job = tuple[Callable[[float], Any], dict[str, Any]]
"""What goes on for so many simulated seconds, and what is said of it: its size."""


def answer(version: str, make: Callable[[dict[str, Any]], dict[str, Job]]) -> None:
    """Do jobs until the other side ends; `make` takes our antenna and robot in numbers."""
    jobs = make(json.loads(sys.argv[1]))
    for line in sys.stdin:
        asked = json.loads(line)
        go_on, size = jobs[asked["job"]]
        before = time.process_time()
        go_on(asked["seconds"])
        taken = time.process_time() - before
        said = {"version": version, "cpu_s": taken, **size}
        sys.stdout.write(json.dumps(said) + "\n")
        sys.stdout.flush()
