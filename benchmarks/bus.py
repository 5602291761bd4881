"""Three masters of a servo bus under the same faults: ours, rustypot, and the manufacturer's SDK.

The twin's 19 servos stand behind a pseudo-terminal in a process of their own, at 1 Mbit/s and in
real time. Each master is asked for all positions, or for one; nothing is done but what it offers.

- one silent servo: time of a read of all 19 (median and worst), and values that it gives
- one of 100 answers lost: reads of all that give fewer values than 19, and values given
- one bad CRC a read: values given, wrong values, and values of the next read
- one answer 60 ms late: the servo is asked again and again while its position changes;
  answers that are not what the servo said to that request
- an exception in the middle of a request (a signal): values of the next read of all

rustypot's timeout is a choice of its caller, here the 10 ms that ours is given for a read of all.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import signal
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from dynamixel_bus.answers import POSITION, Answer, Timing, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.faults import Fault, Trouble
from dynamixel_bus.models import XC430_W240, XL330_M288
from dynamixel_bus.ports import SerialPort
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus

IDS = tuple(range(1, 20))
BAUD = 1_000_000
BUDGET = 0.010
"""Time for a read of all [s]."""
LATE = 0.060
"""Delay of a late answer [s]: longer than each of the three waits."""
PAUSE = 0.15
"""After this time nothing late can come any more [s]."""
ONE = 7
"""The servo that is in trouble."""


def serve(pipe: Connection) -> None:
    """The twin in a process of its own: says its path, then does what it is told until None."""
    servos = [Servo(XC430_W240 if i <= 17 else XL330_M288, i, 100.0 * i) for i in IDS]
    for servo in servos:
        servo.set("return_delay_time", 0)
    sys.path.append(str(Path(__file__).parents[1] / "packages" / "dynamixel-bus" / "tests"))
    server_of = import_module("pty_server").PtyServer
    with server_of(ServoBus(servos)) as server:
        pipe.send(server.path)
        while (order := pipe.recv()) is not None:
            what, value = order
            with server.lock:
                if what == "trouble":
                    server.bus.trouble = value
                elif what == "loss":
                    server.bus.loss = value
                else:
                    servos[ONE - 1].place(value)
            pipe.send(what)


class Twin:
    """The process with the servos, seen from here."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs,), daemon=True)
        self._process.start()
        self.path: str = self._pipe.recv()

    def tell(self, what: str, value: Any) -> None:
        """Change something, and wait until it is so."""
        self._pipe.send((what, value))
        self._pipe.recv()

    def end(self) -> None:
        self._pipe.send(None)
        self._process.join()


class Master(Protocol):
    """What is asked of each of the three."""

    def all(self) -> dict[int, int]:
        """Positions of those that answered [ticks]."""
        ...

    def one(self, servo: int) -> int | None:
        """Position of one [ticks]; None if it did not answer."""
        ...

    def close(self) -> None: ...


class Ours:
    """`dynamixel_bus`."""

    def __init__(self, path: str) -> None:
        self._line = SerialPort(path, BAUD)
        self._bus = Bus(self._line, Timing(BAUD))

    def all(self) -> dict[int, int]:
        said = self._bus.read_all(IDS, POSITION, BUDGET)
        return {i: p for i, a in said.items() if (p := self._position(a)) is not None}

    def one(self, servo: int) -> int | None:
        return self._position(self._bus.read(servo, POSITION))

    @staticmethod
    def _position(said: Answer) -> int | None:
        return int.from_bytes(said.data, "little") if isinstance(said, Value) else None

    def close(self) -> None:
        self._line.close()


class Rustypot:
    """Its controller of XL430 servos, whose registers are those of the twin's."""

    def __init__(self, path: str) -> None:
        made = import_module("rustypot").Xl430PyController(path, BAUD, BUDGET)
        made.set_fast_sync_read(True)
        self._controller: Any = made

    def all(self) -> dict[int, int]:
        try:
            read = self._controller.sync_read_raw_data(list(IDS), 132, 4)
        except RuntimeError:
            return {}
        return {i: int.from_bytes(bytes(p), "little") for i, p in zip(IDS, read, strict=True)}

    def one(self, servo: int) -> int | None:
        try:
            return int.from_bytes(bytes(self._controller.read_raw_data(servo, 132, 4)), "little")
        except RuntimeError:
            return None

    def close(self) -> None:
        self._controller.close()


class Sdk:
    """The manufacturer's program."""

    def __init__(self, path: str) -> None:
        sdk: Any = import_module("dynamixel_sdk")
        self._port = sdk.PortHandler(path)
        self._port.openPort()
        self._port.setBaudRate(BAUD)
        self._handler = sdk.PacketHandler(2.0)
        self._good = sdk.COMM_SUCCESS
        self._group = sdk.GroupSyncRead(self._port, self._handler, 132, 4)
        for servo in IDS:
            self._group.addParam(servo)

    def all(self) -> dict[int, int]:
        if self._group.fastSyncRead() != self._good:
            return {}  # its group would go on to give the values of an older read
        there = [i for i in IDS if self._group.isAvailable(i, 132, 4)]
        return {i: self._group.getData(i, 132, 4) for i in there}

    def one(self, servo: int) -> int | None:
        position, result, _ = self._handler.read4ByteTxRx(self._port, servo, 132)
        return position if result == self._good else None

    def close(self) -> None:
        self._port.closePort()


