"""Whether the loop of `antennate drive` keeps its pace, alone and beside busy processes.

Twin and loop run on the same machine over two pseudo-terminals, in real time: dry run with a touch
of both antennae, then a walk. A cycle is missed if the loop still runs when the next one is due.

- `missed_share`: cycles missed of all of the drive, those included that arming takes on the bus.
- `walking_missed_share`: the same from the first command on.
- `worst_lateness_ms`: farthest that a tick began behind its time.
- `fault`: causes of a FAULT or worse with their details, the first one first; empty without one.
- `ended`, `walked_s`: why the drive ended, and after which time of walking [s].

`--crossings 10` walks that many trials of `--seed` as far as the exit, in place of the rest.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

PROGRAM = [sys.executable, "-c", "import sys; from antennate.cli import main; sys.exit(main())"]
BUSY = [sys.executable, "-c", "while True: sum(range(10_000))"]
VIEWER = """
import sys
from pathlib import Path
from antennate.errors import LogError
from antennate.telemetry.reader import LogReader
while True:
    try:
        with LogReader(Path(sys.argv[1])) as log:
            for tick in log:
                pass
    except LogError:  # it has not begun yet
        pass
"""
"""Reads the growing log again and again, without a pause."""
TOUCH = ("left@4s", "right@6s")
DRY_RUN = 7.0
"""Time that both touches take [s]."""


@contextmanager
def running(words: list[str], **how: Any) -> Iterator[subprocess.Popen[str]]:
    """A process that is ended afterwards."""
    process = subprocess.Popen(words, text=True, **how)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def walk(
    seconds: float,
    busy: int,
    viewers: int = 0,
    trial: tuple[int, int] | None = None,
    more: Sequence[str] = (),
) -> dict[str, Any]:
    """One drive against a twin of its own, with more words; the content of its result.json.

    With a `trial`, its seed and its number, the drive ends once the head passes the exit.
    """
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        robot, until = str(folder / "twin.toml"), str(folder / "passed")
        twin = [*PROGRAM, "twin", "--touch", *TOUCH, "--robot-toml", robot]
        if trial is not None:
            twin += ["--seed", str(trial[0]), "--trial", str(trial[1]), "--passed", until]
        pipe, quiet = subprocess.PIPE, subprocess.DEVNULL
        server = stack.enter_context(running(twin, stdout=pipe, stderr=quiet))
        assert server.stdout is not None
        server.stdout.readline()  # it is ready
        for _ in range(busy):
            stack.enter_context(running(BUSY))
        for _ in range(viewers):
            log = str(folder / "run" / "drive.mcap")
            stack.enter_context(running([sys.executable, "-c", VIEWER, log]))
        words = [*PROGRAM, "drive", "--config", robot, "--arm"]
        words += ["--json", "--out", str(folder / "run")]
        words += ["--dry-run", str(DRY_RUN), "--duration", str(seconds), *more]
        words += [] if trial is None else ["--until", until]
        subprocess.run(words, stdout=quiet, stderr=quiet, check=False)
        result = folder / "run" / "result.json"
        return json.loads(result.read_text()) if result.exists() else {}


def summary(result: dict[str, Any]) -> dict[str, Any]:
    """What counts of one drive."""
    pace, walking = result.get("pace"), result.get("walking")
    fault = result["why"] if result.get("worst_state") in ("FAULT", "OFF") else ""
    if pace is None or walking is None:
        why = result.get("why") or result.get("refusal") or "no result"
        return {"walked": False, "fault": fault, "why": why}
    return {
        "walked": True,
        "fault": fault,
        "missed_share": pace["missed_share"],
        "walking_missed_share": walking["missed_share"],
        "worst_lateness_ms": 1e3 * pace["worst_lateness_s"],
        "missed_answers": result["missed_answers"],
        "ended": result["ended"],
        "walked_s": result["walked_s"],
        "worst_state": result["worst_state"],
        "why": result["why"],
        "torque_off": result["torque_off"],
        "priority": result["priority"],
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0, help="time of each walk")
    parser.add_argument("--busy", type=int, nargs="*", default=[0, 4], help="busy processes beside")
    parser.add_argument("--viewers", type=int, nargs="*", default=[], help="viewers of the log")
    parser.add_argument("--crossings", type=int, default=0, help="trials to walk to the exit")
    parser.add_argument("--seed", type=int, default=0, help="of those trials")
    parser.add_argument("--json", action="store_true", help="print one JSON object and no table")
    args = parser.parse_args()
    if args.crossings:
        trials = [(args.seed, number) for number in range(args.crossings)]
        rows = {f"trial_{one[1]}": summary(walk(args.seconds, 0, trial=one)) for one in trials}
    else:
        rows = {f"busy_{count}": summary(walk(args.seconds, count)) for count in args.busy}
        viewed = {count: walk(args.seconds, 0, count) for count in args.viewers}
        rows |= {f"viewers_{count}": summary(found) for count, found in viewed.items()}
    result = {"cores": os.cpu_count(), "seconds": args.seconds, **rows}
    if args.json:
        print(json.dumps(result))
        return
    print(f"{os.cpu_count()} cores, {args.seconds:g} s of walking each")
    for name, row in rows.items():
        print(f"{name}: " + ", ".join(f"{key} {_shown(value)}" for key, value in row.items()))


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    main()
