"""Simulations, their logs and environments load what they use: no servos, ports and no twin."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.ci

ALONE = "--no-figures --workers 1"
SHORT = f"--time-limit 1 {ALONE}"
ANTENNA = f"--profiles descending {ALONE}"
COMMANDS = [
    f"tunnel --trials 1 {SHORT} --controllers closed geometric --log --out walk",
    f"tunnel --trials 1 {SHORT} --controllers paper --readings none --out blind",
    "log info walk/logs/closed-0.mcap",
    "log export walk/logs/closed-0.mcap",
    "log plot walk/logs/closed-0.mcap",
    "log replay walk/logs/closed-0.mcap --out again",
    "report walk",
    "climb --help",
    f"gait --cycles 2 --settling-cycles 1 --sweep-points 2 {ALONE} --out gait",
    f"calibrate --rig.pushes 1 {ALONE} --out calibrate",
    f"bench wall --trials 1 {ANTENNA} --out wall",
    "antenna --no-figures --out antenna",
    "servo --help",
    "tracks --help",
    "dataset --help",
    "reproduce --help",
    "compete --help",
    "geometry --help",
    "study merge --help",
]
DATA = {
    "dynamixel_bus",
    *(f"dynamixel_bus.{name}" for name in ("errors", "files", "messages")),
    *(f"dynamixel_bus.{name}" for name in ("model", "model_file", "models")),
}
"""Ratings and registers of servo models; a description of a robot names them."""
MOST_OF_TUNNEL = 90
"""Modules of ours that `tunnel` loads. Ten stand at the top: figures, files, words, signals. There
are 6 of `cli` (a command, its flags, what it prints), 10 of `experiments` (the tunnel), 18 of
`studies` (workers, the run, its page), 3 of `telemetry` (names and versions in a run), 15 of `sim`
(engine, world and tunnel), 12 of `control` (the loop and the usual four), 13 of `robots` and
`params`, which a configuration holds whole, and 3 of `antenna` (sensor, loads)."""
WATCHED = """
def hardware():
    rooms = ("antennate.hardware", "antennate.twin", "dynamixel_bus", "serial")
    return [name for name in sys.modules if name.startswith(rooms)]
"""


def loaded(tmp_path: Path, code: str, *more: str) -> list[set[str]]:
    """Modules of hardware after each line of JSON that a program prints to its errors."""
    words = [sys.executable, "-c", f"import json, sys\n{WATCHED}\n{code}", *more]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, timeout=240)
    assert done.returncode == 0, done.stderr[-2000:]
    return [set(json.loads(line)) for line in done.stderr.splitlines() if line.startswith("[")]


def test_commands_of_simulation_and_logs(tmp_path: Path) -> None:
    code = """
from antennate.cli import main
for words in json.loads(sys.argv[1]):
    assert main(words.split()) == 0, words
    print(json.dumps(hardware()), file=sys.stderr)
"""
    found = loaded(tmp_path, code, json.dumps(COMMANDS))
    assert len(found) == len(COMMANDS)
    for words, names in zip(COMMANDS, found, strict=True):
        assert names <= DATA, words


def test_tunnel_loads_what_it_uses(tmp_path: Path) -> None:
    code = """
from antennate.cli import main
assert main("tunnel --trials 1 --time-limit 1 --workers 1 --out walk".split()) == 0
print(json.dumps([name for name in sys.modules if name.startswith("antennate")]), file=sys.stderr)
"""
    (names,) = loaded(tmp_path, code)
    unused = ("climbing", "geometric", "steering", "mjcf", "ground", "topics", "pages", "help")
    assert [name for name in names if name.endswith(unused)] == []
    assert len(names) <= MOST_OF_TUNNEL


def test_an_environment(tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    code = """
import gymnasium, antennate.envs
env = gymnasium.make("antennate/Tunnel-v1")
env.reset(seed=1)
env.step(env.action_space.sample())
print(json.dumps(hardware()), file=sys.stderr)
"""
    (names,) = loaded(tmp_path, code)
    assert names <= DATA


def test_the_twin_loads_them(tmp_path: Path) -> None:
    code = """
from antennate.cli import main
assert main(["twin", "--help"]) == 0
print(json.dumps(hardware()), file=sys.stderr)
"""
    (names,) = loaded(tmp_path, code)
    assert "antennate.twin.robot" in names
