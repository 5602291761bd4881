"""Competition: fair to all, INVALID where it must be, the same rows on any number of workers."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

import antennate
from antennate.cli import main
from antennate.cli.terminal import BAD_INPUT
from antennate.errors import BadInputError, ConfigError, OutputError
from antennate.robots.spec import RobotSpec
from antennate.studies.formats import to_csv
from antennate.studies.pool import Workers
from antennate.studies.run_directory import RunDirectory
from antennate_lab.compete import apart, experiment
from antennate_lab.compete.checking import read_rows
from antennate_lab.compete.comparison import compared, refusal
from antennate_lab.compete.config import (
    DEVELOPMENT,
    RESERVED,
    CompeteConfig,
    hidden_seed,
    settled,
)
from antennate_lab.compete.episodes import Draw, EpisodeRow, run_episodes
from antennate_lab.compete.page import sentence
from antennate_lab.compete.scenes import label, labels, tunnel_config
from antennate_lab.compete.standings import standing

SHORT = "flat+time_limit=0.3"
ENTRIES = '''
import builtins, os, subprocess, sys, time
import numpy as np
from antennate.control.controllers import open_loop
from antennate.control.registry import make_controller
def by_map(control, robot, batch):
    return make_controller("map", control, robot, batch)

class Entry:
    """`open` with a fault."""
    def __init__(self, control, robot, batch):
        self.inner, self.ticks = open_loop(control, robot, batch), 0
    def __getattr__(self, name):
        return getattr(self.inner, name)
    def reset(self, rows, phase=0.0):
        self.inner.reset(rows, phase)
        self.odd, self.ticks = phase, 0
    def step(self, frame):
        self.ticks += 1
        command = self.inner.step(frame)
        if self.ticks > 5:
            self.fault(command)
        return command
    def fault(self, command):
        pass

class NotFinite(Entry):
    def fault(self, command):
        command.yaw[:, 0] = np.nan
class Raises(Entry):
    def fault(self, command):
        raise ZeroDivisionError("no")
class Busy(Entry):
    def fault(self, command):
        end = time.process_time() + 0.08
        while time.process_time() < end:
            pass
class Asleep(Entry):
    def fault(self, command):
        time.sleep(30.0)
class Swallows(Entry):
    def fault(self, command):
        try:
            time.sleep(0.5)
        except Exception:
            time.sleep(0.1)
class Begins(Entry):
    """It lets another program work for it."""
    def fault(self, command):
        subprocess.run([sys.executable, "-S", "-c", "sum(range(20_000_000))"], check=True)
class Asks(Entry):
    """A program beside it works for it, and does not end."""
    def fault(self, command):
        if not hasattr(self, "helper"):
            self.helper = subprocess.Popen(["sleep", "9"])
class SlowReset(Entry):
    def reset(self, rows, phase=0.0):
        super().reset(rows, phase)
        end = time.process_time() + 1.2
        while time.process_time() < end:
            pass
class Dies(Entry):
    def step(self, frame):
        os.kill(os.getpid(), 9)
class Hangs(Entry):
    def __init__(self, control, robot, batch):
        time.sleep(600)
def shifty(control, robot, batch):
    """It tells a lone robot that it needs nothing."""
    return open_loop(control, robot, batch) if batch == 1 else by_map(control, robot, batch)
class Shape(Entry):
    def step(self, frame):
        command = self.inner.step(frame)
        return type(command)(yaw=command.yaw[:, :2], leg=command.leg, antenna=command.antenna)
class Curious(Entry):
    """It could use a map, and fails if it is given one."""
    knows, needs = ("map",), ()
    def know(self, knowledge):
        raise RuntimeError("it was told")
class Learns(Entry):
    """It loads what it needs when it is first told something."""
    needs, slow = ("side",), 0
    def know(self, knowledge):
        if self.ticks == self.slow:
            Busy.fault(self, None)
class LearnsLate(Learns):
    slow = 1
class Breaks(Entry):
    """What it changes would fail outside of its own decisions, in a process that others share."""
    def fault(self, command):
        np.clip = None
class Ends(Entry):
    def fault(self, command):
        os.kill(os.getpid(), 9)
class Leaves(Entry):
    def fault(self, command):
        builtins.left_behind = True
class Looks(Entry):
    def fault(self, command):
        if hasattr(builtins, "left_behind"):
            raise RuntimeError("somebody was here before")
'''


@pytest.fixture
def entries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], str]:
    """Names of the controllers of a file in the working folder."""
    (tmp_path / "entries.py").write_text(ENTRIES)
    monkeypatch.chdir(tmp_path)
    return lambda name: f"entries.py:{name}"


def episodes(
    name: str, count: int = 1, scene: str = SHORT, limit: float = 0.05
) -> list[EpisodeRow]:
    """Rows of some draws of one controller, run in this process."""
    rows: dict[int, EpisodeRow] = {}
    draws = [(Draw(name, scene, DEVELOPMENT.start, trial, limit),) for trial in range(count)]
    run_episodes(draws, rows.__setitem__)
    return [rows[place] for place in range(count)]


# faults in a trial


@pytest.mark.ci
@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("NotFinite", "expected finite angles in yaw"),
        ("Raises", "step raised ZeroDivisionError: no"),
        ("Busy", "a decision took longer than 50 ms of the processor"),
        ("Asleep", "a decision took longer than 0.2 s on the clock"),
        ("Swallows", "a decision took longer than 0.2 s on the clock"),
        ("Begins", "a decision took longer than 50 ms of the processor"),
        ("SlowReset", "a reset took longer than 1 s on the clock"),
        ("LearnsLate", "know took longer than 50 ms of the processor"),
    ],
)
def test_what_fails_in_a_trial_is_invalid_with_its_reason(
    name: str, why: str, entries: Callable[[str], str]
) -> None:
    (row,) = episodes(entries(name), limit=0.01 if name in ("Asleep", "Swallows") else 0.05)
    assert row.outcome == "invalid"
    assert why in row.reason


@pytest.mark.ci
def test_a_decision_within_the_limit_is_none_that_took_too_long(
    entries: Callable[[str], str],
) -> None:
    assert [r.outcome for r in episodes(entries("Busy"), 2, limit=5.0)] == ["timeout"] * 2


@pytest.mark.ci
def test_the_first_decision_may_take_longer_in_what_it_is_told_too(
    entries: Callable[[str], str],
) -> None:
    assert [row.reason for row in episodes(entries("Learns"), 2)] == ["", ""]


@pytest.mark.ci
def test_decisions_of_a_batch_are_judged_alone(
    tmp_path: Path, entries: Callable[[str], str]
) -> None:
    """Each takes 2 ms, so a step of 20 takes 40 ms, which is more than the limit of one."""
    text = "time.process_time() + 0.08"
    busy = ENTRIES.replace(text, "time.process_time() + 0.002 * len(command.yaw)")
    (tmp_path / "rows.py").write_text(busy)
    rows = episodes("rows.py:Busy", 20, limit=0.02, scene="flat+time_limit=0.1")
    assert {row.outcome for row in rows} == {"timeout"}


@pytest.mark.ci
def test_who_can_use_knowledge_but_needs_none_is_given_none(
    entries: Callable[[str], str],
) -> None:
    assert episodes(entries("Curious"))[0].reason == ""


@pytest.mark.ci
def test_who_needs_knowledge_in_a_run_alone_is_given_it_and_its_rows_say_so(
    entries: Callable[[str], str],
) -> None:
    rows = episodes(entries("shifty"), 2)
    assert {row.given for row in rows} == {"jam map"}
    assert standing(rows, 0.01).controllers[rows[0].controller].rank is None


ESCAPES = """
import ctypes, os, resource, signal, stat, struct, subprocess, sys, threading, time
from antennate.control.controllers import open_loop

