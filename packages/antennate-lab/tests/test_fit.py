"""Fits to logs of a protocol: what is found of known numbers, and what is refused."""

from __future__ import annotations

import importlib.util
import itertools
import math
import re
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from protocol_logs import CONTROL, sweeps, write
from scipy import signal

from antennate.control.protocol import Protocol, Step, targets
from antennate.errors import BadInputError, LogError
from antennate.hardware.config import RobotConfig
from antennate.params.scene import HookParams, VariationParams
from antennate.robots.spec import RobotSpec
from antennate.studies.pool import Workers
from antennate.types import Floats
from antennate_lab.fit import compare, least_squares, measures, recording, regression, robot_file
from antennate_lab.fit.config import FitConfig
from antennate_lab.fit.estimates import Estimate, of_air, of_legs
from antennate_lab.fit.experiment import sentence
from antennate_lab.fit.parameters import LEG, SCALES, changed, parameters
from antennate_lab.fit.result import FitResult, StepRow
from antennate_lab.fit.run import run
from antennate_lab.fit.simulated import Course, simulated

SMALL = RobotSpec(links=2, mass=0.8, antennae={"kind": "none"})  # type: ignore[arg-type]
"""One yaw joint and four legs: a model that is quick."""
VICE = HookParams(firm=True)
GAIN, DELAY, INERTIA = 190.0, 0.012, 0.0045


def linear(goals: Floats) -> Floats:
    """Angles of a linear servo with these numbers: I q'' + D q' + K (q - goal(t - delay)) = 0."""
    servo = SMALL.servos.xc430_w240.model_copy(update={"gain_divisor": GAIN})
    fine = 10
    t = np.arange(len(goals) * fine) * CONTROL.period / fine
    late = np.floor((t - DELAY) / CONTROL.period + 1e-9).astype(int)
    held = np.where(late < 0, goals[0], goals[np.clip(late, 0, None)])
    inertia = INERTIA + 0.020 * (2 * 0.025**2 / 5 + 0.008**2)  # of an ellipsoid off its axle
    plant = ([servo.stiffness], [inertia, servo.damping, servo.stiffness])
    return signal.lsim(plant, held - goals[0], t, interp=False)[1][::fine] + goals[0]


def of_joint(name: str) -> Callable[[Step, Floats], Floats]:
    """What is measured if one joint of SMALL follows as `linear` says."""
    place = SMALL.joint_names.index(name)

    def measured(step: Step, goals: Floats) -> Floats:
        positions = goals.copy()
        positions[:, place] = linear(goals[:, place])
        return positions

    return measured


@pytest.mark.ci
def test_numbers_of_a_joint_alone_are_those_of_a_formula(tmp_path: Path) -> None:
    """The air: a log whose leg follows a linear equation is fitted by the whole simulation."""
    protocol = sweeps(SMALL, "leg_l0", seconds=2.0)
    path = write(tmp_path / "drive.mcap", SMALL, protocol, of_joint("leg_l0"))
    courses = recording.read(path, SMALL).courses
    names = [(f"servos.xc430_w240.{name}", None) for name in ("gain_divisor", "delay", "armature")]
    problem = least_squares.Problem(SMALL, courses, parameters(SMALL, names), Workers(1))
    solution = least_squares.solve(problem, problem.start + np.array([0.0, 0.005, 0.0]))
    gain, delay, inertia = (
        each.value(x) for each, x in zip(problem.chosen, solution.x.tolist(), strict=True)
    )
    assert gain == pytest.approx(GAIN, rel=0.01)
    assert delay == pytest.approx(DELAY, abs=1.2e-3)  # the engine is half a timestep ahead
    assert inertia == pytest.approx(INERTIA, rel=0.1)
    covariance, draws = least_squares.covariances(problem, solution, np.random.default_rng(1))
    assert (np.sqrt(np.diag(covariance)) < [0.01, 1e-3, 0.1]).all()
    assert (draws.std(axis=0) < [0.01, 1e-3, 0.1]).all()
    gain, delay, _ = of_air(problem, solution, covariance, draws)
    assert gain.interval[0] < GAIN < gain.interval[1]
    assert delay.interval[0] < DELAY < delay.interval[1]  # by its floor: noise is a tenth of it


