"""The benchmarks measure what they say."""

import importlib
import json
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from antennate.control.registry import make_controller
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.params.scene import TunnelParams
from antennate.robots.spec import RobotSpec

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "benchmarks"


@pytest.fixture
def loaded(monkeypatch):
    """Imports a module of the benchmarks by its name."""
    if not FOLDER.is_dir():
        pytest.skip("benchmarks are not part of this copy")
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module


@pytest.fixture
def trial(loaded):
    return loaded("trial")


def test_a_drive_that_ended_in_a_fault_says_its_causes(loaded):
    pace = loaded("pace")
    why = "FAULT SILENT_SERVO: servos do not answer (servo 7); HOLD STALE: no fresh sample"
    ended = {"worst_state": "FAULT", "why": why, "pace": None, "walking": None}
    assert pace.summary(ended) == {"walked": False, "fault": why, "why": why}
    assert pace.summary({"worst_state": "HOLD", "why": "HOLD", "refusal": ""})["fault"] == ""
    assert pace.summary({})["why"] == "no result"


@pytest.mark.parametrize("gear", [{}, {"friction": 0.02, "load_friction": 0.3}])
def test_replay_ends_on_the_same_bits(trial, gear):
    robot = RobotSpec.model_validate({"servos": {"xc430_w240": gear}})
    config = TunnelConfig(time_limit=1.0, robot=robot)
    tapes, ended = trial.record(config, 2)
    assert [len(tape.ticks) for tape in tapes] == [100, 100]
    assert tapes[0].ticks[0][0] is not None, "legs draw their friction at the first tick"
    worlds = [start.world for start in trial.prepare(config, 2)]
    trial.replay(tapes, worlds)
    trial.check_same(worlds, ended)


def test_a_replay_that_differs_is_refused(trial):
    config = TunnelConfig(time_limit=0.2, tunnel=TunnelParams(strewn=0))
    tapes, ended = trial.record(config, 1)
    tapes[0].ticks.pop()
    worlds = [start.world for start in trial.prepare(config, 1)]
    trial.replay(tapes, worlds)
    with pytest.raises(SystemExit, match="qpos differs"):
        trial.check_same(worlds, ended)


def test_each_engine_of_the_numerics_reaches_the_walk(loaded):
    numerics = loaded("numerics")
    elliptic, pyramid = (
        numerics.walk(numerics.Engine("", timestep=0.004, contact_time=0.008, pyramidal=cone))
        for cone in (False, True)
    )
    assert elliptic["speed_m_s"] != pyramid["speed_m_s"]


def test_long_tunnel_has_cylinders_enough(loaded):
    growth = loaded("growth")
    drawn, order = growth.long_tunnel(TunnelConfig())
    assert sorted(order) == list(range(len(drawn.cylinders)))
    assert len(order) >= max(growth.CYLINDERS)


def test_cut_springs_bend_as_much(loaded):
    """Springs in series: their compliances add up to those of the whole ones."""
    growth = loaded("growth")
    whole = np.reciprocal(growth.with_hinges(6).antenna.spring_stiffness()).sum()
    for count in growth.HINGES[1:]:
        antenna = growth.with_hinges(count).antenna
        assert antenna.hinges == count
        assert np.reciprocal(antenna.spring_stiffness()).sum() == pytest.approx(whole)


def test_the_humanoid_is_as_large_as_that_of_the_samples(trial):
    model = trial.humanoid()
    assert (model.nv, model.nu) == (27, 21)


def test_a_spread_is_a_median_with_its_ends(loaded):
    measuring = loaded("measuring")
    found = measuring.spread([3.0, 1.0, 2.0])
    assert found == {"median": 2.0, "low": 1.0, "high": 3.0, "count": 3}


def test_cases_are_measured_in_turn(loaded):
    order = []
    cases = {name: lambda n=name: order.append(n) or float(len(order)) for name in "ab"}
    found = loaded("measuring").in_turn(cases, 2)
    assert order == ["a", "b", "b", "a"]
    assert found == {"a": [1.0, 4.0], "b": [2.0, 3.0]}


def test_two_threads_give_the_same_rows(loaded):
    """The rows of one lockstep batch on two threads, an uneven number of them."""
    cores = loaded("cores")
    config = TunnelConfig(time_limit=0.5)
    expected = cores.rows_of(config, range(3))
    with ThreadPoolExecutor(cores.CORES) as pool:
        found = cores.on_threads(config, 3, pool)
    assert sorted(found, key=lambda row: row.trial) == expected


def test_the_first_step_is_noted_once(loaded, monkeypatch, tmp_path):
    starting, trial = loaded("starting"), loaded("trial")
    monkeypatch.setenv(starting.NOTE, str(tmp_path / "note"))
    config = TunnelConfig(time_limit=0.05)
    made = starting.noting(config.control, config.robot, 1)
    plain = make_controller("closed", config.control, config.robot, 1)
    for frame in trial.frames_of(config, 1):
        assert np.array_equal(made.step(frame).yaw, plain.step(frame).yaw)
    assert len((tmp_path / "note").read_text().split()) == 1


@pytest.mark.ci
def test_three_masters_are_put_to_the_same_test(loaded):
    """Ours takes no wrong and no stale value; how long anything takes is not judged here."""
    bus = loaded("bus")
    found = bus.measure("ours", reads=1)
    assert found.late_asked > 0
    assert found.crc_wrong == found.late_stale == 0
    assert set(bus.MASTERS) == {"ours", "rustypot", "sdk"}


def run_page(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", str(folder / "performance.py"), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture
def page(tmp_path):
    """The script of the page beside what was measured."""
    for name in ("performance.py", "generated.py", "performance.json", "performance.toml"):
        shutil.copy(ROOT / "docs" / name, tmp_path / name)
    return tmp_path


@pytest.mark.ci
def test_the_page_tells_what_was_measured(page):
    assert "out of date" in run_page(page, "--check").stderr
    done = run_page(page)
    assert done.returncode == 0, done.stderr
    text = (page / "performance.md").read_text()
    measured = json.loads((page / "performance.json").read_text())
    for engine, found in measured["agreement"]["figures"]["ways"].items():
        closed = found["closed"]
        assert f"| {engine} | {closed['successes']}, {closed['time_s']} s |" in text
    assert run_page(page, "--check").returncode == 0


@pytest.mark.ci
def test_the_page_says_what_is_missed_not_measured_and_busy(page):
    file = page / "performance.json"
    parts = json.loads(file.read_text())
    del parts["start"]
    over = parts["trial"]["figures"]["at_once"]["24"]["over_bare_engine"]
    over |= {"median": 1.5, "low": 1.4, "high": 1.6}
    parts["trial"]["about"] |= {"others": 1.25, "quick": False}
    parts["peers"]["figures"]["peers"]["pybullet"] = {"failed": "no wheel | found"}
    file.write_text(json.dumps(parts))
    assert run_page(page).returncode == 0
    text = (page / "performance.md").read_text()
    assert "| 1.5 (1.4–1.6) | **not met**, machine not idle |" in text
    assert "Not measured yet: `uv run python benchmarks/performance.py --parts start`." in text
    assert "**The machine was not idle** while trial" in text
    assert "not measured: no wheel &#124; found" in text