clock = time.process_time
def end():
    os.kill(os.getpid(), signal.SIGKILL)
def work(seconds):
    end = clock() + seconds
    while clock() < end:
        pass

class Entry:
    ticks = 0
    def __init__(self, *how):
        self.inner = open_loop(*how)
    def __getattr__(self, name):
        return getattr(self.inner, name)
    def step(self, frame):
        self.ticks += 1
        if self.ticks == 5:
            self.escape()
        return self.inner.step(frame)
    def escape(self):
        pass
class Orphan(Entry):
    def escape(self):
        if not (child := os.fork()):
            if not os.fork():
                with open("pid", "w") as file:
                    file.write(str(os.getpid()))
                work(30.0)
            end()
        os.waitpid(child, 0)
class OrphanInside(Entry):
    def escape(self):
        ours, theirs = os.pipe()
        if not (child := os.fork()):
            if not os.fork():
                os.close(ours)
                work(0.2)
            end()
        os.close(theirs)
        os.waitpid(child, 0)
        os.read(ours, 1)  # until it has ended
        time.sleep(0.1)
class Ignored(Entry):
    def escape(self):
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)
        if not os.fork():
            work(0.4)
            end()
        try:
            os.wait()
        except ChildProcessError:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
class Hidden(Entry):  # behind more children than one read of /proc tells
    def escape(self):
        for number in range(900):
            if not os.fork():
                end()
        work(0.2)
class Between(Entry):
    def escape(self):
        threading.Thread(target=work, args=(30.0,), daemon=True).start()
class Clocks(Entry):
    def escape(self):
        for module in (time, *(m for n, m in sys.modules.items() if n.startswith("antennate"))):
            for name in ("process_time", "monotonic", "clock_gettime"):
                setattr(module, name, lambda *how: 0.0)
        resource.getrusage = lambda who: resource.struct_rusage([0.0] * 16)
        signal.setitimer = lambda *how: None
        work(0.2)
class Stops(Entry):
    def escape(self):
        os.kill(os.getppid(), signal.SIGSTOP)
        time.sleep(60.0)
class Half(Entry):
    def escape(self):
        for file in map(int, os.listdir("/proc/self/fd")):
            try:
                if stat.S_ISSOCK(os.fstat(file).st_mode):
                    os.write(file, struct.pack("!i", 100) + b"half")
            except OSError:  # the folder's own
                pass
        time.sleep(60.0)
class Ended(Entry):
    def escape(self):  # as a cluster ends a job: all of its processes
        os.killpg(0, signal.SIGTERM)  # its own group alone
        for number in (signal.SIGUSR2, signal.SIGTERM):
            os.kill(os.getppid(), number)
            os.kill(os.getpid(), number)
class Program(Entry):
    def escape(self):
        self.program = subprocess.Popen(["true"])
        while b") Z " not in open(f"/proc/{self.program.pid}/stat", "rb").read():
            time.sleep(0.001)
DATA = open(__file__)
class Reads(Entry):
    def escape(self):
        assert "class Reads" in DATA.read()
class Picks(Entry):
    def step(self, frame):
        class Answer:
            def __reduce__(self):
                return os.system, ("touch picked",)
        return Answer() if self.ticks else Entry.step(self, frame)
"""
TOO_LONG = "controller: a decision took longer than "
SLOW_SCENE = """
import time
import numpy as np
from antennate.sim.scenes.scene import Route
class Here(Route):
    def left(self, head):
        time.sleep(0.5)
        return False
class Slow:
    random = False
    def draw(self, robot, rng):
        return Here(np.array([[0.0, 0.0], [2.0, 0.0]]))