@pytest.mark.ci
def test_search_that_begins_without_a_delay_is_not_held_there(tmp_path: Path) -> None:
    """A simulated delay is none or at least 2 ms, a step of the engine; this servo has none."""
    path = write(tmp_path / "drive.mcap", SMALL, sweeps(SMALL, "leg_l0", seconds=2.0))
    (course,) = recording.read(path, SMALL).courses
    own = SMALL.servos.xc430_w240.model_copy(update={"gain_divisor": GAIN})
    servos = SMALL.servos.model_copy(update={"xc430_w240": own})
    made = simulated(SMALL.model_copy(update={"servos": servos}), course).positions
    unit = 2.0 * math.pi / 4096
    measured = replace(course, positions=np.rint(made / unit) * unit)
    names = [(f"servos.xc430_w240.{name}", None) for name in ("gain_divisor", "delay", "armature")]
    problem = least_squares.Problem(SMALL, [measured], parameters(SMALL, names), Workers(1))
    gain, delay, _ = least_squares.solve(problem, problem.start).x
    assert math.exp(gain) == pytest.approx(GAIN, rel=0.01)
    assert delay == 0.0


@pytest.mark.parametrize("amplitude", [0.5, 0.1])
def test_interval_is_not_shorter_than_what_no_noise_shows(tmp_path: Path, amplitude: float) -> None:
    """1.645 / √3 of: a timestep of 2 ms, half of 2π/4096 rad times 6.85 N·m/rad, 0.5 %, rounding.

    The stiffness is that of the servo as it is shipped, 1.7 N·m times its gain.
    """
    sweep = sweeps(SMALL, "leg_l0", seconds=2.0).steps[0]
    sweep = sweep.model_copy(update={"amplitude": amplitude})
    swing = np.ptp(targets(sweep, SMALL, CONTROL), axis=0).max() / 2
    protocol = Protocol(steps=(sweep,))
    path = write(tmp_path / "drive.mcap", SMALL, protocol)
    names = [f"servos.xc430_w240.{name}" for name in ("delay", "friction", "armature")]
    chosen = parameters(SMALL, [(name, None) for name in names])
    courses = recording.read(path, SMALL).courses
    problem = least_squares.Problem(SMALL, courses, chosen, Workers(1))
    x = problem.start + np.array([0.02, 0.1, 0.0])
    solution = least_squares.Solution(x, 1.0, [], [])
    found = of_air(problem, solution, np.zeros((3, 3)), np.zeros((2, 3)))
    unit, share = math.pi / 4096, 1.645 / math.sqrt(3)
    delay, friction = ((each.interval[1] - each.interval[0]) / 2 for each in found[:2])
    assert delay == pytest.approx(share * 0.002, rel=1e-6)
    assert friction == pytest.approx(share * unit * 6.848, rel=1e-3)
    ratio = math.log(found[2].interval[1] / found[2].interval[0]) / 2
    assert ratio == pytest.approx(share * math.hypot(0.005, unit / swing), rel=1e-3)


def test_lag_is_the_shift_of_a_sine() -> None:
    """Angles that come 30 ms late have that lag; a head that turns steadily its rate times 2 s."""
    t = np.arange(0.0, 4.0, 0.01)
    goals, angles = (0.3 * np.sin(math.pi * (t - late))[:, None] for late in (0.0, 0.03))
    turning = np.tile([0.0, 0.0, 0.25], (len(t), 1))
    course = Course("step", None, 0.01, 2.0, goals, angles, turning, np.zeros((len(t), 0)))
    assert measures.lags(course) == pytest.approx([0.03], rel=0.01)
    assert measures.turn(course) == pytest.approx(0.5, rel=1e-6)


