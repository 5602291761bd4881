"""Kills programs that write logs, at random times, and says what their logs hold.

Words: folder, number of kills, seed. Prints one JSON list of [ticks whose write had returned, ticks
read, ticks missing, damaged places, wrong ticks] a kill.
"""

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

from log_ticks import HEADER, tick

from antennate.telemetry.reader import LogReader
from antennate.telemetry.writer import LogWriter

SHOWN = 50


def write(path: Path, said: int) -> None:
    """Write ticks for ever; say each one's number after its write."""
    log = LogWriter(path, HEADER, least_free=0.0)
    packed = [tick(number).pack() for number in range(1, SHOWN + 1)]
    os.write(said, bytes(8))
    number = 0
    while True:
        number += 1
        log.write(packed[number - 1] if number <= SHOWN else tick(number))
        os.write(said, number.to_bytes(8, "little"))


def killed(path: Path, wait: float) -> list[int]:
    """One kill."""
    heard, said = os.pipe()
    child = os.fork()
    if not child:
        write(path, said)
    os.close(said)
    came = os.read(heard, 8)
    time.sleep(wait)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    while more := os.read(heard, 1 << 16):
        came += more
    os.close(heard)
    with LogReader(path) as log:
        wrong = sum(one.pack() != tick(n).pack() for n, one in enumerate(log, 1))
        assert log.end is None
    return [int.from_bytes(came[-8:], "little"), log.ticks, log.missing, log.bad, wrong]


def main() -> None:
    folder, count, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    chance = random.Random(seed)
    found = [killed(folder / f"{n}.log", chance.uniform(0, 0.01)) for n in range(count)]
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main()