"""


@pytest.mark.ci
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a process tells its time itself")
@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("Entry", ""),
        ("Orphan", "controller: a program that it began runs on after a decision"),
        ("OrphanInside", "controller: a decision took longer than 50 ms of the processor"),
        ("Ignored", "controller: a decision took longer than 50 ms of the processor"),
        ("Hidden", "controller: it began more than 64 programs that it did not wait for"),
        ("Between", "controller: a decision took longer than 50 ms of the processor"),
        ("Clocks", "controller: a decision took longer than 50 ms of the processor"),
        ("Stops", "controller: a decision took longer than 1 s on the clock"),
        ("Half", "controller: a decision took longer than 1 s on the clock"),
        ("Ended", ""),
        ("Program", ""),
        ("Reads", ""),
        ("Picks", "controller: expected plain arrays, found posix.system"),
    ],
)
def test_processor_time_does_not_escape(
    name: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Physics that take half a second leave time to work beside them."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "escapes.py").write_text(ESCAPES)
    (tmp_path / "scenes.py").write_text(SLOW_SCENE)
    words = ["--controllers", f"escapes.py:{name}", "--scenes", "scenes.py:Slow+time_limit=0.2"]
    words += ["--trials", "1", "--workers", "1", "--no-figures", "--out", "run"]
    assert main(["compete", *words]) == (2 if why else 0)
    (row,) = read_rows(tmp_path / "run" / "trials.csv")
    assert row.outcome == ("invalid" if why else "timeout")
    assert row.reason == why or (TOO_LONG in why and TOO_LONG in row.reason)  # or on the clock
    assert not (tmp_path / "picked").exists()
    if name == "Orphan":
        left = Path("/proc", (tmp_path / "pid").read_text())
        end = time.monotonic() + 10.0
        while left.exists() and time.monotonic() < end:
            time.sleep(0.01)
        assert not left.exists()


@pytest.mark.ci
def test_a_judge_that_was_stopped_blames_no_controller(entries: Callable[[str], str]) -> None:
    """As by Ctrl-Z and fg: 1.5 s, where a decision may last one second on the clock."""
    words = "sleep 0.3; kill -STOP $0; sleep 1.5; kill -CONT $0"
    with subprocess.Popen(["sh", "-c", words, str(os.getpid())]) as stop:
        rows = episodes(entries("Entry"), scene="flat+time_limit=15")
        stop.wait(30)
    assert [row.reason for row in rows] == [""]


@pytest.mark.ci
@pytest.mark.parametrize("name", ["Busy", "Begins", "Entry"])
def test_where_the_system_does_not_tell_a_process_tells_its_time_itself(
    name: str, entries: Callable[[str], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on macOS, where there is no /proc."""
    monkeypatch.setattr(apart, "descendants", lambda pid: iter(()))
    (row,) = episodes(entries(name))
    assert row.outcome == ("timeout" if name == "Entry" else "invalid")


# a run


@pytest.mark.ci
def test_a_run_ranks_counts_invalid_as_failed_and_keeps_controllers_apart(
    tmp_path: Path, entries: Callable[[str], str], capsys: pytest.CaptureFixture[str]
) -> None:
    names = [*map(entries, ("Leaves", "Looks", "NotFinite")), "map"]
    words = ["compete", "--trials", "3", "--scenes", SHORT, "--no-figures"]
    assert main([*words, "--controllers", *names, "--workers", "2", "--out", "run"]) == 0
    rows = list(csv.DictReader((tmp_path / "run" / "trials.csv").read_text().splitlines()))
    by_name = {name: [r for r in rows if r["controller"] == name] for name in names}
    assert [len(own) for own in by_name.values()] == [3] * 4
    assert {row["reason"] for row in by_name[names[1]]} == {""}
    assert {row["outcome"] for row in by_name[names[2]]} == {"invalid"}
    assert {row["given"] for row in by_name["map"]} == {"jam map"}
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    cells = result["controllers"]
    assert (cells[names[2]]["invalid"], cells[names[2]]["success_share"]) == (3, 0.0)
    assert cells[names[2]]["restricted_mean_share"] == 1.0
    assert cells["map"]["rank"] is None
    assert not any("map" in pair for pair in result["paired"])
    readme = (tmp_path / "run" / "README.md").read_text()
    assert "| `map` | not ranked |" in readme
    assert "expected finite angles in yaw" in readme
    told = capsys.readouterr().out.splitlines()[0]
    assert told.startswith("Ranks in 1 scene")
    assert " No episode of NotFinite is valid: " in told
    assert "expected finite angles in yaw" in told


