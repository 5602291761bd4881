"""Ours beside other simulators on the nearest job that each of them can do, in CPU time.

Every peer has an environment of its own under `peers/.venv`, made at the first run from the
versions in `peers/NAME.txt`, since some of them bring an engine that would overwrite ours.
Its script `peers/run_NAME.py` stays open and does its job whenever it is asked, in turn with ours.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import growth
import numpy as np
from measuring import cpu_seconds, in_turn, ratios, spread

from antennate.messages import shortened
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.spec import RobotSpec
from antennate.sim.bench import Ball, Bench, compile_bench
from antennate.types import Floats

FOLDER = Path(__file__).with_name("peers")
INSTALL_LIMIT = 420.0
"""Time within which a peer has to be installed [s]."""
JOBS = {"flygym": ("walk",), "pyelastica": ("antenna",), "pybullet": ("antenna", "walk")}
"""What each peer is asked for, and which of our jobs stands beside it."""
PYTHONS = {"flygym": "3.12"}
"""The Python of peers that do not run on ours."""
STEP = 1e-3
"""Physics step of our antenna [s]; our robot walks with that of the tunnel."""
COMMAND = 0.01
"""Time between two commands [s]."""
SWING = 0.5
"""Amplitude of the base [rad] at 1 Hz: the antenna meets the ball once a second."""
BALL = Ball(0.08, 0.03, 0.01)


def described() -> dict[str, Any]:
    """Our antenna and robot in numbers, for peers that build the same."""
    antenna, robot = AntennaSpec(), RobotSpec()
    return {
        "antenna": {
            "length": antenna.length,
            "radius": antenna.radius,
            "stiffness": list(antenna.hinge_stiffness()),
            "damping_time": antenna.damping_time,
            "armature": antenna.armature,
            "link_mass": antenna.link_mass,
            "friction": antenna.friction,
        },
        "robot": {
            "links": robot.links,
            "link_pitch": robot.link_pitch,
            "link_mass": robot.link_mass,
            "width": robot.width,
            "body_radius": robot.body_radius,
            "leg_radius": robot.leg_radius,
            "leg_width": robot.leg_width,
            "leg_eccentricity": robot.leg_eccentricity,
            "leg_mass": robot.leg_mass,
            "leg_friction": robot.leg_friction,
        },
        "ball": [BALL.x, BALL.y, BALL.radius],
        "swing": SWING,
        "command": COMMAND,
        "step": STEP,
    }


def base_angles(seconds: float) -> Floats:
    """Angles of the antenna's base, one a command [rad]."""
    return SWING * np.sin(2.0 * np.pi * np.arange(0.0, seconds, COMMAND))


def antenna(seconds: float) -> float:
    """CPU time of our antenna on the engine [s]."""
    spec, physics = AntennaSpec(), BenchPhysicsParams(timestep=STEP, contact_time=2 * STEP)
    bench = Bench(compile_bench(physics, spec, [BALL]), spec)
    bench.place(0.0, 0.0, 0.0)

    def go() -> None:
        for angle in base_angles(seconds).tolist():
            bench.command(0.0, 0.0, 0.0, 0.0, angle)
            bench.step(round(COMMAND / STEP))
            bench.flex()

    return cpu_seconds(go)


