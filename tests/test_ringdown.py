"""Antennae swing as closed forms, the engine's own mass matrix and its ring-down say."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import mujoco
import numpy as np
import pytest

from antennate.antenna.dynamics import LinearChain, least_damping
from antennate.cli import main
from antennate.experiments.antenna.config import AntennaConfig
from antennate.experiments.antenna.physics import Trace, ringdown_of
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import compile_bench

QUICK = Path(__file__).parents[1] / "examples" / "quick_antenna.toml"
RIGID = {"base_stiffness": 1e5, "base_damping": 0.0}


def test_one_hinge_is_a_pendulum_on_a_spring() -> None:
    """w^2 = k / (m L^2 / 3 + armature) of a thin rod, damping ratio tau w / 2."""
    antenna = AntennaSpec(active_coils=(3.0,), radius=1e-5, damping_time=0.004, **RIGID)
    inertia = antenna.link_mass * antenna.length**2 / 3 + antenna.armature
    natural = math.sqrt(antenna.hinge_stiffness()[0] / inertia)
    first = LinearChain.of(antenna).first_mode()
    assert first.natural_hz == pytest.approx(natural / (2 * math.pi), rel=1e-3)
    assert first.damping == pytest.approx(antenna.damping_time * natural / 2, rel=1e-3)


def test_a_chain_that_creeps_back_has_the_slow_root_of_its_pendulum() -> None:
    """Overdamped: the slow root of w^2 + 2 z w s + s^2, though the stiff base swings."""
    antenna = AntennaSpec(active_coils=(3.0,), radius=1e-5, damping_time=0.2, **RIGID)
    inertia = antenna.link_mass * antenna.length**2 / 3 + antenna.armature
    natural = math.sqrt(antenna.hinge_stiffness()[0] / inertia)
    ratio = 0.1 * natural
    first = LinearChain.of(antenna).first_mode()
    assert first.swing_hz == 0
    assert -first.root.real == pytest.approx(natural * (ratio - math.sqrt(ratio**2 - 1)), rel=1e-3)


@pytest.mark.parametrize("coils", [(3.0, 6.0, 6.0, 9.0, 9.0, 9.0), (5.0,) * 14])
def test_the_mass_matrix_is_that_of_the_engine(coils: tuple[float, ...]) -> None:
    antenna = AntennaSpec(active_coils=coils)
    model = compile_bench(BenchPhysicsParams(), antenna)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rows = []
    for unit in np.eye(model.nv):  # M times each unit vector
        row = np.zeros(model.nv)
        mujoco.mj_mulM(model, data, row, unit)
        rows.append(row)
    joints = [model.joint(f"antenna/{name}").dofadr[0] for name in ("base", *antenna.hinge_names)]
    found = np.array(rows)[np.ix_(joints, joints)]
    assert LinearChain.of(antenna).mass == pytest.approx(found, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"damping_time": 0.005},
        {"damping_time": 0.1},
        {"active_coils": (3.0,)},
        {"active_coils": (3.0, 6.0, 6.0, 6.0, 9.0, 9.0, 9.0, 9.0, *(12.0,) * 6)},
        {"active_coils": (6.0, 9.0, 9.0), "length": 0.09},
    ],
)
def test_the_compiled_antenna_swings_as_its_eigenvalues_say(changes: dict[str, object]) -> None:
    found, _ = ringdown_of(AntennaConfig(antenna=AntennaSpec.model_validate(changes)))
    assert found.engine.natural_hz == pytest.approx(found.chain.natural_hz, rel=0.02)
    assert found.engine.damping == pytest.approx(found.chain.damping, rel=0.02)


def test_the_default_antenna_is_damped_like_an_animal_and_much_slower() -> None:
    """2.575 Hz undamped, 2.431 Hz damped and a ratio of .329 were worked out beside this code."""
    result, _ = ringdown_of(AntennaConfig())
    assert result.chain.natural_hz == pytest.approx(2.575, abs=0.001)
    assert result.engine.swing_hz == pytest.approx(2.431, abs=0.01)
    assert result.engine.damping == pytest.approx(0.329, abs=0.005)
    assert result.rejected_in_animal_cycle < 0.5


def test_the_damping_that_rejects_nine_tenths_in_a_cycle() -> None:
    ratio = least_damping(0.1)
    assert math.exp(-2 * math.pi * ratio / math.sqrt(1 - ratio**2)) == pytest.approx(0.1)
    assert ratio == pytest.approx(0.34, abs=0.005)


def test_the_quick_antenna_recovers_as_a_cockroach_does() -> None:
    """Mongeau 2014: more than 90 % of a deflection is rejected in a cycle of about 50 ms."""
    antenna = AntennaSpec.model_validate(tomllib.loads(QUICK.read_text())["antenna"])
    for timestep in (1e-4, 5e-4):
        physics = BenchPhysicsParams(timestep=timestep)
        result, _ = ringdown_of(AntennaConfig(antenna=antenna, physics=physics))
        assert result.rejected > 0.9
        assert result.engine.cycle_s == pytest.approx(0.050, rel=0.1)


@pytest.mark.ci
def test_the_command_takes_the_quick_antenna_and_says_how_it_recovers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["antenna", str(QUICK), "--out", str(tmp_path / "out")]) == 0
    assert "of 52 ms, 1.0 times a cockroach's" in capsys.readouterr().out
    assert (tmp_path / "out" / "figures" / "ringdown.png").exists()
    assert main(["antenna", "--no-figures", "--out", str(tmp_path / "slow")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "8.2 times a cockroach's" in said
    assert "one cycle [ms] 412 411" in said  # 1 / 2.431 Hz


@pytest.mark.ci
def test_the_quick_antenna_stands_beside_the_default_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Mongeau 2014: 20 Hz and a damping ratio above 0.344, beside one of 2.6 Hz."""
    words = ["--beside", str(QUICK), "--out", str(tmp_path / "out")]
    assert main(["antenna", *words]) == 0
    assert "chain of quick antenna" in " ".join(capsys.readouterr().out.split())
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    result = result["ringdown"]
    beside = result["beside"]["quick antenna"]
    assert beside["natural_hz"] == pytest.approx(20.0, rel=0.15)
    assert beside["damping"] > 0.344
    drawn = (tmp_path / "out" / "figures" / "ringdown.svg").read_text()
    assert result["engine"]["natural_hz"] < 3.0
    assert all(name in drawn for name in ("this antenna", "quick antenna"))