@pytest.mark.ci
def test_a_run_tells_how_long_it_will_take_before_the_first_episode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Between a hundredth and a fifth of a second of a core for each second of the limits."""
    monkeypatch.chdir(tmp_path)
    words = ["compete", "--controllers", "open", "--scenes", "flat+time_limit=0.5", "flat"]
    words += ["--trials", "1", "--workers", "1", "--no-figures", "--out", "run"]
    assert main(words) == 0
    first, second, *_ = capsys.readouterr().err.splitlines()
    assert first == "2 episodes of 100 s together at most: 3 s to 22 s, 1 worker"
    assert second.startswith("compete: 1 of 2")
    board = CompeteConfig(controllers=("open", "closed"), trials=100)  # 160,000 s of walking
    told = experiment.foretold(board, Workers(4))
    assert told == "1600 episodes of 160,000 s together at most: 7 min to 2.2 h, 4 workers"


@pytest.mark.smoke
def test_a_row_is_that_of_tunnel() -> None:
    """The same scene, seed and trial, run by the command `tunnel` with those parameters."""
    text = "uturn+variation.reading_noise=3+time_limit=2"
    rows = episodes("closed", 2, text)
    theirs = antennate.run(
        "tunnel",
        scene="uturn",
        seed=DEVELOPMENT.start,
        trials=2,
        time_limit=2.0,
        controllers=("closed",),
        variation={"reading_noise": 3.0},
    ).rows
    assert [r.progress_m for r in rows] == [r.progress_m for r in theirs]


def write_wheel(path: Path) -> None:
    """A wheel of a package with a controller and a scene, as an installer takes it."""
    about = "rivals-2.0.dist-info"
    files = {
        "rivals.py": "from antennate.control.controllers import closed_loop as Rival\n"
        "from antennate.sim.scenes.scene import FlatScene\n"
        "class Mile(FlatScene):\n    def __init__(self):\n        super().__init__(0.05)\n",
        f"{about}/METADATA": "Metadata-Version: 2.1\nName: rivals\nVersion: 2.0\n",
        f"{about}/WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\n"
        "Tag: py3-none-any\n",
        f"{about}/entry_points.txt": "[antennate.controllers]\nrival = rivals:Rival\n"
        "[antennate.scenes]\nmile = rivals:Mile\n",
    }
    files[f"{about}/RECORD"] = "".join(f"{name},,\n" for name in [*files, f"{about}/RECORD"])
    with zipfile.ZipFile(path, "w") as wheel:
        for name, text in files.items():
            wheel.writestr(name, text)


@pytest.mark.ci
def test_the_wheel_of_another_package_competes_by_its_entry_points(tmp_path: Path) -> None:
    wheel = tmp_path / f"rivals-2.0-py3-none-any.{'wh' + 'l'}"  # no address of a registry
    write_wheel(wheel)
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")  # what an installer does with this one
    words = ["compete", "--controllers", "rival", "open", "--scenes", "mile", "--trials", "2"]
    words += ["--decision-limit", "10"]  # on a busy machine a reset waits long
    done = subprocess.run(
        [sys.executable, "-m", "antennate", *words, "--no-figures", "--json", "--out", "run"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path / "site")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert [result["controllers"][n]["successes"] for n in ("rival", "open")] == [2, 2]
    assert result["paired"]["rival-open"]["tie"]


# refusals


@pytest.mark.parametrize(
    ("words", "why"),
    [
        pytest.param(
            "--controllers entries.py:Shape",
            "expected yaw of shape (1, 5), found (1, 2)",
            marks=pytest.mark.ci,
        ),
        ("--controllers clsoed", "did you mean closed?"),
        ("--controllers entries.py:Ends ./entries.py:Ends", "controllers must differ"),
        ("--controllers a/p.onnx open ./a//p.onnx", "controllers must differ"),
        pytest.param("--controllers missing.py:Mine", "no file", marks=pytest.mark.ci),
        ("--scenes utrun", "did you mean uturn?"),
        ("--scenes uturn+variation.noise=3", "'uturn+variation.noise=3': "),
        (
            "--scenes uturn+control.rate=50",
            "expected a parameter of tunnel, corridors, ground, robot",
        ),
        ("--scenes uturn+readings=yoked", "expected readings of its own"),
        ("--scenes uturn+readings=delayed:0.015", "whole control periods"),
        ("--scenes uturn uturn", "scenes must differ"),
        ("--scenes wall+time_limit=2 wall+time_limit=2.0", "'wall+time_limit=2.0', which are the"),
        ("--scenes uturn uturn+time_limit=100", "which are the same"),
        ("--scenes uturn+variation=3", "variation"),
        ("--scenes uturn+variation=3+variation.broken=random", "found 'variation.broken' again"),
        ("--scenes uturn+variation.broken=left+variation=3", "found 'variation' again"),
        ("--scenes uturn+time_limit=2+time_limit=3", "found 'time_limit' again"),
        ("--scenes uturn+readings=a+readings.x=1", "found 'readings.x' again"),
        ("--scenes uturn+readings.x=1", "readings"),
        ("--scenes uturn+ground.height=0.05", "it belongs to the scenes"),
        ("--scenes uturn+variation.x2=1", "variation.x2"),
        (f"--scenes uturn+time_limit={'[' * 3000}", "time_limit"),
        ("--controllers clsoed+search.patience=4", "did you mean closed?"),
        ("--controllers closed+search.patence=4", "did you mean patience?"),
        ("--controllers timed+search.patience=4", "timed does not read search.patience"),
        ("--controllers closed+search.patience=-1", "'closed+search.patience=-1': search.patience"),
        ("--controllers closed+gait.frequency=0.5+gait=1", "controllers: expected each parameter"),
        pytest.param(
            "--controllers open closed+gait.frequency=1",
            "'closed+gait.frequency=1': control.gait.frequency: expected at most 0.837 Hz, which "
            "robot.legs.fastest of 5.26 rad/s allows, found 1",
            marks=pytest.mark.ci,
        ),
        ("--check no.csv", "no.csv: expected a readable file"),
        ("--check no.csv --trials 3", "the file of check says it"),
        ("--engine dask", "--engine"),
        ("--hidden --seed 5", "seed: expected none beside hidden"),
        ("--seed 700000", "expected no seed of 700000 to 799999"),
        ("--seed 9999999999999999999", "--seed: expected a number of at most 4.61169e+18"),
        ("--hidden --seed 799999", "expected no seed of 700000 to 799999"),
    ],
)
def test_bad_input_is_one_line_before_the_first_trial(
    words: str, why: str, tmp_path: Path, entries: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    scenes = [] if "--scenes" in words or "--check" in words else ["--scenes", SHORT]
    assert main(["compete", *words.split(), *scenes, "--out", "run"]) == 2
    err = capsys.readouterr().err
    assert why in err
    assert err.count("\n") == 1
    assert not (tmp_path / "run").exists()


@pytest.mark.ci
@pytest.mark.parametrize(
    ("name", "why"), [("Dies", "process ended"), ("Hangs", "no result within 4 s")]
)
def test_who_ends_or_hangs_a_process_is_named_before_the_first_trial(
    name: str,
    why: str,
    tmp_path: Path,
    entries: Callable[[str], str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """It is no end of the command that looks like a success."""
    monkeypatch.setattr(experiment, "PATIENCE", 4.0 if name == "Hangs" else 60.0)
    words = ["compete", "--scenes", SHORT, "--trials", "1", "--out", "run", "--controllers"]
    assert main([*words, "open", entries(name)]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert f"--controllers: '{entries(name)}': " in line
    assert why in line
    assert not (tmp_path / "run").exists()


@pytest.mark.ci
def test_who_ends_its_process_in_a_trial_is_invalid_and_who_breaks_it_breaks_nothing_else(
    tmp_path: Path, entries: Callable[[str], str]
) -> None:
    names = [entries("Breaks"), entries("Ends"), entries("Asks"), "open"]
    words = ["--controllers", *names, "--scenes", SHORT, "--trials", "1", "--no-figures"]
    assert main(["compete", *words, "--workers", "1", "--out", "run"]) == 0
    rows = read_rows(tmp_path / "run" / "trials.csv")
    assert [row.outcome for row in rows] == ["timeout", "invalid", "invalid", "timeout"]
    assert {row.limit_s for row in rows} == {0.3}
    assert {row.time_s for row in rows} == {0.3}
    assert rows[1].reason == "controller: its process ended in step"
    assert "a program that it began runs on" in rows[2].reason


@pytest.mark.ci
def test_entries_with_helpers_of_one_name_each_get_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(experiment, "core_count", lambda: 1)  # both are looked at in turn
    for place in ("one", "two"):
        (tmp_path / place).mkdir()
        (tmp_path / place / "helper.py").write_text(f"NAME = {place!r}\n")
        (tmp_path / place / "ctl.py").write_text(
            "from antennate.control.registry import make_controller\nimport helper\n"
            f"assert helper.NAME == {place!r}\n"
            "def C(*parts):\n    return make_controller('open', *parts)\n"
        )
    names = [str(tmp_path / place / "ctl.py:C") for place in ("one", "two")]
    words = ["--controllers", *names, "--scenes", SHORT, "--trials", "1", "--no-figures"]
    assert main(["compete", *words, "--workers", "1", "--out", str(tmp_path / "run")]) == 0


@pytest.mark.ci
def test_figures_that_did_not_fit_are_drawn_by_resume(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["compete", "--controllers", "open", "--scenes", SHORT, "--trials", "1"]
    words += ["--workers", "1", "--out", str(tmp_path / "run")]
    with monkeypatch.context() as patch:

        def full(*_: object) -> None:
            raise OutputError("No space left on device")

        patch.setattr(RunDirectory, "write_figures", full)
        assert main(words) == BAD_INPUT
    table = (tmp_path / "run" / "trials.csv").read_bytes()
    assert main([*words, "--resume"]) == 0
    assert (tmp_path / "run" / "figures" / "ranks.png").exists()
    assert (tmp_path / "run" / "trials.csv").read_bytes() == table
    assert (tmp_path / "run" / "trials.jsonl").exists()


@pytest.mark.ci
def test_shards_together_are_the_same_bytes_also_of_a_process_that_dies(
    entries: Callable[[str], str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Wherever they are merged."""
    words = ["--controllers", "open", entries("Ends"), "--scenes", SHORT, "--trials", "2"]
    words += ["--workers", "1", "--no-figures"]
    assert main(["compete", *words, "--out", "whole"]) == 0
    for number in "12":
        assert main(["compete", *words, "--shard", f"{number}/2", "--out", f"part{number}"]) == 0
    monkeypatch.setattr("antennate_lab.compete.episodes.processor", lambda: "another")
    assert main(["study", "merge", "part1", "part2", "--no-figures", "--out", "all"]) == 0
    for name in ("trials.csv", "result.json", "README.md", "config.toml"):
        assert Path("all", name).read_bytes() == Path("whole", name).read_bytes()