def installed(name: str) -> Path:
    """The Python of a peer's environment, which is made if it is missing.

    Raises:
        RuntimeError: It cannot be installed; the reason in one line.
    """
    folder = FOLDER / ".venv" / name
    python, done = folder / "bin" / "python", folder / "installed.txt"
    wanted = FOLDER / f"{name}.txt"
    if done.exists() and done.read_text() == wanted.read_text():
        return python
    wish, base = sys.executable, shutil.which(sys.executable)
    if name in PYTHONS:
        wish = PYTHONS[name]
        own = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
        path = os.pathsep.join([*map(str, own.glob(f"{wish}*/bin")), os.environ["PATH"]])
        base = shutil.which(f"python{wish}", path=path)
    uv = shutil.which("uv")
    if uv:
        make = [uv, "venv", "--quiet", "--clear", "--python", base or wish]
        fill = [uv, "pip", "install", "--quiet", "--python", str(python)]
    elif base:
        make = [base, "-m", "venv", "--clear"]
        fill = [str(python), "-m", "pip", "install", "--quiet"]
    else:
        raise RuntimeError(f"it needs Python {wish}, which was not found")
    for words in ([*make, str(folder)], [*fill, "--only-binary", ":all:", "-r", str(wanted)]):
        try:
            ended = subprocess.run(
                words, capture_output=True, text=True, timeout=INSTALL_LIMIT, check=False
            )
        except subprocess.TimeoutExpired:
            raise RuntimeError(f"not installed within {INSTALL_LIMIT:g} s") from None
        if ended.returncode:
            lines = [line.strip(" ×│╰─▶") for line in ended.stderr.splitlines() if line.strip()]
            raise RuntimeError(shortened(" ".join(lines[-2:]) or f"exit code {ended.returncode}"))
    done.write_text(wanted.read_text())
    return python


class Peer:
    """A peer's script, which does a job for some simulated seconds when asked."""

    def __init__(self, name: str, stack: ExitStack) -> None:
        self._process = subprocess.Popen(
            [str(installed(name)), str(FOLDER / f"run_{name}.py"), json.dumps(described())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        stack.callback(self._process.wait)
        stack.callback(self._process.kill)

    def ask(self, job: str, seconds: float) -> dict[str, Any]:
        """Its answer: `cpu_s` for so many simulated seconds, and what it says of itself.

        Raises:
            RuntimeError: It ended.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(json.dumps({"job": job, "seconds": seconds}) + "\n")
            self._process.stdin.flush()
            while line := self._process.stdout.readline():
                if line.startswith("{"):  # some packages greet on the same stream
                    return json.loads(line)
            raise BrokenPipeError
        except BrokenPipeError:
            raise RuntimeError(f"its script ended with code {self._process.wait()}") from None


def measure(quick: bool) -> dict[str, Any]:
    """CPU time a simulated second of all jobs, ours and theirs in turn."""
    share = 0.2 if quick else 1.0
    lengths = {"walk": 5.0 * share, "antenna": 10.0 * share}
    ours: dict[str, Callable[[], float]] = {
        "walk": lambda: growth.flat(lengths["walk"]) / lengths["walk"],
        "antenna": lambda: antenna(lengths["antenna"]) / lengths["antenna"],
    }
    cases: dict[Any, Callable[[], float]] = {("antennate", job): run for job, run in ours.items()}
    peers: dict[str, dict[str, Any]] = {}
    with ExitStack() as stack:
        for name, jobs in JOBS.items():
            try:
                peer = Peer(name, stack)
                # the first answer says how long the job may be, and warms up what it compiles
                first = {job: peer.ask(job, 0.02) for job in jobs}
                first = {job: peer.ask(job, 0.02) for job in jobs}
            except RuntimeError as error:
                peers[name] = {"failed": str(error)}
                continue
            peers[name] = {"jobs": first}
            for job in jobs:
                cost = first[job]["cpu_s"] / 0.02
                seconds = min(lengths[job], max(0.02, 4.0 * share / cost))
                cases[name, job] = lambda p=peer, j=job, s=seconds: p.ask(j, s)["cpu_s"] / s
        found = in_turn(cases, 2 if quick else 5)
    for name, about in peers.items():
        for job, said in about.get("jobs", {}).items():
            said.pop("cpu_s")
            said["cpu_per_s"] = spread(found[name, job])
            said["ours_faster"] = spread(ratios(found[name, job], found["antennate", job]))
    return {
        "ours": {job: {"cpu_per_s": spread(found["antennate", job])} for job in ours},
        "peers": peers,
    }
