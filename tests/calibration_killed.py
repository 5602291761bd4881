"""Kills programs that write a calibration over another one, and says what file is left.

Words: folder, number of kills, seed. Three of five kills come just before or after a call that
touches a file, those of the calibration first; the others at random times. Prints one JSON object:
how many such places the calibration has, at how many places it was killed, and of each kill which
calibration is in the folder, or else in that of the old run, "old", "new" or what else.
"""

import dataclasses
import json
import os
import random
import shutil
import signal
import struct
import sys
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from antennate.antenna import fitting
from antennate.antenna.calibration import Calibration
from antennate.antenna.curves import Samples
from antennate.cli.experiment import Options, carry_out
from antennate.errors import CalibrationError
from antennate.experiments.calibrate.experiment import EXPERIMENT
from antennate.experiments.calibrate.recording import Recording
from antennate.experiments.calibrate.run import CalibrateConfig, CalibrateOutcome
from antennate.studies.run_directory import RunDirectory

TOUCHING = {"open", "write", "flush", "fsync", "close", "replace", "rename", "unlink", "mkdir"}
NAME = "calibration.json"


def outcome(sensor_id: str) -> CalibrateOutcome:
    """A calibration of readings that follow a sigmoid."""
    bend = np.tile(np.linspace(0.01, 0.99, 60), 4)
    counts = np.rint(1600.0 + 60.0 * np.log(bend / (1 - bend)))
    trial, row = np.repeat(np.arange(4), 60), np.arange(2, 242)
    samples = Samples(counts, bend, trial, np.full(240, np.nan), row)
    recording = Recording(0.01 * np.arange(240), samples, "0" * 64)
    found = fitting.fit(samples, sensor_id, "0" * 64)
    return CalibrateOutcome(CalibrateConfig(), recording, recording, found)


def calibrate(folder: Path, made: CalibrateOutcome) -> None:
    """The command from the end of the fit on."""
    experiment: Any = dataclasses.replace(EXPERIMENT, procedure=lambda *_: made)
    options = Options(out=folder, overwrite=True, json=True, no_figures=True)
    carry_out(experiment, [], made.config, options)


def child(folder: Path, made: CalibrateOutcome, kill_at: int | None, said: int) -> None:
    """Write, and die at the n-th event of a call that touches a file, if so told.

    Otherwise say which events lie within the write of the calibration, and how many there are.
    """
    events, span = 0, list[int]()
    write = RunDirectory.write

    def watched(self: RunDirectory, name: str, content: str | bytes) -> None:
        span.extend([events] if name == NAME else [])
        write(self, name, content)
        span.extend([events] if name == NAME else [])

    RunDirectory.write = watched  # type: ignore[method-assign]

    def watch(frame: FrameType, event: str, call: Any) -> None:
        nonlocal events
        if event.startswith("c_") and call.__name__ in TOUCHING:
            events += 1
            if events == kill_at:
                os.kill(os.getpid(), signal.SIGKILL)

    os.write(said, b"begun")
    sys.setprofile(watch)
    with Path(os.devnull).open("w") as nowhere:
        sys.stdout = sys.stderr = nowhere
        calibrate(folder, made)
    sys.setprofile(None)
    os.write(said, struct.pack("<3I", *span, events))
    os._exit(0)


def killed(
    folder: Path, made: CalibrateOutcome, at: int | None, after: float | None
) -> tuple[bytes, bytes]:
    """One program: what it said at its end, and the file that it left."""
    heard, said = os.pipe()
    process = os.fork()
    if not process:
        child(folder, made, at, said)
    os.close(said)
    os.read(heard, 5)
    if after is not None:
        time.sleep(after)
        os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    told = os.read(heard, 12)
    os.close(heard)
    return told, calibration_of(folder).read_bytes()


def calibration_of(folder: Path) -> Path:
    """The file of the new run, or of the old one, which has another name by then."""
    file = folder / NAME
    return file if file.exists() else folder.with_name(f"{folder.name}.old") / NAME


def main() -> None:
    folder, kills, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    chance = random.Random(seed)
    old, new = outcome("old"), outcome("new")
    calibrated = {made.calibration.to_json().encode(): made for made in (old, new)}
    names = dict(zip(calibrated, ("old", "new"), strict=True))
    with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
        calibrate(folder.with_name("imported"), old)  # all that the others import
    before = folder.with_name("before")  # all files of a run, so that each kill meets the same
    before.mkdir()
    killed(before, old, None, None)
    shutil.copytree(before, folder)
    begin = time.monotonic()
    first, last, events = struct.unpack("<3I", killed(folder, new, None, None)[0])
    took = time.monotonic() - begin
    inside = [*range(first + 1, last + 2)]
    outside = [n for n in range(1, events + 1) if n not in inside]
    points = [*inside, *outside][: max(len(inside), 3 * kills // 5)]
    left: list[str] = []
    for n in range(kills):
        for place in (folder, folder.with_name(f"{folder.name}.old")):
            shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(before, folder)
        point = points[n] if n < len(points) else None
        _, data = killed(folder, new, point, None if point else chance.uniform(0.0, took))
        try:
            Calibration.load(calibration_of(folder))
            left.append(names.get(data, "mixed"))
        except CalibrationError as error:
            left.append(str(error))
    assert sys.__stdout__ is not None
    json.dump({"inside": len(inside), "points": len(points), "left": left}, sys.__stdout__)


if __name__ == "__main__":
    main()