@pytest.mark.ci
def test_regression_knows_what_a_linear_model_tells() -> None:
    """Of two numbers one is seen through noise of 0.1 in each of 25 features, one not at all."""
    rng = np.random.default_rng(5)
    prior = regression.Known(np.zeros(2), np.ones(2))
    seen = np.zeros((2, 25))
    seen[0] = 50.0
    places = prior.draw(400, rng)
    features = places @ seen + 5.0 * rng.standard_normal((400, 25))
    truth = np.array([0.7, 0.9])
    told = regression.regressed(places, features, truth @ seen, prior, prior)
    sure = 0.1 / math.sqrt(25)  # of the mean of 25
    assert told.mean[0] == pytest.approx(0.7, abs=3 * sure)
    assert told.sd[0] == pytest.approx(sure, rel=0.3)
    assert told.mean[1] == pytest.approx(0.0, abs=0.2)
    assert told.sd[1] == pytest.approx(1.0, rel=0.15)


@pytest.mark.parametrize("change", [0.0, 0.3])
def test_walks_of_a_robot_that_changes_contradict_one_another(change: float) -> None:
    """Six walks tell two numbers; with noise alone, or with numbers that change on the way."""
    rng = np.random.default_rng(7)
    seen = 20.0 * rng.standard_normal((6, 2, 30))
    places = rng.standard_normal((120, 2))
    walks = [places @ each + rng.standard_normal((120, 30)) for each in seen]
    own = np.array([0.4, -0.6]) + change * rng.standard_normal((6, 2))
    measured = [x @ each + rng.standard_normal(30) for x, each in zip(own, seen, strict=True)]
    assert (regression.contrary(places, walks, measured) > regression.CONTRARY) == (change > 0.0)


def test_friction_that_wanders_changes_a_walk_and_no_step_in_the_air() -> None:
    """Legs slip otherwise with another seed; hanging they touch nothing."""
    goals = np.zeros((120, 5))
    goals[:, 1:] = np.linspace(0.0, 6.0, 120)[:, None]
    none = np.zeros((120, 0))
    for hook in (None, HookParams()):
        course = Course("walk", hook, 0.01, 1.0, goals, goals, none, none)
        made = [
            simulated(SMALL, course, wander=0.6, seed=(seed,)).positions.tolist()
            for seed in (1, 1, 2)
        ]
        assert made[0] == made[1]
        assert (made[0] == made[2]) == (hook is not None)


def test_friction_of_a_leg_is_the_common_one_times_its_own() -> None:
    """Frictions of single legs become their median, and factors of it."""
    chosen = parameters(SMALL, [(LEG, place) for place in range(4)])
    robot = changed(SMALL, chosen, [0.4, 0.4, 0.2, 0.4])
    assert robot.leg_friction == 0.4
    assert robot.legs.friction_factors == (1.0, 1.0, 0.5, 1.0)


def test_leg_beyond_what_a_robot_may_have_is_not_told() -> None:
    """Three times the friction that all share; a robot's file allows twice."""
    robot = RobotSpec(links=2)
    found = np.log(0.5 * np.array([1.0, 1.0, 1.0, 3.0]))
    prior = regression.Known(np.full(4, np.log(0.6)), np.full(4, 0.4), 0.4)
    legs = regression.Told(found, np.full(4, 0.01), np.eye(4))
    common, *_, far = of_legs(robot, legs, prior, np.random.default_rng(1))
    assert common.told
    assert common.value == pytest.approx(0.5, rel=0.01)
    assert (far.told, far.value) == (False, 1.0)


def test_backlash_drives_what_a_simulation_feels() -> None:
    """A course in the air is another one with backlash, and the same one without."""
    robot = RobotSpec(imu={"kind": "head"})  # type: ignore[arg-type]
    goals = np.zeros((100, 19))
    goals[:, 2] = 0.2 * np.sin(np.arange(100) * 0.1)
    none = np.zeros((100, 0))
    course = Course("yaw3", HookParams(), 0.01, 0.0, goals, goals, none, none)
    (backlash,) = parameters(robot, [("yaw.backlash", 2)])
    loose = changed(robot, [backlash], [0.03])
    tight, same, slack = (simulated(each, course).gyro for each in (robot, robot, loose))
    assert (tight == same).all()
    assert abs(slack - tight)[:, 2].max() > 0.02


