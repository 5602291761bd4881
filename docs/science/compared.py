"""False alarms of `antennate doctor --compare`: `python docs/science/compared.py`.

The default robot with an inertial sensor goes through the protocol `check` as in `identified.py`,
once for each seed of the noise of its sensors. Each log is compared with the robot's own file,
whose intervals are as narrow as a fit makes them, those of its floor. Each joint that is not as
fitted is a false alarm, and is printed.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from tempfile import TemporaryDirectory

from identified import CONTROL, KNOWN, record

from antennate.control.protocol import Protocol
from antennate_lab.fit import compare
from antennate_lab.fit.estimates import LEVEL, ROUNDING, SHARE, SHORTEST

TABLE = '[[fitted]]\nname = "{}"\nlow = {!r}\nhigh = {!r}\nsource = "its own numbers"\n'


def own_file() -> str:
    """Text of the robot's file with its own numbers in `[[fitted]]`."""
    share = LEVEL / math.sqrt(3.0)
    ends: dict[str, tuple[float, float]] = {}
    for name in dict.fromkeys(KNOWN.servo_names):
        servo = KNOWN.servos.of(name)
        wide = 1.0 + share * SHARE
        ends[f"servos.{name}.gain_divisor"] = servo.gain_divisor / wide, servo.gain_divisor * wide
        ends[f"servos.{name}.delay"] = 0.0, max(servo.delay + share * SHORTEST, SHORTEST)
        half = share * ROUNDING * servo.stiffness
        ends[f"servos.{name}.friction"] = max(servo.friction - half, 0.0), servo.friction + half
    for at in range(KNOWN.yaw_count):
        ends[f"yaw.backlash[{at}]"] = 0.0, share * ROUNDING
    tables = [TABLE.format(name, *pair) for name, pair in ends.items()]
    return "\n".join(['imu = { kind = "head" }\n', *tables])


def main() -> None:
    """Compare, and count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=range(6))
    options = parser.parse_args()
    alarms = joints = notes = 0
    with TemporaryDirectory() as folder:
        file = Path(folder) / "robot.toml"
        file.write_text(own_file(), encoding="utf-8")
        protocol = Protocol.named("check").made_for(KNOWN, CONTROL)
        for seed in options.seeds:
            log = Path(folder) / f"check-{seed}.mcap"
            record(KNOWN, protocol, log, seed)
            for row in compare.rows(file, log)[1:]:
                joints, notes = joints + 1, notes + (row.grade == "note")
                if row.grade == "warn":
                    alarms += 1
                    print(f"seed {seed}, {row.check}: expected {row.expected}; found {row.found}")
    print(f"{alarms} false alarms of {joints} joints, {notes} not compared in full")


if __name__ == "__main__":
    main()
