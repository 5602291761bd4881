"""`antennate drive` and `antennate twin` as they are shipped: two processes, and what is left."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from antennate.telemetry.reader import count

ANTENNATE = [sys.executable, "-c", "import sys; from antennate.cli import main; sys.exit(main())"]
FAULTS = (("reset", 5.0), ("reset", 10.5), ("open_left", 12.5))
"""What happens to the board, and when [s]: in the dry run, while walking, and at its end."""
DRY_RUN, WALK = 5.0, 6.0
"""How long they last [s]."""
START = 1.5
"""Time in which a twin is ready on an idle machine [s]; faults come later where it takes longer."""


@dataclass(frozen=True)
class Drive:
    """What a drive left behind."""

    code: int
    lines: list[str]
    folder: Path

    @property
    def result(self) -> dict[str, Any]:
        return json.loads((self.folder / "result.json").read_text())

    def status(self, cause: str) -> list[str]:
        """Lines of its status that name a cause."""
        return [line for line in self.lines if f" {cause}: " in line and " maneuver=" in line]


@contextmanager
def twin(faults: Iterable[tuple[str, float]] = ()) -> Iterator[list[str]]:
    """A twin; the arguments that lead to it."""
    asked = [word for what, t in faults for word in ("--fault", f"esp32={what}@{t:.2f}s")]
    with subprocess.Popen(
        [*ANTENNATE, "twin", *asked], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdout is not None
        places = json.loads(process.stdout.readline())
        try:
            yield ["--esp32", places["esp32"], "--bus", places["bus"]]
        finally:
            process.send_signal(signal.SIGTERM)


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    """A drive with all the faults."""
    began = time.monotonic()
    with twin():
        later = 3.0 * max(0.0, time.monotonic() - began - START)
    folder = tmp_path_factory.mktemp("drive") / "run"
    words = ["drive", "--arm", "--no-touch-check", "--out", str(folder)]
    words += ["--dry-run", f"{DRY_RUN + later}", "--duration", f"{WALK + later}"]
    first, *others = FAULTS
    faults = [(first[0], first[1] + later), *((what, t + 2 * later) for what, t in others)]
    with twin(faults) as places:
        run = subprocess.run(
            [*ANTENNATE, *words, *places], capture_output=True, text=True, check=False
        )
    return Drive(run.returncode, run.stderr.splitlines(), folder)


def test_E1_a_reset_or_a_broken_wire_ends_no_drive(driven: Drive) -> None:
    """It goes to its end, torque off, with its result and every tick in its log."""
    result = driven.result
    assert driven.code == 0, driven.lines[-5:]
    assert driven.lines[-1] == f"written to {driven.folder}"
    assert not any("Traceback" in line for line in driven.lines)
    assert result["worst_state"] == "HOLD"
    assert result["torque_off"] is True
    assert result["resets"] == 2
    assert result["lost_samples"] < 100
    assert (result["unlogged"], result["log_complete"]) == (0, True)
    assert count(driven.folder / result["logs"][0]) == result["pace"]["ticks"]
    assert " HOLD (OPEN: a channel floats: its wire is open" in driven.lines[-2]
    assert result["poses_sent"] > 150  # it walked on after the reset