@pytest.mark.ci
def test_a_fit_tells_how_far_it_is_before_the_air_is_done(tmp_path: Path) -> None:
    """A line stands for each tenth: one when the search has its start, one for its first round."""
    path = write(tmp_path / "drive.mcap", SMALL, sweeps(SMALL, "leg_l0", seconds=0.5))
    file = tmp_path / "known.toml"
    file.write_text('links = 2\nmass = 0.8\nantennae = { kind = "none" }\n')
    told: list[float] = []
    config = FitConfig(log=(str(path),), robot=str(file))
    run(config, 1, lambda done, of: told.append(done / of))
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert {0.1, 0.2} <= set(told)


def test_log_of_another_robot_is_refused(tmp_path: Path) -> None:
    """Links and servo models of a log and of the robot's file have to agree."""
    path = write(tmp_path / "drive.mcap", SMALL, sweeps(SMALL, "leg_l0"))
    longer = RobotSpec(links=3, antennae={"kind": "none"})  # type: ignore[arg-type]
    with pytest.raises(BadInputError, match="expected the robot of the file with links 3, found 2"):
        recording.read(path, longer)
    other = RobotSpec.model_validate(
        SMALL.model_dump() | {"legs": {"servo": "xl430_w250", "fastest": 4.5}}
    )
    with pytest.raises(BadInputError, match="servo_names xl430_w250, found xc430_w240"):
        recording.read(path, other)


