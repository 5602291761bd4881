"""A program that drives twin servos at 100 Hz over a serial line until it is killed."""

from __future__ import annotations

import sys
import time

from dynamixel_bus.answers import MOTION, Timing
from dynamixel_bus.bus import Bus
from dynamixel_bus.ports import SerialPort

IDS = range(1, 20)
TORQUE, GOAL, WATCHDOG = 64, 116, 98


def main(path: str) -> None:
    bus = Bus(SerialPort(path, 1_000_000), Timing(gap=0.02))
    bus.write_all(TORQUE, dict.fromkeys(IDS, b"\1"))
    bus.write_all(WATCHDOG, dict.fromkeys(IDS, b"\5"))  # 100 ms
    far = {i: (4000).to_bytes(4, "little") for i in IDS}
    while True:
        bus.write_all(GOAL, far)
        bus.read_all(IDS, MOTION)
        sys.stdout.write("cycle\n")
        sys.stdout.flush()
        time.sleep(0.01)


if __name__ == "__main__":
    main(sys.argv[1])