@pytest.mark.parametrize("places", [("a", "b"), ("a", "a")])
def test_antennae_of_files_of_one_name_stand_beside_each_other(
    places: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for place in places:
        Path(place).mkdir(exist_ok=True)
        Path(place, "robot.toml").write_text("[antenna]\nactive_coils = [3.0, 5.0]\n")
    files = [f"{place}/robot.toml" for place in places]
    assert main(["antenna", "--beside", *files, "--no-figures", "--out", "out"]) == 0
    beside = json.loads(Path("out/result.json").read_text())["ringdown"]["beside"]
    assert [*beside] == (files if places[0] != places[1] else ["robot"])


def test_one_hinge_that_creeps_back_has_no_swing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One cycle is then that of the swing without damping."""
    words = ["--antenna.active-coils", "3", "--no-figures", "--out", str(tmp_path / "out")]
    assert main(["antenna", *words]) == 0, capsys.readouterr().err
    found = json.loads((tmp_path / "out" / "result.json").read_text())["ringdown"]
    engine = found["engine"]
    assert (engine["swing_hz"], engine["damping"]) == (0.0, 1.0)
    assert engine["cycle_s"] * engine["natural_hz"] == pytest.approx(1.0)
    assert 0 < found["rejected_in_animal_cycle"] < found["rejected"] < 1


def test_after_the_last_sample_what_it_has_lost_counts() -> None:
    trace = Trace(np.array([0.0, 0.1, 0.2]), np.array([1.0, -0.5, 0.25]))
    assert trace.rejected(0.1) == 0.5
    assert trace.rejected(0.3) == 0.75


def test_a_stiff_stop_holds_a_hinge_that_a_soft_one_lets_go_on() -> None:
    """What a stop yields goes with the square of its time: solref of the engine."""

    def beyond(stop_time: float) -> float:
        antenna = AntennaSpec(active_coils=(3.0,), range=0.5, stop_time=stop_time, **RIGID)
        model = compile_bench(BenchPhysicsParams(), antenna)
        data = mujoco.MjData(model)
        hinge = model.joint("antenna/hinge0")
        data.qfrc_applied[hinge.dofadr[0]] = 2 * antenna.hinge_stiffness()[0] * 0.5
        mujoco.mj_step(model, data, 4000)
        return float(data.qpos[hinge.qposadr[0]]) - 0.5

    assert beyond(0.02) > math.radians(1.0)
    assert 0 < beyond(0.002) < beyond(0.02) / 25


HEXAPOD = """links = 6
[antenna]
base_angle = 0.5
active_coils = [3.0, 5.0]
"""


@pytest.mark.parametrize(
    ("text", "hinges"),
    [
        ("active_coils = [3.0, 5.0]\n[sensor]\nsupply = 3.0\n", 2),
        (HEXAPOD, 2),
        ("seed = 3\n[antenna]\nactive_coils = [4.0]\n", 1),
    ],
)
def test_a_file_is_an_antenna_a_robot_or_parameters(
    text: str, hinges: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The mounting angle of a robot, which is not read here, may stand in its file."""
    (tmp_path / "mine.toml").write_text(text)
    words = [str(tmp_path / "mine.toml"), "--no-figures", "--out", str(tmp_path / "out")]
    assert main(["antenna", *words]) == 0, capsys.readouterr().err
    told = tomllib.loads((tmp_path / "out" / "config.toml").read_text())
    assert len(told["antenna"]["active_coils"]) == hinges
    assert told["antenna"]["sensor"]["supply"] == (3.0 if "supply" in text else 3.3)
    assert told["seed"] == (3 if "seed" in text else 0)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("links = 6\nantena = 3\n", "antena"),
        ("active_coils = [3.0]\nlenght = 0.1\n", "lenght"),
        ("sed = 3\n", "sed"),
    ],
)
def test_a_key_that_none_of_them_has_is_refused(
    text: str, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.toml").write_text(text)
    assert main(["antenna", str(tmp_path / "mine.toml"), "--out", str(tmp_path / "out")]) == 2
    assert f"mine.toml: {why}: " in capsys.readouterr().err