MASTERS: dict[str, Callable[[str], Master]] = {"ours": Ours, "rustypot": Rustypot, "sdk": Sdk}


@dataclass(slots=True)
class Found:
    """How one master did; times in ms, counts of values and reads."""

    silent_ms: float = 0.0
    silent_worst_ms: float = 0.0
    silent_values: float = 0.0
    loss_reads_short: float = 0.0
    loss_values: float = 0.0
    crc_values: float = 0.0
    crc_wrong: int = 0
    crc_next: float = 0.0
    late_asked: int = 0
    late_stale: int = 0
    after_exception: int = 0


class Boom(Exception):
    """Raised by a signal in the middle of a request."""


def boom(number: int, frame: object) -> None:
    raise Boom


TRUE = {i: 100 * i for i in IDS}


def settled(master: Master) -> int:
    """True values of a read of all once everything late has come; of three tries the best."""
    time.sleep(PAUSE)
    return max(len(master.all().items() & TRUE.items()) for _ in range(3))


def silent(twin: Twin, master: Master, reads: int, found: Found) -> None:
    twin.tell("trouble", {ONE: Trouble(Fault.SILENT)})
    times, values = [], []
    for _ in range(reads):
        begin = time.perf_counter()
        values.append(len(master.all()))
        times.append(1e3 * (time.perf_counter() - begin))
    twin.tell("trouble", {})
    found.silent_ms, found.silent_worst_ms = statistics.median(times), max(times)
    found.silent_values = statistics.mean(values)


def lossy(twin: Twin, master: Master, reads: int, found: Found) -> None:
    twin.tell("loss", 0.01)
    values = [len(master.all()) for _ in range(4 * reads)]
    twin.tell("loss", 0.0)
    found.loss_reads_short = statistics.mean(v < len(IDS) for v in values)
    found.loss_values = statistics.mean(values)


def broken(twin: Twin, master: Master, reads: int, found: Found) -> None:
    rng = np.random.default_rng(3)
    values, following = [], []
    for _ in range(reads):
        hurt = int(rng.integers(1, 20))
        twin.tell("trouble", {hurt: Trouble(Fault.BAD_CRC, count=1)})
        got = master.all()
        values.append(len(got))
        found.crc_wrong += sum(TRUE[i] != p for i, p in got.items())
        twin.tell("trouble", {})
        following.append(len(master.all()))
    found.crc_values, found.crc_next = statistics.mean(values), statistics.mean(following)


def late(twin: Twin, master: Master, reads: int, found: Found) -> None:
    for _ in range(reads):
        twin.tell("trouble", {ONE: Trouble(Fault.LATE, LATE, count=1)})
        end = time.perf_counter() + PAUSE
        n = 0
        while time.perf_counter() < end:
            n += 1
            twin.tell("place", 1000 + n)
            position = master.one(ONE)
            found.late_asked += 1
            found.late_stale += position is not None and position != 1000 + n
    twin.tell("trouble", {})
    twin.tell("place", TRUE[ONE])


def interrupted(twin: Twin, master: Master, found: Found) -> None:
    twin.tell("trouble", {ONE: Trouble(Fault.LATE, 0.008, count=1)})
    usual = signal.signal(signal.SIGALRM, boom)
    signal.setitimer(signal.ITIMER_REAL, 0.004)
    try:
        master.one(ONE)
        signal.pause()
    except Boom:
        pass
    signal.signal(signal.SIGALRM, usual)
    twin.tell("trouble", {})
    found.after_exception = settled(master)


def measure(name: str, reads: int) -> Found:
    """All rows for one master."""
    twin = Twin()
    master = MASTERS[name](twin.path)
    found = Found()
    master.all()
    for row in (silent, lossy, broken, late):
        row(twin, master, reads, found)
        settled(master)
    interrupted(twin, master, found)
    master.close()
    twin.end()
    return found


ROWS: dict[str, Callable[[Found], str]] = {
    "B1 one silent servo: time of a read of 19, median (worst)": lambda f: (
        f"{f.silent_ms:.1f} ({f.silent_worst_ms:.1f}) ms"
    ),
    "B1 values of 18": lambda f: f"{f.silent_values:.1f}",
    "B2 1 % of answers lost: values of 19": lambda f: f"{f.loss_values:.2f}",
    "B2 reads that lack a value": lambda f: f"{100 * f.loss_reads_short:.0f} %",
    "B3 one bad CRC: values of 19, wrong ones": lambda f: f"{f.crc_values:.1f}, {f.crc_wrong}",
    "B3 values of the next read": lambda f: f"{f.crc_next:.1f}",
    "B4 an answer late by 60 ms: stale values taken": lambda f: f"{f.late_stale} of {f.late_asked}",
    "B5 after an exception in a request: values of 19": lambda f: f"{f.after_exception}",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--reads", type=int, default=50, help="reads a row")
    options = parser.parse_args()
    found = {name: measure(name, options.reads) for name in MASTERS}
    if options.json:
        print(json.dumps({name: asdict(f) for name, f in found.items()}, indent=2))
        return
    print("|", " | ".join(["", *found]), "|")
    print("|---" * (len(found) + 1) + "|")
    for row, said in ROWS.items():
        print("|", " | ".join([row, *map(said, found.values())]), "|")


if __name__ == "__main__":
    main()
