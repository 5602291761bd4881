"""Draw docs/images/replay.png: a drive of a twin, in invented time, and its log replayed.

Both antennae are touched in the dry run, the robot walks by `closed`, the board is silent for
half a second, and `paper` decides again upon the log.
"""

import shutil
import sys
import tempfile
from importlib import import_module
from pathlib import Path

from antennate.cli import main as antennate
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import prepare
from antennate.hardware.driving.drive import drive
from antennate.hardware.safety.session import Session
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.writer import LogWriter
from antennate.twin.config import TwinConfig, watched

sys.path.append(str(Path(__file__).parents[1] / "tests"))
lockstep, stated = import_module("lockstep"), import_module("stated")
PICTURE = Path(__file__).parent / "images" / "replay.png"
CONFIG = DriveConfig(robot=stated.stated(), dry_run=6.0, duration=18.0)
SILENT, AGAIN = 16.0, 16.5
"""Times from and to which the board is silent [s]."""


def log(path: Path) -> None:
    """Write the log of the drive."""
    robot, _ = watched(TwinConfig(touch=("left@1s", "right@3s"), trial=1))
    clock = lockstep.LockstepClock(robot)
    session = prepare(CONFIG, lockstep.BoardPort(robot, clock), clock, clock)
    header = Header(controller="closed", params=CONFIG.control, robot=CONFIG.robot)
    with LogWriter(path, header) as writer:

        def on_tick(session: Session, now: float) -> None:
            robot.board_silent = SILENT <= now < AGAIN
            writer.write(Tick.of(session, now))

        drive(session, CONFIG, arm=True, on_tick=on_tick)


def main() -> int:
    """Write the picture; return the exit status."""
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder) / "drive.mcap", Path(folder) / "replayed"
        log(path)
        status = antennate(["log", "replay", str(path), "--controller", "paper", "--out", str(out)])
        shutil.copyfile(out / "figures" / PICTURE.name, PICTURE)
    return status


if __name__ == "__main__":
    sys.exit(main())