@pytest.mark.ci
def test_a_shard_of_hidden_seeds_is_refused_and_leaves_the_folder_as_it_is(
    entries: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--controllers", "open", "--scenes", SHORT, "--trials", "1", "--no-figures"]
    words += ["--workers", "1", "--hidden"]
    assert main(["compete", *words, "--out", "run"]) == 0
    Path("run/result.json").unlink()  # as of a run that goes on
    before = {path: path.read_bytes() for path in Path("run").rglob("*.*")}
    capsys.readouterr()
    for how in ("--resume", "--overwrite"):
        given = [*words, "--shard", "1/2", how, "--out", "run"]
        assert main(["compete", *given]) == BAD_INPUT
        assert "each shard would draw a seed of its own" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in Path("run").rglob("*.*")} == before
    assert not [*Path().glob("run.old*")]


# seeds


@pytest.mark.ci
def test_a_check_does_not_go_on_with_another_file_of_a_controller(
    tmp_path: Path, entries: Callable[[str], str]
) -> None:
    """Nothing but the table names that file."""
    (tmp_path / "a.csv").write_text(to_csv(map(asdict, episodes(entries("Looks"), 2))))

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        antennate.run("compete", check="a.csv", out="again", on_step=stop)
    (tmp_path / "entries.py").write_text(ENTRIES + "\n# another\n")
    with pytest.raises(BadInputError, match=r"the file entries\.py changed"):
        antennate.run("compete", check="a.csv", out="again", resume=True)


def test_a_hidden_seed_is_neither_public_nor_reserved() -> None:
    offered = iter([DEVELOPMENT[0], RESERVED[0], RESERVED[-1], DEVELOPMENT[-1], 7, 8])
    assert hidden_seed(lambda most: next(offered)) == 7
    assert len({hidden_seed() for _ in range(20)}) == 20
    assert (RESERVED[0], RESERVED[-1]) == (700_000, 799_999)


@pytest.mark.ci
def test_a_hidden_run_that_was_stopped_goes_on_with_its_seed_and_publishes_it(
    tmp_path: Path,
) -> None:
    words: dict[str, Any] = {"hidden": True, "controllers": ("open", "centre"), "trials": 1}
    words |= {"scenes": (SHORT,), "out": tmp_path / "run"}

    def stop(done: int, total: int) -> None:
        if done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        antennate.run("compete", on_step=stop, **words)
    steps = list[int]()
    again = antennate.run(
        "compete", resume=True, on_step=lambda done, total: steps.append(done), **words
    )
    assert steps == [1, 2]  # the first from the folder
    seed = settled(CompeteConfig(hidden=True), tmp_path / "run").seed
    assert {row.seed for row in again.rows} == {seed} == {again.summary["seed"]}
    assert seed not in DEVELOPMENT
    assert all(row.drawn for row in again.rows)
    assert f"hidden seed {seed}" in again.sentence


def test_only_a_hidden_run_draws_a_seed_and_takes_no_other(tmp_path: Path) -> None:
    assert settled(CompeteConfig(), None).seed == DEVELOPMENT.start
    for seed in (5, DEVELOPMENT.start):
        with pytest.raises(ConfigError, match=f"expected none beside hidden.* found {seed}"):
            settled(CompeteConfig(hidden=True, seed=seed), tmp_path)
    file = tmp_path / "config.toml"
    file.write_text("hidden = true\nseed = 5\n")
    assert settled(CompeteConfig(hidden=True, seed=5), tmp_path).seed == 5
    file.write_text("hidden = false\nseed = 5\n")  # of a run whose seed was known
    with pytest.raises(ConfigError, match="found 5"):
        settled(CompeteConfig(hidden=True, seed=5), tmp_path)
    assert settled(CompeteConfig(hidden=True), tmp_path).seed != 5


