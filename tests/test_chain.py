"""The compiled chain against closed forms, against eigenvalues, and against the engine."""

from __future__ import annotations

import math
import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from antennate import experiments
from antennate.antenna.dynamics import LinearChain, fitted_mode
from antennate.antenna.statics import Chain, equilibrium
from antennate.cli import main
from antennate.errors import ConfigError, MissingPackageError, OutputError, SimulationError
from antennate.experiments.calibrate.run import CalibrateConfig, push
from antennate.experiments.running import require_films
from antennate.experiments.sweep import physics as scan
from antennate.experiments.wall.experiment import run
from antennate.experiments.wall.physics import WallConfig, passage
from antennate.messages import command_words
from antennate.params.bench import SweepParams
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim import chain as fast
from antennate.sim.bench import Ball, Bar, Bench, Slider, compile_bench
from antennate.sim.chain import ChainBench, Motion
from antennate.studies.statistics import wilson95

ANTENNA = AntennaSpec()
PHYSICS = BenchPhysicsParams()
STEP = PHYSICS.timestep
PERIOD = 4 * STEP


def along(bench: ChainBench, way: np.ndarray, base: float, dt: float = PERIOD) -> Motion:
    """Move the carriage along places of shape (k, 2), one every `dt`."""
    speeds = np.gradient(way, dt, axis=0) if len(way) > 1 else np.zeros_like(way)
    return bench.drive(bench.commands(way, speeds, base), round(dt / STEP))


def hold(bench: ChainBench, seconds: float, place: tuple[float, float] = (0.0, 0.0)) -> Motion:
    return along(bench, np.tile(place, (round(seconds / PERIOD), 1)), 0.0)


def raised(depth: float, seconds: float) -> np.ndarray:
    y = np.linspace(0.0, depth, round(seconds / PERIOD))
    return np.column_stack([np.zeros_like(y), y])


def test_weight_bends_by_the_sum_of_its_levers() -> None:
    """Small angles: hinge i carries all links beyond it at their middles."""
    bench = ChainBench(PHYSICS, ANTENNA, (), (0.0, -1.0))
    link, mass, stiffness = ANTENNA.link_length, ANTENNA.link_mass, Chain.of(ANTENNA).stiffness
    expected = [
        -sum(mass * 1.0 * (j + 0.5 - i) * link for j in range(i, 6)) / stiffness[i]
        for i in range(6)
    ]
    assert hold(bench, 1.5).hinges[-1] == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("hinges", [6, 14, 40])
def test_a_smooth_ball_bends_it_as_the_closed_form_says(hinges: int) -> None:
    coils = tuple(np.linspace(3.0, 9.0, hinges) * 6 / hinges)
    antenna = AntennaSpec(active_coils=coils, friction=0.0, sensor_stiffness_n_mm_per_deg=0.0)
    ball = Ball(0.09, 0.02, 0.004)
    bench = ChainBench(PHYSICS, antenna, [ball])
    along(bench, raised(0.04, 1.0), 0.0)
    rest = hold(bench, 1.0, (0.0, 0.04))
    angle = rest.base[-1]
    joints = rest.joints[-1]
    links = np.diff(joints, axis=0)
    share = np.einsum("ij,ij->i", [ball.x, ball.y] - joints[:-1], links) / antenna.link_length**2
    gaps = joints[:-1] + share.clip(0, 1)[:, None] * links - [ball.x, ball.y]
    nearest = int(np.hypot(*gaps.T).argmin())
    place = (nearest + share[nearest]) * antenna.link_length
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    found = equilibrium(Chain.of(antenna), np.array([place]), (turn @ rest.force[-1])[None])
    assert found.solved[0]
    assert abs(found.angles).max() > 0.02
    assert rest.hinges[-1] == pytest.approx(found.angles[0], abs=2e-4)


