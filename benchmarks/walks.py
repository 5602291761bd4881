"""How many files a reader passes through: `python benchmarks/walks.py [--files]`.

Three walks through our packages, by what Python really enters (`sys.setprofile`):

- *tick*: one tick of `drive` before the twin in lock-step, from a reading to the goals of all
  servos; what stands behind the two ports is left out;
- *trial*: one trial of `tunnel`, from its seed to its row;
- *command*: `tunnel` from its words to its table; the trial is left out.

Of each it prints the distinct files and folders, and how many functions of ours are called.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).parents[1]
PACKAGES = [*ROOT.glob("packages/*/src/*")]
SOURCES = tuple(f"{package}/" for package in PACKAGES)
WIRES = ("lockstep.py", "simulated_wire.py")
TICK = 150
"""The tick that is looked at: the robot walks."""
SHORT = ("--trials", "1", "--seed", "5", "--time-limit", "3", "--workers", "1", "--no-figures")


class Walk:
    """Functions of ours that were entered, in order, but those that a skipped one called.

    Args:
        skip: Whether a frame and all that it calls are left out.
    """

    def __init__(self, skip: Callable[[FrameType], bool]) -> None:
        self._skip, self._below = skip, 0
        self.files: list[str] = []

    def __call__(self, frame: FrameType, event: str, _: Any) -> None:
        """As `sys.setprofile` wants it."""
        if event == "call":
            if self._below or self._skip(frame):
                self._below += 1
            elif frame.f_code.co_filename.startswith(SOURCES):
                self.files.append(frame.f_code.co_filename.rpartition("/src/")[2])
        elif event == "return" and self._below:
            self._below -= 1

    def tell(self, name: str, limit: str, files: bool) -> None:
        """Print what it is."""
        distinct = list(dict.fromkeys(self.files))
        folders = {str(Path(file).parent) for file in distinct}
        print(
            f"{name}: {len(distinct)} files in {len(folders)} folders, {len(self.files)} calls"
            f" ({limit})"
        )
        for file in distinct if files else ():
            print(f"    {file}")


@contextlib.contextmanager
def walked(walk: Walk) -> Iterator[None]:
    """Follow what is called inside."""
    sys.setprofile(walk)
    try:
        yield
    finally:
        sys.setprofile(None)


def tick() -> Walk:
    """One tick of a drive."""
    sys.path.insert(0, str(ROOT / "tests"))
    rig = importlib.import_module("driven_rig")
    watched = importlib.import_module("twin_rig").Watch
    stated = importlib.import_module("stated").stated

    from antennate.experiments.tunnel.physics import TunnelConfig
    from antennate.hardware.config import DriveConfig
    from antennate.hardware.driving.drive import drive
    from antennate.twin.robot import TwinRobot

    config = TunnelConfig(seed=0)
    robot = TwinRobot(watched(config, "closed", 0).body, config.robot, 0.01, boot_id=1)
    known = stated(config.robot)
    orders = DriveConfig(
        controller="closed", dry_run=0.5, touch_check=False, robot=known, duration=5.0
    )
    walk = Walk(lambda frame: Path(frame.f_code.co_filename).name in WIRES)
    ticks = 0

    def on_tick(session: Any, now: float) -> None:
        nonlocal ticks
        ticks += 1
        sys.setprofile(walk if ticks == TICK else None)

    drive(rig.in_process(orders, robot), orders, arm=True, on_tick=on_tick)
    return walk


def trial() -> Walk:
    """One trial of `tunnel`."""
    from antennate.experiments.tunnel.batch import run_trials
    from antennate.experiments.tunnel.physics import TunnelConfig

    config = TunnelConfig(seed=5, trials=1, time_limit=3.0, controllers=("closed",))
    run_trials(config, "closed", [0], lambda found: None)  # what is loaded once is not the walk
    walk = Walk(lambda frame: False)
    with walked(walk):
        run_trials(config, "closed", [0], lambda found: None)
    return walk


def command() -> Walk:
    """`tunnel` without its trial."""
    from antennate.cli import main
    from antennate.experiments.tunnel.batch import run_trials

    walk = Walk(lambda frame: frame.f_code is run_trials.__code__)
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        words = ["tunnel", *SHORT, "--controllers", "closed", "--out"]
        main([*words, f"{folder}/loaded"])
        with walked(walk):
            main([*words, f"{folder}/walked"])
    return walk


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", action="store_true", help="name the files")
    wanted = parser.parse_args()
    for each, limit in ((tick, "20 files"), (trial, "12 folders"), (command, "6 files")):
        each().tell(each.__name__, f"aim: {limit}", wanted.files)
