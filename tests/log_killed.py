"""Kills programs that write logs, at random times, and says what their logs hold.

Words: folder, number of kills, seed. Prints one JSON list of [ticks whose write had returned, ticks
read, ticks missing, damaged places, wrong ticks, time from the first lost tick to the kill] a kill.
"""

import itertools
import json
import os
import random
import signal
import struct
import sys
import time
from pathlib import Path

from log_ticks import HEADER, tick

from antennate.telemetry.reader import LogReader
from antennate.telemetry.writer import LogWriter

PERIOD = 0.01
_SAID = struct.Struct("<Qd")


def write(path: Path, said: int) -> None:
    """Write ticks at 100 Hz for ever; after each, say its number and the time before its write."""
    log = LogWriter(path, HEADER, least_free=0.0)
    os.write(said, _SAID.pack(0, time.monotonic()))
    start = time.monotonic()
    for number in itertools.count(1):
        time.sleep(max(0.0, start + PERIOD * number - time.monotonic()))
        now = time.monotonic()
        log.write(tick(number))
        os.write(said, _SAID.pack(number, now))


def killed(path: Path, wait: float) -> list[float]:
    """One kill."""
    heard, said = os.pipe()
    child = os.fork()
    if not child:
        write(path, said)
    os.close(said)
    came = os.read(heard, _SAID.size)
    time.sleep(wait)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    while more := os.read(heard, 1 << 16):
        came += more
    os.close(heard)
    times = dict(_SAID.iter_unpack(came[: len(came) // _SAID.size * _SAID.size]))
    last = max(times)
    with LogReader(path) as log:
        wrong = sum(one.pack() != tick(n).pack() for n, one in enumerate(log, 1))
        assert log.end is None
    lost = times[last] - times[log.ticks + 1] if log.ticks < last else 0.0
    return [last, log.ticks, log.missing, log.bad, wrong, lost]


def main() -> None:
    folder, count, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    chance = random.Random(seed)
    found = [killed(folder / f"{n}.log", chance.uniform(0, 1.0)) for n in range(count)]
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main()