@pytest.mark.parametrize("damping_time", [0.04, 0.005])
def test_it_rings_down_as_its_eigenvalues_say(damping_time: float) -> None:
    antenna = AntennaSpec(damping_time=damping_time)
    linear = LinearChain.of(antenna)
    mode = linear.first_mode()
    bench = ChainBench(PHYSICS, antenna)
    bent = math.radians(5.0) * linear.pushed_at_tip()
    bench.place(0.0, 0.0, bent[0], bent[1:])
    seen = along(bench, np.zeros((1600, 2)), 0.0, STEP)
    angles = np.column_stack([seen.base, seen.hinges])
    speeds = np.diff(angles, axis=0) / STEP
    t = STEP * np.arange(len(speeds))
    found = fitted_mode(mode, t, angles[1:], speeds)
    assert found.swing_hz == pytest.approx(mode.swing_hz, rel=0.005)
    assert found.damping == pytest.approx(mode.damping, rel=0.01)


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.8])
def test_it_sticks_within_the_friction_cone_and_slides_on_its_edge(friction: float) -> None:
    antenna = AntennaSpec(friction=friction)
    bench = ChainBench(PHYSICS, antenna, [Bar(-1.0, 0.08, 1.0, 0.08, 0.01)])
    bench.place(0.0, 0.0, 0.5)
    along(bench, raised(0.02, 1.0), 0.5)
    back = np.column_stack([np.linspace(0.0, -0.05, 8000), np.full(8000, 0.02)])
    slid = along(bench, back, 0.5, STEP)
    assert abs(np.diff(slid.joints[-2000:, -1, 0])).min() > 0.5 * 0.05 / 8000
    pressed = slid.force[-2000:][slid.touching[-2000:]]  # a contact that lasts is not always on
    assert len(pressed) > 50
    assert pressed[:, 0] / -pressed[:, 1] == pytest.approx(friction, rel=1e-6)
    returned = np.column_stack([np.linspace(-0.05, -0.049, 200), np.full(200, 0.02)])
    along(bench, returned, 0.5)  # unloads the contact along the wall
    stuck = along(bench, np.tile(returned[-1], (2000, 1)), 0.5, STEP)
    held = stuck.force[-400:][stuck.touching[-400:]]
    assert len(held) > 10
    assert (abs(held[:, 0]) < 0.98 * friction * -held[:, 1]).all()
    assert np.ptp(stuck.joints[-400:, -1, 0]) < 1e-5


def test_energy_never_grows_where_nothing_drives() -> None:
    antenna = AntennaSpec(damping_time=0.002)
    bench = ChainBench(PHYSICS, antenna, [Ball(0.08, -0.002, 0.005)])
    rng = np.random.default_rng(3)
    bench.place(0.0, 0.0, 0.2, rng.normal(0.0, 0.3, 6))
    seen = along(bench, np.zeros((2000, 2)), 0.0, STEP)
    speeds = np.diff(seen.states, axis=0)[:, :-2] / STEP  # what a step adds over its time
    joints = np.diff(seen.joints, axis=0) / STEP
    middles = (joints[:, :-1] + joints[:, 1:]) / 2
    turning = np.diff(speeds[:, 2:], axis=1)
    drive, springs = antenna.base(), Chain.of(antenna).stiffness
    r, link = antenna.radius, antenna.link_length
    inertia = antenna.link_mass * link**2 / 12  # of a rod: a little less than the capsule's
    moving = 0.5 * (
        antenna.link_mass * (middles**2).sum(axis=(1, 2))
        + inertia * (speeds[:, 3:] ** 2).sum(axis=1)
        + antenna.armature * (turning**2).sum(axis=1)
        + (drive.armature + 0.4 * antenna.base_mass * r**2) * speeds[:, 2] ** 2
        + (1.0 + antenna.base_mass) * (speeds[:, :2] ** 2).sum(axis=1)
    )
    held = drive.stiffness * seen.base**2 + (springs * seen.hinges**2).sum(axis=1)
    energy = moving + 0.5 * held[1:] + 0.5 * 1e4 * (seen.states[1:, :2] ** 2).sum(axis=1)
    assert seen.touching.any()
    assert energy.max() < 1.01 * energy[0]
    assert energy[400:].max() < 0.9 * energy[0]
    assert energy[-1] < 1e-2 * energy[0]


def both(
    obstacles: list[Ball | Bar],
    gravity: tuple[float, float] = (0.0, 0.0),
    antenna: AntennaSpec = ANTENNA,
    count: int = 400,
) -> tuple[Motion, np.ndarray, np.ndarray]:
    """Move upwards at 0.05 m/s with both: the chain, and hinges and forces of the engine."""
    bench = ChainBench(PHYSICS, antenna, obstacles, gravity)
    engine = Bench(compile_bench(PHYSICS, antenna, obstacles, gravity), antenna)
    bench.place(0.0, 0.0, 0.5)
    engine.place(0.0, 0.0, 0.5)
    y = 0.05 * PERIOD * np.arange(1, count + 1)
    way = np.column_stack([np.zeros_like(y), y])
    hinges, force = [], []
    for place in y.tolist():
        engine.command(0.0, place, 0.0, 0.05, 0.5)
        engine.step(4)
        hinges.append(engine.hinges().copy())
        force.append(engine.contact_force())
    speeds = np.tile([0.0, 0.05], (count, 1))
    seen = bench.drive(bench.commands(way, speeds, 0.5), 4)
    return seen, np.array(hinges), np.array(force)