def test_log_and_robot_have_an_inertial_sensor_or_neither(
    tmp_path: Path, refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line before any work, of the fit and of the doctor."""
    monkeypatch.chdir(tmp_path)
    bare = RobotSpec()
    felt = RobotSpec(imu={"kind": "head"})  # type: ignore[arg-type]
    log = write(tmp_path / "felt.mcap", felt, sweeps(felt, "leg_l0"))
    words = "felt.mcap: the log has an inertial sensor, the robot file none: set imu in it"
    assert words in refused("fit", log, "--robot", "scuttle")
    own = tmp_path / "own.toml"
    own.write_text(
        '[[fitted]]\nname = "servos.xc430_w240.delay"\nlow = 0.0\nhigh = 0.01\nsource = "test"\n'
    )
    with pytest.raises(BadInputError, match=words):
        compare.rows(own, log)
    other = write(tmp_path / "bare.mcap", bare, sweeps(bare, "leg_l0"))
    with pytest.raises(BadInputError, match="the robot file has an inertial sensor, the log none"):
        recording.read(other, felt)
    assert recording.read(log, felt).courses
    assert recording.read(other, bare).courses


def test_command_refuses_the_log_of_another_robot(
    tmp_path: Path, refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line and exit code 2; nothing is written."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "short.toml", SMALL, sweeps(SMALL, "leg_l0"))
    line = refused("fit", "short.toml")
    assert "with links 6, found 2; give the file of the robot that was driven" in line
    (tmp_path / "drive-1").mkdir()
    (tmp_path / "short.toml").rename(tmp_path / "drive-1" / "drive.mcap")
    assert "drive-1/drive.mcap: expected the robot of the file" in refused("fit", "drive-1")


def test_what_is_wrong_with_a_log_stands_on_the_page() -> None:
    """The sentence above the tables ends with it."""
    lags = {"lag_ms": 40.0, "lag_before_ms": 9.0, "lag_after_ms": 39.0}
    turns = dict.fromkeys(("turn_deg", "turn_before_deg", "turn_after_deg"))
    errors = {"error_before_deg": 9.0, "error_deg": 1.0}
    step = StepRow(log="drive", step="leg_l0", fitted=True, **errors, **lags, **turns)
    result = FitResult(
        logs=[],
        parameters=[],
        steps=[step],
        correlations=[],
        noise={},
        warnings=["drive: 2 of 3 steps of the protocol are missing"],
        simulate="antennate tunnel --robot robot.toml",
    )
    assert "Beware: drive: 2 of 3 steps of the protocol are missing." in sentence(result)


def test_log_of_a_heavier_robot_is_named(tmp_path: Path) -> None:
    """Joints and servos are those of the file, the mass is not."""
    path = write(tmp_path / "drive.mcap", SMALL, sweeps(SMALL, "leg_l0"))
    lighter = SMALL.model_copy(update={"mass": 0.7})
    (warning,) = recording.read(path, lighter).warnings
    assert "robot with mass 0.8, --robot has 0.7: another robot?" in warning


def test_servo_of_another_model_is_named(tmp_path: Path) -> None:
    """Three legs follow 40 ms late; the fourth as late, or 60 ms."""
    place = SMALL.joint_names.index("leg_r1")

    def measured(step: Step, goals: Floats, odd: int) -> Floats:
        moves = SMALL.joint_names.index(step.joint)
        late = odd if moves == place else 4
        return np.concatenate([goals[:1]] * late + [goals[:-late]])

    slow = [s.model_copy(update={"highest": 0.5}) for s in sweeps(SMALL, *SMALL.leg_names).steps]
    protocol = Protocol(steps=tuple(slow))
    for odd, names in ((4, []), (6, ["leg_r1"])):
        path = tmp_path / f"drive{odd}.mcap"
        write(path, SMALL, protocol, lambda step, goals, odd=odd: measured(step, goals, odd))
        warnings = recording.read(path, SMALL).warnings
        assert [warning.split()[0] for warning in warnings] == names
    found = re.search(r"follows (\d+) ms late, other legs (\d+) ms: a servo of anoth", warnings[0])
    assert found is not None
    assert [int(lag) for lag in found.groups()] == pytest.approx([60, 40], rel=0.06)  # it stops


@pytest.mark.parametrize("joints", [("leg_l0",), SMALL.leg_names])
def test_leg_that_leads_as_the_others_do_is_not_odd(
    tmp_path: Path, joints: tuple[str, ...]
) -> None:
    """Angles 40 ms ahead of their goals, as those of another clock: no leg against itself."""

    def ahead(step: Step, goals: Floats) -> Floats:
        return np.concatenate([goals[4:]] + [goals[-1:]] * 4)

    path = write(tmp_path / "drive.mcap", SMALL, sweeps(SMALL, *joints), ahead)
    found = recording.read(path, SMALL)
    assert measures.lags(found.courses[0])[0] < -0.02
    assert found.warnings == []


def test_hook_of_the_protocol_is_simulated(tmp_path: Path) -> None:
    """A robot that hangs by a soft hook, or in a vice, turns its head otherwise."""
    robot = RobotSpec(imu={"kind": "head"})  # type: ignore[arg-type]
    turning = []
    for at, hook in enumerate((HookParams(), HookParams(twist_stiffness=20.0), VICE)):
        protocol = sweeps(robot, "yaw3").model_copy(update={"hook": hook})
        path = write(tmp_path / f"{at}.mcap", robot, protocol)
        (course,) = recording.read(path, robot).courses
        turning.append(simulated(robot, course).gyro[:, 2])
    for one, other in itertools.combinations(turning, 2):
        assert abs(one - other).max() > 0.02


def test_protocol_cut_in_half_is_named(tmp_path: Path) -> None:
    """What is there is used, and what is missing is said."""
    protocol = sweeps(SMALL, "leg_l0", "leg_r0", "leg_l1")
    path = write(tmp_path / "drive.mcap", SMALL, protocol, ticks=300)
    found = recording.read(path, SMALL)
    assert [course.name for course in found.courses] == ["leg_l0"]
    assert set(found.left_out) == {"leg_r0", "leg_l1"}
    assert "2 of 3 steps of the protocol are missing, from leg_r0 on" in found.warnings[0]
    nothing = write(tmp_path / "short.mcap", SMALL, protocol, ticks=100)
    with pytest.raises(BadInputError, match="expected whole steps"):
        recording.read(nothing, SMALL)


@pytest.mark.parametrize(
    ("loop", "board", "words"),
    [(1.0, 1.01, "clock of the antenna board runs +1.0 %"), (1.01, 1.0, "tick lasts 10.1")],
)
def test_clock_that_drifts_is_named(tmp_path: Path, loop: float, board: float, words: str) -> None:
    """A clock that is 1 % too fast, and none that is right."""
    protocol = sweeps(SMALL, "leg_l0")
    right = write(tmp_path / "right.mcap", SMALL, protocol)
    assert recording.read(right, SMALL).warnings == []
    path = write(tmp_path / "drive.mcap", SMALL, protocol, loop=loop, board=board)
    (warning,) = recording.read(path, SMALL).warnings
    assert words in warning


def test_log_of_no_protocol_is_refused(tmp_path: Path) -> None:
    """The log of another drive has no steps."""
    path = write(tmp_path / "drive.mcap", SMALL, Protocol(steps=sweeps(SMALL, "yaw1").steps))
    empty = tmp_path / "empty.mcap"
    empty.write_bytes(path.read_bytes()[:100])
    with pytest.raises(LogError):
        recording.read(empty, SMALL)
    with pytest.raises(BadInputError, match="expected logs"):
        run(FitConfig(), 1)


TEXT = """\
# the robot of room 3
links = 6  # as built

[servos.xc430_w240]
friction = 0.02  # by hand
"""


def estimates() -> list[Estimate]:
    """A gain and a backlash that are told, a delay that is not."""
    names = [
        ("servos.xc430_w240.gain_divisor", None),
        ("servos.xc430_w240.delay", None),
        ("yaw.backlash", 0),
        *(("yaw.backlash", place) for place in range(1, 5)),
    ]
    values = [170.0, 0.004, 0.01, 0.0, 0.0, 0.0, 0.0]
    return [
        Estimate(each, value, (0.9 * value, 1.1 * value), told, "air", np.zeros(9))
        for each, value, told in zip(
            parameters(RobotSpec(), names), values, [True, False, *[True] * 5], strict=True
        )
    ]


def test_robot_file_keeps_what_it_says(tmp_path: Path) -> None:
    """Comments stay, told numbers stand with their intervals, and a robot reads the file."""
    text = robot_file.written(TEXT, estimates(), ["drive-3"])
    for line in ("# the robot of room 3", "links = 6  # as built", "friction = 0.02  # by hand"):
        assert line in text
    path = tmp_path / "robot.toml"
    path.write_text(text, encoding="utf-8")
    robot = RobotSpec.named(path)
    assert robot.servos.xc430_w240.gain_divisor == 170.0
    assert robot.servos.xc430_w240.delay == 0.0
    assert robot.yaw.backlash == (0.01, 0.0, 0.0, 0.0, 0.0)
    (gain,) = [each for each in robot.fitted if each.name.endswith("gain_divisor")]
    assert (gain.low, gain.high, gain.source) == (153.0, 187.0, "measured: fit of drive-3")
    again = robot_file.written(text, estimates(), ["drive-4"])
    assert len(tomllib.loads(again)["fitted"]) == len(robot.fitted) == 6


def test_table_of_a_robot_in_its_file_is_changed(tmp_path: Path) -> None:
    """A robot.toml of `drive` has the robot in a table; all else in it stays."""
    path = tmp_path / "robot.toml"
    path.write_text('[robot]\nlinks = 6\n\n[ports]\nbus = "/dev/ttyUSB1"\n', encoding="utf-8")
    config = FitConfig(robot=str(path))
    assert config.described.links == 6
    path.write_text(robot_file.written(config.text, estimates(), ["drive"]), encoding="utf-8")
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    assert table["ports"] == {"bus": "/dev/ttyUSB1"}
    assert table["robot"]["servos"]["xc430_w240"] == {"gain_divisor": 170.0}
    del table["ports"]
    assert RobotConfig.model_validate(table | {}, strict=False).robot.fitted[0].high == 187.0
    assert FitConfig(robot=str(path)).described.yaw.backlash[0] == 0.01


def test_every_scale_is_within_the_bounds_of_its_field() -> None:
    """What a search may reach is a robot: at both ends of each scale."""
    robot = RobotSpec(imu={"kind": "head"})  # type: ignore[arg-type]
    names = [
        *(
            (f"servos.xc430_w240.{name}", None)
            for name in ("gain_divisor", "armature", "friction", "load_friction", "delay")
        ),
        ("legs.gain_factor", None),
        ("yaw.backlash", 1),
        ("antenna.three_coil_stiffness_n_mm_per_deg", None),
        ("antenna.damping_time", None),
        ("antenna.sensor.bend_gain", None),
        ("antennae.right_stiffness", None),
        ("antennae.right_gain", None),
        (LEG, 0),
    ]
    chosen = parameters(robot, names)
    assert {each.scale.unit for each in chosen} <= {scale.unit for scale in SCALES.values()}
    for each in chosen:
        for end in (each.scale.low, each.scale.high):
            assert changed(robot, [each], [end]).links == 6


def _identified() -> ModuleType:
    path = Path(__file__).parents[3] / "docs" / "science" / "identified.py"
    spec = importlib.util.spec_from_file_location("identified", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_hidden_robot_is_found(tmp_path: Path) -> None:
    """The whole: a robot that the fit does not see, recorded with noise, is found from its log."""
    identified = _identified()
    hidden = identified.hidden(11, 0)
    kinds = ("leg_l0", "yaw2", "yaw4", "antenna_l_base", "antenna_r_base")
    steps = [*sweeps(identified.KNOWN, *kinds, seconds=4.0).steps, Step(name="still", seconds=1.0)]
    protocol = Protocol(steps=tuple(steps)).made_for(identified.KNOWN, CONTROL)
    identified.record(hidden, protocol, tmp_path / "drive.mcap", 0)
    known = tmp_path / "known.toml"
    known.write_text('[imu]\nkind = "head"\n', encoding="utf-8")
    config = FitConfig(log=(str(tmp_path / "drive.mcap"),), robot=str(known))
    found = {row.name: row for row in run(config, 2).rows}
    gain = found["servos.xc430_w240.gain_divisor"]
    assert gain.value == pytest.approx(hidden.servos.xc430_w240.gain_divisor, rel=0.01)
    assert not found["yaw.backlash[0]"].told
    assert "leg_friction" not in found
    stiffness = found["antenna.three_coil_stiffness_n_mm_per_deg"].value
    truth = hidden.antenna.three_coil_stiffness_n_mm_per_deg
    assert stiffness == pytest.approx(truth, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("wander", [0.0, 0.6])
def test_friction_that_wanders_is_told_and_widens_the_intervals_of_legs(
    tmp_path: Path, wander: float
) -> None:
    """Five walks of the default robot, whose legs slip alike or are drawn anew on the way."""
    identified = _identified()
    ways = ("FORWARD", "TURN_L", "TURN_R", "REVERSE", "FORWARD")
    steps = tuple(
        Step(name=f"walk-{at}", maneuver=way, frequency=0.5, seconds=6.0)
        for at, way in enumerate(ways)
    )
    protocol = Protocol(steps=steps).made_for(identified.KNOWN, CONTROL)
    chance = VariationParams(slip_log_sd=wander)
    identified.record(identified.KNOWN, protocol, tmp_path / "drive.mcap", 3, variation=chance)
    known = tmp_path / "known.toml"
    known.write_text('[imu]\nkind = "head"\n', encoding="utf-8")
    config = FitConfig(log=(str(tmp_path / "drive.mcap"),), robot=str(known), robots=60)
    outcome = run(config, 2)
    assert bool([text for text in outcome.warnings if "contradict" in text]) == (wander > 0.0)
    legs = [row for row in outcome.rows if row.name.startswith("legs.friction_factors")]
    width = np.median([row.high - row.low for row in legs])
    assert (width > 0.5) == (wander > 0.0)


def test_unknown_step_to_leave_out_is_refused(tmp_path: Path) -> None:
    """The message says which steps there are."""
    path = write(tmp_path / "drive.mcap", SMALL, sweeps(SMALL, "leg_l0"))
    robot = tmp_path / "small.toml"
    robot.write_text('links = 2\nmass = 0.8\n\n[antennae]\nkind = "none"\n', encoding="utf-8")
    config = FitConfig(log=(str(path),), robot=str(robot), leave_out=("leg_l9",))
    with pytest.raises(BadInputError, match="expected steps of the logs, leg_l0, found leg_l9"):
        run(config, 1)


def test_simulation_begins_where_the_step_began() -> None:
    """The first angle is that of the measurement, whatever was commanded before."""
    goals = np.full((30, 5), 0.1)
    none = np.zeros((30, 0))
    course = Course("still", None, 0.01, 0.0, goals, goals, none, none)
    begun = replace(course, positions=goals + 0.0)
    assert simulated(SMALL, begun).positions[0] == pytest.approx(goals[0], abs=0.02)
