"""Ctrl-C in the terminal of `drive`, which its other processes share."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest
from stated import STATED
from terminal import read_all

ANTENNATE = [sys.executable, "-m", "antennate"]
INTERRUPTED = 130


@pytest.mark.ci
@pytest.mark.parametrize("moment", [0.0, 0.4, 1.0])
def test_B19_ctrl_c_at_any_time_ends_it_in_order(tmp_path: Path, moment: float) -> None:
    """Typed at a moment after the folder of the run came, while other processes still start."""
    out = tmp_path / "run"
    with subprocess.Popen([*ANTENNATE, "twin"], stdout=subprocess.PIPE, text=True) as twin:
        assert twin.stdout is not None
        ports = json.loads(twin.stdout.readline())
        words = ["drive", "--arm", "--no-touch-check", "--dry-run", "0.5", "--duration", "30"]
        words += STATED
        words += ["--esp32", ports["esp32"], "--bus", ports["bus"], "--out", str(out)]
        ours, theirs = pty.openpty()
        drive = subprocess.Popen(
            [*ANTENNATE, *words],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )
        os.close(theirs)
        while not (out / "config.toml").exists() and drive.poll() is None:
            time.sleep(0.01)
        time.sleep(moment)
        os.write(ours, b"\x03")
        text = read_all(ours, drive)
        twin.terminate()
    assert "Traceback" not in text
    if drive.returncode == INTERRUPTED:  # before the robot was looked at
        assert "interrupted" in text
        return
    assert (out / "result.json").exists(), (drive.returncode, text)
    result = json.loads((out / "result.json").read_text())
    assert result["ended"] == "a signal"
    assert result["torque_off"] in (None, True)
    assert result["logs"]
    assert all((out / name).exists() for name in result["logs"])
    assert f"replay {out / result['logs'][0]}" in " ".join(text.split())


@pytest.mark.smoke
def test_ctrl_c_while_source_is_executed_keeps_the_exit_code(tmp_path: Path) -> None:
    """As `dataclasses` does at import: CPython would end itself by SIGINT after our exit code."""
    command = 'exec("raise KeyboardInterrupt")'
    module = "import sys, types\nlog = types.ModuleType('antennate.cli.log')\n"
    module += f"log.command = lambda argv: {command}\nsys.modules[log.__name__] = log\n"
    (tmp_path / "sitecustomize.py").write_text(module)
    ended = subprocess.run(
        [*ANTENNATE, "log"],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert (ended.returncode, ended.stderr) == (INTERRUPTED, "antennate log: interrupted\n")