@pytest.mark.parametrize(
    ("obstacles", "gravity", "antenna"),
    [
        ([], (2.0, -9.81), ANTENNA),
        ([Ball(0.06, 0.075, 0.01)], (0.0, 0.0), ANTENNA),
        ([Ball(0.075, 0.006 * i, 0.003) for i in range(40)], (0.0, -9.81), ANTENNA),
        ([Bar(-1.0, 0.08, 1.0, 0.08, 0.02)], (0.0, 0.0), ANTENNA),
        ([Bar(-0.1, 0.06, 0.2, 0.09, 0.002)], (0.0, 0.0), AntennaSpec(range=0.1)),
        ([Ball(0.06, 0.075, 0.01)], (0.0, 0.0), AntennaSpec(active_coils=(4.0,) * 14)),
    ],
    ids=["free", "ball", "balls", "bar", "stops", "fourteen"],
)
def test_it_moves_as_the_engine_does(
    obstacles: list[Ball | Bar], gravity: tuple[float, float], antenna: AntennaSpec
) -> None:
    seen, hinges, force = both(obstacles, gravity, antenna)
    assert abs(seen.hinges).max() > 0.05
    assert seen.touching.any() == bool(obstacles)
    met = int(seen.touching.argmax()) + 20 if obstacles else None
    assert seen.hinges[:met] == pytest.approx(hinges[:met], abs=1e-8)
    assert seen.force[:met] == pytest.approx(force[:met], rel=1e-6, abs=1e-6)
    assert seen.hinges == pytest.approx(hinges, abs=2e-4)  # contacts make rounding grow


def test_a_rod_pushes_it_and_gives_way_as_on_the_engine() -> None:
    bench = ChainBench(PHYSICS, ANTENNA, probe_radius=0.006)
    model = compile_bench(PHYSICS, ANTENNA, probe_radius=0.006)
    engine = Bench(model, ANTENNA)
    rod = Slider(model, engine.data, "probe")
    bench.place_probe(0.08, -0.0095)
    rod.place(0.08, -0.0095)
    y = -0.0095 + 0.05 * PERIOD * np.arange(1, 301)
    seen = bench.drive(
        bench.commands(
            np.zeros((300, 2)),
            np.zeros((300, 2)),
            0.0,
            np.column_stack([np.full(300, 0.08), y]),
            np.tile([0.0, 0.05], (300, 1)),
        ),
        4,
    )
    for place in y.tolist():
        rod.command(0.08, place, 0.0, 0.05)
        engine.step(4)
    assert seen.touching.any()
    assert seen.hinges[-1] == pytest.approx(engine.hinges(), abs=1e-8)
    assert seen.probe[-1] == pytest.approx(rod.position, abs=1e-9)


@pytest.mark.parametrize("profile", ["stiff", "descending"])
def test_walls_end_as_with_the_engine(profile: str) -> None:
    rows = {
        solver: run(
            WallConfig.model_validate({"trials": 2, "profiles": [profile], "solver": solver})
        ).rows
        for solver in ("mujoco", "chain")
    }
    assert [r.outcome for r in rows["chain"]] == [r.outcome for r in rows["mujoco"]]
    passed = sum(row.outcome == "success" for row in rows["chain"])
    low, high = wilson95(passed, len(rows["chain"]))
    assert low <= {"stiff": 0.0, "descending": 1.0}[profile] <= high  # docs/science/wall.md: of 20
    for one, other in zip(rows["chain"], rows["mujoco"], strict=True):
        assert one.longest_stick_mm == pytest.approx(other.longest_stick_mm, abs=0.5)
        assert one.flex_max_deg == pytest.approx(other.flex_max_deg, abs=0.5)


def test_the_same_seed_gives_the_same_bits() -> None:
    config = WallConfig.model_validate(
        {"solver": "chain", "wall": {"travel": 0.03, "start": 0.005, "speed": 0.02}}
    )
    one, again, other = (passage(config, "descending", trial) for trial in (0, 0, 1))
    np.testing.assert_array_equal(one.tip, again.tip)
    np.testing.assert_array_equal(one.force, again.force)
    assert abs(one.tip - other.tip).max() > 1e-5


