"""The benchmarks measure what they say."""

import importlib
import importlib.util
import sys
from pathlib import Path

import pytest

from antennate.experiments.tunnel.run import TunnelConfig
from antennate.params.scene import TunnelParams
from antennate.robots.spec import RobotSpec

FOLDER = Path(__file__).parents[1] / "benchmarks"


def loaded(name):
    if not FOLDER.is_dir():
        pytest.skip("benchmarks are not part of this copy")
    spec = importlib.util.spec_from_file_location(f"benchmark_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def trial():
    return loaded("trial")


def test_a_drive_that_ended_in_a_fault_says_its_causes():
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


def test_long_tunnel_has_cylinders_enough(trial):
    drawn, order = trial.long_tunnel(TunnelConfig())
    assert sorted(order) == list(range(len(drawn.cylinders)))
    assert len(order) >= max(trial.COUNTS)


def test_three_masters_are_put_to_the_same_test(monkeypatch):
    """Ours takes no wrong and no stale value; how long anything takes is not judged here."""
    if not FOLDER.is_dir():
        pytest.skip("benchmarks are not part of this copy")
    monkeypatch.syspath_prepend(str(FOLDER))
    bus = importlib.import_module("bus")
    found = bus.measure("ours", reads=1)
    assert found.late_asked > 0
    assert found.crc_wrong == found.late_stale == 0
    assert set(bus.MASTERS) == {"ours", "rustypot", "sdk"}