# a table that is run again


@pytest.mark.ci
def test_a_table_of_several_seeds_is_run_again_in_any_order(tmp_path: Path) -> None:
    keys = [(5, 0), (6, 1), (5, 1), (6, 0)]
    rows: list[EpisodeRow] = []
    for seed, trial in keys:
        run_episodes([(Draw("open", SHORT, seed, trial, 0.05),)], lambda i, row: rows.append(row))
    assert len({row.progress_m for row in rows}) == len(keys)
    (tmp_path / "a.csv").write_text(to_csv(map(asdict, rows)))
    again = antennate.run("compete", check=str(tmp_path / "a.csv"))
    assert again.summary["check"]["same"] == len(keys)
    assert sorted((row.seed, row.trial) for row in again.rows) == sorted(keys)


@pytest.mark.ci
def test_a_rival_at_1_hz_walks_as_by_the_parameter() -> None:
    file = Path(__file__).parents[3] / "docs" / "science" / "one_hertz.py"
    scene = "uturn+time_limit=6+robot.legs.fastest=6.29"
    (row,) = episodes(f"{file}:geometric", scene=scene)
    (told,) = episodes("geometric+gait.frequency=1", scene=scene)
    settings: dict[str, Any] = {"controllers": ["geometric"], "scene": "uturn", "trials": 1}
    settings |= {"control": {"gait": {"frequency": 1.0}}, "time_limit": 6.0}
    settings |= {"robot": {"legs": {"fastest": 6.29}}}
    result = antennate.run("tunnel", seed=DEVELOPMENT.start, **settings)
    assert row.progress_m == told.progress_m == result.rows[0].progress_m > 0.5


@pytest.mark.ci
def test_a_table_is_run_again_and_rows_that_differ_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    scenes = ["--scenes", SHORT, "flat+time_limit=0.2"]
    words = ["compete", "--controllers", "open", "centre", *scenes, "--trials", "2"]
    one = ["--no-figures", "--workers", "1"]
    assert main([*words, *one, "--out", "run"]) == 0
    text = (tmp_path / "run" / "trials.csv").read_text()
    cell = "".join(text.splitlines(keepends=True)[:3])
    file = tmp_path / "theirs.csv"
    for changed, rows, said, code in [
        (text, 8, "8 of 8 rows repeat; 0 differ", 0),
        (cell.replace(",timeout,", ",success,", 1), 2, "1 of 2 rows repeat; 1 differ, 1", 2),
        (cell.replace("timeout,0.3,0.3,", "timeout,0.4,0.4,", 1), 2, "1 differ, 0 of them", 2),
    ]:
        file.write_text(changed)
        assert main(["compete", "--check", str(file), *one, "--out", "again"]) == code
        assert said in capsys.readouterr().out
        check = json.loads((tmp_path / "again" / "result.json").read_text())["check"]
        assert (check["rows"], len(check["processors"])) == (rows, 1)
        (tmp_path / "again").rename(tmp_path / f"old{code}{len(said)}")


COLUMNS = "controller,scene,seed,trial,outcome,time_s"
NO_TABLE = [
    ("", "expected a header with controller, found an empty file"),
    ("controller,scene\nopen,flat\n", "with the columns controller, .*, found none named seed"),
    ("controller;scene\nopen;flat\n", "expected columns separated by commas.* found semicolons"),
    ("\0\n", "expected UTF-8 text, found a zero byte"),
    (f"{COLUMNS}\n", "expected a table of trials, found no row"),
    (f"{COLUMNS},trial\n", "expected each column once, found 'trial' twice"),
    (f"{COLUMNS},engin\n", r"expected a known column, found 'engin' \(did you mean engine\?\)"),
]
NO_ROW = [
    ("open,flat,1,0,sucess,1.0", "outcome: expected one of success, .*, found 'sucess'"),
    ("opne,flat,1,0,timeout,1.0", r"expected one of open, .* \(did you mean open\?\)"),
    ("open,flat,700000,0,timeout,100.0", "expected no seed of 700000"),
    ("open,flat,1,-1,success,9.0", "trial: expected 0 to 4611686018427387904, found -1"),
    ("open,flat,1,0,success,nan", "time_s: expected .* 0 to limit_s, 100, found nan"),
    ("open,flat,1,0,overturned,100", "overturned: expected True, as it ended so, found False"),
    ("open,flatt,1,0,success,9", ".*did you mean flat"),
    ("open,flat+tim=1,1,0,success,9", "scenes: expected a parameter of"),
]
NO_END = [
    ("progress_m", "success,1,inf", "progress_m: expected a finite number, found inf"),
    ("reason", "left,100,slow", "reason: expected none, as it is not invalid, found 'slow'"),
    ("limit_s", "success,-5,100", "time_s: expected .* 0 to limit_s, 100, found -5.0"),
    ("limit_s", "success,1e9,100", "time_s: expected .* found 1000000000.0"),
    ("limit_s", "success,100.01,100", "time_s: expected .* found 100.01"),
    ("limit_s", "success,43.0,8.0", "time_s: expected .* 0 to limit_s, 8, found 43.0"),
    ("limit_s", "timeout,99.9,100", "time_s: expected limit_s, 100, as it is no success"),
    ("limit_s", "left,0,100", "time_s: expected limit_s, 100, as it is no success"),
    ("limit_s", "invalid,-100,100", "time_s: expected a finite number of 0 to limit_s"),
    ("limit_s", "success,1,inf", "limit_s: expected a finite number above 0, found inf"),
    ("limit_s", "success,1.0,0.0", "limit_s: expected a finite number above 0, found 0"),
]
TWICE = "open,flat,1,0,timeout,1.0"
FILES = [
    *NO_TABLE,
    *((f"{COLUMNS}\n{row}\n", f"line 2: {why}") for row, why in NO_ROW),
    *((f"{COLUMNS},{name}\nopen,flat,1,0,{end}\n", f"line 2: {why}") for name, end, why in NO_END),
    (f"{COLUMNS}\n{TWICE}\n{TWICE}\n", "line 3: expected each draw once .*, found that of line 2"),
]