@pytest.mark.parametrize("withdraw", [False, True])
def test_pushes_of_the_rig_are_those_of_the_engine(withdraw: bool) -> None:
    def pushed(solver: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        rig = {"withdraw": withdraw}
        found = push(CalibrateConfig.model_validate({"solver": solver, "rig": rig}), 25)
        return found.t, found.samples.counts, found.samples.level

    (t, counts, level), (t_chain, counts_chain, level_chain) = pushed("mujoco"), pushed("chain")
    np.testing.assert_array_equal(t_chain, t)
    assert abs(counts_chain - counts).max() <= 2
    assert level_chain == pytest.approx(level, abs=1e-4)


def test_sweeps_beside_a_wall_are_those_of_the_engine() -> None:
    sweep, wall = SweepParams(centre=0.82, amplitude=0.26), scan.Wall(0.35 * ANTENNA.length)
    traces = [
        scan.record(PHYSICS, ANTENNA, sweep, wall, 1.0, solver=solver)
        for solver in ("mujoco", "chain")
    ]
    engine, seen = traces
    np.testing.assert_array_equal(seen.t, engine.t)
    assert engine.touching.any()
    assert seen.base == pytest.approx(engine.base, abs=1e-3)
    assert seen.flex == pytest.approx(engine.flex, abs=1e-3)
    assert seen.points == pytest.approx(engine.points, abs=1e-3)
    assert (seen.touching != engine.touching).mean() < 0.02


def _speechless(monkeypatch: pytest.MonkeyPatch, name: str, module: object) -> None:
    monkeypatch.delitem(sys.modules, "antennate.sim.chain_kernel", raising=False)
    monkeypatch.setitem(sys.modules, name, module)


def test_without_numba_one_line_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    _speechless(monkeypatch, "numba", None)
    for command in ("wall", "calibrate", "sweep"):
        out = tmp_path / command
        assert main([*command_words(command).split(), "--solver", "chain", "--out", str(out)]) == 2
        said = capsys.readouterr().err.strip()
        assert "pip install './antennate[fast]'" in said
        assert "\n" not in said
        assert not out.exists()
    with pytest.raises(MissingPackageError):
        run(WallConfig(solver="chain", trials=1))


def test_a_folder_that_cannot_be_written_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(name: str) -> object:
        raise RuntimeError("cannot cache function 'drive': no locator available for file")

    monkeypatch.setattr(fast.importlib, "import_module", refuse)
    with pytest.raises(OutputError, match="NUMBA_CACHE_DIR"):
        fast.kernel()


@pytest.mark.slow  # it compiles, 20 s
def test_a_disk_without_room_for_what_is_compiled_and_a_damaged_file_are_named(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    kept = tmp_path / "kept"
    words = [
        sys.executable,
        "-m",
        "antennate",
        "bench",
        "wall",
        "--solver",
        "chain",
        "--trials",
        "1",
    ]
    there = {**os.environ, "NUMBA_CACHE_DIR": str(kept), "PYTHONDONTWRITEBYTECODE": "1"}

    def refused(begin: str = "") -> str:
        script = f"{begin} exec {shlex.join([*words, '--out', str(tmp_path / 'run')])}"
        done = subprocess.run(
            ["bash", "-c", script], env=there, capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        assert "Traceback" not in done.stderr
        return done.stderr

    assert f"keep the compiled chain in {kept}" in refused("ulimit -f 40;")
    subprocess.run([*words, "--out", str(tmp_path / "whole")], env=there, check=True)
    for index in kept.rglob("*.nbi"):
        index.write_bytes(index.read_bytes()[:-40])
    said = refused()
    assert f"keep the compiled chain in {kept}" in said
    assert "NUMBA_CACHE_DIR" in said


def test_what_the_chain_does_not_read_or_draw_is_refused() -> None:
    for config in (WallConfig, CalibrateConfig):
        with pytest.raises(ValidationError, match="sleep_tolerance: expected"):
            config.model_validate({"solver": "chain", "physics": {"sleep_tolerance": 0.01}})
    wall = experiments.load("wall")
    with pytest.raises(ConfigError, match="video: expected the solver mujoco"):
        require_films(wall, WallConfig(solver="chain"), 0)


def test_the_chain_has_no_view(tmp_path: Path, refused: Callable[..., str]) -> None:
    assert "expected mujoco beside --view" in refused(
        "bench", "wall", "--solver", "chain", "--view", "--out", str(tmp_path / "run")
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda bench: bench.commands(np.full((1, 2), np.nan), np.zeros(2), 0.0), "not finite"),
        (lambda bench: bench.commands(np.full((1, 2), 1e9), np.zeros(2), 0.0), "left all bounds"),
    ],
)
def test_trouble_ends_it(change: Callable[[ChainBench], np.ndarray], said: str) -> None:
    bench = ChainBench(PHYSICS, ANTENNA)
    with pytest.raises(SimulationError, match=said):
        bench.drive(change(bench), 4)


def test_more_contacts_than_there_is_room_for_end_it() -> None:
    crowd = [Ball(0.02 + 0.001 * i, -0.003, 0.002) for i in range(80)]
    bench = ChainBench(PHYSICS, ANTENNA, crowd)
    with pytest.raises(SimulationError, match="contacts at once"):
        hold(bench, 0.01)
