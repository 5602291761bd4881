"""A program that drives twin servos at 100 Hz over a serial line until it is killed."""

from __future__ import annotations

import sys
import time

from antennate.dxl.answers import MOTION, Timing
from antennate.dxl.bus import Bus
from antennate.hardware.ports.serial_line import SerialPort
from antennate.hardware.safety import torque

IDS = range(1, 20)


def main(path: str) -> None:
    bus = Bus(SerialPort(path, 1_000_000), Timing(gap=0.02))
    torque.enable(bus, IDS)
    torque.arm_watchdogs(bus, IDS)
    far = {i: (4000).to_bytes(4, "little") for i in IDS}
    while True:
        bus.write_all(116, far)
        bus.read_all(IDS, MOTION)
        sys.stdout.write("cycle\n")
        sys.stdout.flush()
        time.sleep(0.01)


if __name__ == "__main__":
    main(sys.argv[1])