@pytest.mark.parametrize(("text", "why"), FILES)
def test_a_file_that_is_no_such_table_is_one_line(text: str, why: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(ConfigError, match=rf"a\.csv: .*{why}") as error:
        read_rows(tmp_path / "a.csv")
    assert "\n" not in str(error.value)


def test_a_table_with_a_byte_order_mark_is_read_and_a_folder_is_none(tmp_path: Path) -> None:
    """Spreadsheets write such a mark, and R writes NA where nothing is."""
    text = "controller,scene,seed,trial,outcome,time_s,given\nopen,flat,1,0,timeout,1.0,NA\n"
    (tmp_path / "a.csv").write_text(f"sep=,\n{text}", encoding="utf-8-sig")
    (row,) = read_rows(tmp_path / "a.csv")
    assert (row.controller, row.given) == ("open", "")
    with pytest.raises(ConfigError, match=r"found a folder; name its trials\.csv"):
        read_rows(tmp_path)


HERE = EpisodeRow(
    controller="open",
    scene="flat",
    seed=1,
    trial=0,
    outcome="success",
    time_s=20.0,
    progress_m=2.0,
    engine="e",
    processor="p",
)


@pytest.mark.parametrize(
    "change",
    [
        {"time_s": 19.99},
        {"progress_m": 2.01},
        {"overturned": True},
        {"limit_s": 200.0},
        {"given": "map"},
        {"outcome": "left"},
    ],
)
def test_on_the_same_processor_a_single_row_that_differs_is_refused(change: dict[str, Any]) -> None:
    ours = [replace(HERE, trial=trial) for trial in range(200)]
    theirs = [replace(ours[0], **change), *ours[1:]]
    check = compared(theirs, ours)
    assert (check.same, check.broken) == (199, 1)
    assert "Expected no difference in 1 of them" in refusal(check)
    assert not refusal(compared(ours, ours))
    elsewhere = compared([replace(row, processor="q") for row in theirs], ours)
    assert bool(refusal(elsewhere)) == bool({"limit_s", "given"} & change.keys())


@pytest.mark.parametrize(
    ("theirs", "same"),
    [("Xeon 6 (model 7)", True), ("Xeon 6", True), ("Xeon 6 (model 8)", False), ("Xeon", False)],
)
def test_processors_of_one_name_differ_by_their_numbers(theirs: str, same: bool) -> None:
    """Tables of before hold the name alone: it says no more, so it has to repeat."""
    ours = [replace(HERE, trial=trial, processor="Xeon 6 (model 7)") for trial in range(200)]
    rows = [replace(row, processor=theirs) for row in ours]
    check = compared([replace(rows[0], time_s=19.99), *rows[1:]], ours)
    assert check.broken == same
    said = sentence(standing(ours, 0.01, check))
    assert ("200 are of another version, engine or" in said) == (not same)


def test_on_another_processor_times_may_differ_by_chance_but_not_in_their_mean() -> None:
    """As measured there: a spread of 9.5 s on a limit of 100 s."""
    noise = np.random.default_rng(1).normal(0.0, 9.5, 200)
    noise -= noise.mean()
    ours = [replace(HERE, trial=k, time_s=50.0) for k in range(200)]
    for forged, wrong in ((0.94, False), (-5.0, True)):
        theirs = [
            replace(row, processor="q", time_s=50.0 + forged + float(apart))
            for row, apart in zip(ours, noise, strict=True)
        ]
        check = compared(theirs, ours)
        assert check.broken == 0
        assert check.mean_share_difference == pytest.approx(forged / 100.0)
        assert ("mean times" in refusal(check)) == wrong


@pytest.mark.parametrize(("lost", "won", "wrong"), [(30, 27, False), (2, 9, False), (1, 12, True)])
def test_on_another_processor_rows_may_end_otherwise_but_not_to_one_side(
    lost: int, won: int, wrong: bool
) -> None:
    """P of the sign test, as tables have it: 0.79 of 27 in 57, 0.065 of 2 in 11, 0.0034 of 1 in 13.

    Those of one draw in several conditions of a scene count once.
    """
    ours = [replace(HERE, trial=k, time_s=99.9) for k in range(200)]
    ours[:won] = [replace(row, outcome="left", time_s=100.0) for row in ours[:won]]
    theirs = [replace(row, processor="q") for row in ours]
    theirs[:won] = [replace(row, outcome="success", time_s=99.9) for row in theirs[:won]]
    theirs[-lost:] = [replace(row, outcome="timeout", time_s=100.0) for row in theirs[-lost:]]
    check = compared(theirs, ours)
    assert (check.more_successes, check.other_outcome) == (won - lost, won + lost)
    assert ("as many successes" in refusal(check)) == wrong
    both = [
        [replace(row, scene=f"uturn+readings=delayed:{t:g}") for row in rows[:9] for t in (0.01, 0)]
        for rows in (theirs, ours)
    ]
    assert compared(*both).successes_p == pytest.approx(2.0 * 0.5 ** min(won, 9))


ELSEWHERE = f"{COLUMNS},limit_s,processor"


@pytest.mark.parametrize(
    ("times", "code", "said"),
    [
        (["success,-5,0.3"] * 4, 2, "expected a finite number of 0 to limit_s"),
        pytest.param(
            ["success,0.01,0.3"] * 4,
            2,
            "found mean times that differ by -96.7 % of the limit (p 0.0",
            marks=pytest.mark.ci,
        ),
        pytest.param(
            ["success,0.01,0.3"] * 3, 0, "They are too few to tell.", marks=pytest.mark.ci
        ),
        pytest.param(["timeout,0.3,0.3"] * 4, 0, "4 are of another version", marks=pytest.mark.ci),
    ],
)
def test_a_table_of_few_rows_of_another_processor_is_checked(
    times: list[str],
    code: int,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """4 of 4 draws from the limit to nearly 0 s have a p of 2 / 4^4 = 0.0078; 3 of 3 of 0.03."""
    monkeypatch.chdir(tmp_path)
    rows = [f"open,{SHORT},{DEVELOPMENT.start},{k},{time},q" for k, time in enumerate(times)]
    (tmp_path / "theirs.csv").write_text("\n".join([ELSEWHERE, *rows]) + "\n")
    words = ["--check", "theirs.csv", "--workers", "1", "--no-figures", "--out", "again"]
    assert main(["compete", *words]) == code
    out, err = capsys.readouterr()
    assert said in out + err


@pytest.mark.parametrize("outlier", [100.0, 0.0])
def test_one_row_opens_no_tolerance_for_others(outlier: float) -> None:
    """Each of 30 draws 5 s faster, but one that is as far off as a row may be."""
    ours = [replace(HERE, trial=k, time_s=50.0) for k in range(30)]
    theirs = [replace(row, processor="q", time_s=45.0) for row in ours]
    assert "mean times" in refusal(compared(theirs, ours))
    theirs[0] = replace(theirs[0], time_s=outlier)
    assert "mean times" in refusal(compared(theirs, ours))


def test_far_times_of_few_draws_have_the_chance_of_four_tosses() -> None:
    """Two-sided p of k of n to one side, each with 1/4 at most: SciPy's binomial test."""
    for count, far in ((4, 4), (4, 3), (12, 7), (12, 8)):
        ours = [replace(HERE, trial=k, time_s=90.0) for k in range(count)]
        theirs = [replace(r, processor="q", time_s=10.0 + 80.0 * (r.trial >= far)) for r in ours]
        check = compared(theirs, ours)
        test = binomtest(far, count, 0.25, alternative="greater")
        assert check.far_p == pytest.approx(2.0 * test.pvalue)


def test_the_check_refuses_few_of_the_tables_that_chance_makes() -> None:
    """Draws that end anew on each processor, of every kind: at most 3 in 100 by three tests."""
    rng = np.random.default_rng(5)
    refused = 0
    for _ in range(300):
        crossed = rng.uniform(0.0, 1.0, 12)
        tables = []
        for place in "pq":
            won = rng.random(12) < crossed
            times = np.where(won, rng.uniform(5.0, 99.0, 12), 100.0)
            tables.append(
                [
                    replace(
                        HERE,
                        trial=k,
                        outcome="success" if w else "timeout",
                        time_s=t,
                        processor=place,
                    )
                    for k, (w, t) in enumerate(zip(won.tolist(), times.tolist(), strict=True))
                ]
            )
        refused += bool(refusal(compared(*tables)))
    assert refused <= 0.03 * 300


def test_rows_that_were_not_run_are_not_compared() -> None:
    check = compared([HERE, replace(HERE, trial=1)], [HERE])
    assert (check.rows, check.same, check.differ) == (1, 1, [])


# scenes and controllers with other parameters


def test_a_scene_takes_a_robot_by_its_name_or_file(tmp_path: Path) -> None:
    (own := tmp_path / "own.toml").write_text("[antenna]\nlength = 0.15\n")
    longer = tunnel_config(f"uturn+robot={own}+readings=none", "open", 0)
    assert (longer.robot.antenna.length, longer.readings) == (0.15, ("none",))
    assert tunnel_config("uturn+robot=scuttle3d", "open", 0).robot == RobotSpec.named("scuttle3d")
    with pytest.raises(ConfigError, match=r"^scenes: 'uturn.robot=no.toml': .*no.toml"):
        tunnel_config("uturn+robot=no.toml", "open", 0)


def test_a_scene_takes_parameters_as_the_configuration_does() -> None:
    text = "tunnel+tunnel.turns_deg=[120]+variation.broken=left+readings=delayed:0.02+time_limit=5"
    config = tunnel_config(text, "closed", 3)
    assert config.tunnel.turns_deg == (120.0,)
    assert config.variation.broken == "left"
    assert (config.readings, config.time_limit) == (("delayed:0.02",), 5.0)
    assert (config.scene, config.seed, config.controllers) == ("tunnel", 3, ("closed",))
    assert tunnel_config("step_up+ground.height=0.05", "open", 0).ground.height == 0.05
    assert label("uturn+variation.broken=left") == "uturn, broken=left"
    assert tunnel_config("a+b.py:Scene+time_limit=1", "open", 0).scene == "a+b.py:Scene"


def test_a_controller_takes_numbers_of_the_control_as_the_configuration_does() -> None:
    text = "a+b.py:Mine+gait.frequency=0.8+schedule.headings=[0.5, 1]"
    config = tunnel_config("uturn+time_limit=5", text, 3)
    assert (config.scene, config.controllers) == ("uturn", ("a+b.py:Mine",))
    assert config.control.gait.frequency == 0.8
    assert config.control.schedule.headings == (0.5, 1.0)
    names = ["geometric", "geometric+gait.frequency=0.8", "x/policy.onnx+gait.frequency=0.5"]
    assert [*labels(names).values()] == [
        "geometric",
        "geometric, frequency=0.8",
        "x, frequency=0.5",
    ]
    found = CompeteConfig(controllers=("./x.py:Mine+gait.frequency=0.5",), scenes=("room",))
    assert found.controllers == ("x.py:Mine+gait.frequency=0.5",)
    assert [*found.names_in_files()] == ["x.py:Mine", "room"]  # code that a run depends on


@pytest.mark.ci
def test_a_row_of_a_controller_with_other_numbers_is_that_of_tunnel_with_them() -> None:
    """The text of the controller stands in its row, whole."""
    text = "timed+gait.frequency=0.8+timed.walk_time=1"
    (row,) = episodes(text, scene="uturn+time_limit=4")
    settings: dict[str, Any] = {"controllers": ["timed"], "scene": "uturn", "trials": 1}
    settings |= {"time_limit": 4.0, "seed": DEVELOPMENT.start}
    settings |= {"control": {"gait": {"frequency": 0.8}, "timed": {"walk_time": 1.0}}}
    (other,) = antennate.run("tunnel", **settings).rows
    assert (row.controller, row.progress_m) == (text, other.progress_m)
