"""The example of imitation: what its teacher says, and what its student is given."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from antennate import envs
from antennate.control.policy.controller import Policy
from antennate.control.policy.interface import PolicyInterface
from antennate.control.policy.observer import Observer
from antennate.control.registry import make_controller
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.testing import check_controller
from antennate.types import AntennaFrame

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture
def imitate(monkeypatch: pytest.MonkeyPatch) -> Any:
    pytest.importorskip("torch")
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module("imitate")


def teacher_on_a_straight_route(imitate: Any) -> Any:
    """A teacher of one robot whose route leads along x."""
    teacher = imitate.Teacher(envs.AntennaEnv("flat", interface=imitate.INTERFACE).config, 1)
    teacher.begin(np.array([True]), {"seed": [1], "episode_number": [0]})
    teacher.routes[0] = np.array([[0.0, 0.0], [10.0, 0.0]])
    return teacher


def advice(teacher: Any, head: tuple[float, float, float], done: int) -> int:
    return int(teacher.advise(np.array([head]), np.array([done]))[0])


@pytest.mark.parametrize(("heading", "side"), [(0.9, "TURN_R"), (-0.9, "TURN_L")])
def test_a_jammed_robot_backs_off_and_turns_to_the_route(
    imitate: Any, heading: float, side: str
) -> None:
    teacher, told = teacher_on_a_straight_route(imitate), [imitate.FORWARD]
    while told[-1] == imitate.FORWARD:  # it does as it is told, and stays where it is
        told.append(advice(teacher, (1.0, 0.0, heading), told[-1]))
    assert told[-1] == imitate.REVERSE
    assert len(told) - 1 == imitate.CYCLE + 1  # heads that span a cycle
    while told[-1] == imitate.REVERSE:
        told.append(advice(teacher, (1.0, 0.0, heading), told[-1]))
    assert told.count(imitate.REVERSE) == imitate.BACK
    turn = getattr(imitate, side)
    assert told[-1] == turn
    for _ in range(imitate.CYCLE + 1):  # once the mean heading is that of the route
        told.append(advice(teacher, (1.0, 0.0, 0.0), told[-1]))
    assert told[-1] == imitate.FORWARD


def test_a_robot_that_gets_on_is_told_to_walk(imitate: Any) -> None:
    teacher = teacher_on_a_straight_route(imitate)
    for i in range(50):
        assert advice(teacher, (0.05 * i, 0.0, 0.3), imitate.FORWARD) == imitate.FORWARD


def test_a_turn_to_the_wrong_side_is_gone_on_with_for_its_time(imitate: Any) -> None:
    teacher = teacher_on_a_straight_route(imitate)
    told = [advice(teacher, (1.0, 0.0, 0.9), imitate.TURN_L) for _ in range(imitate.TURN)]
    assert told == [imitate.TURN_L] * (imitate.TURN - 1) + [imitate.FORWARD]


@pytest.mark.parametrize(("last", "side"), [("TURN_L", "TURN_R"), ("TURN_R", "TURN_L")])
def test_a_robot_that_walks_back_is_told_to_undo_its_last_turn(
    imitate: Any, last: str, side: str
) -> None:
    teacher = teacher_on_a_straight_route(imitate)
    for _ in range(4):
        advice(teacher, (3.0, 0.0, np.pi), getattr(imitate, last))
    walked = [
        advice(teacher, (3.0 - 0.05 * i, 0.0, np.pi), imitate.FORWARD)
        for i in range(imitate.CYCLE + 1)
    ]
    assert walked == [imitate.FORWARD] * imitate.CYCLE + [getattr(imitate, side)]


class Gait:
    """A gait state of one robot."""

    def __init__(self, phase: float, offset: float) -> None:
        self.phase, self.offset = np.array([phase]), np.array([offset])
        self.pace, self.amplitude = np.ones(1), np.full(1, 0.4)

    def goals(self) -> None:
        return None


def test_a_mirrored_observation_is_that_of_the_mirrored_robot(imitate: Any) -> None:
    """Antennae exchanged, offset negated, and the gait half a turn later."""
    interface = PolicyInterface.model_validate(imitate.INTERFACE)
    observers = [Observer(interface, ControlParams(), RobotSpec(), 1) for _ in range(2)]
    rng = np.random.default_rng(2)
    for i in range(40):
        counts, phase, offset = rng.uniform(1500.0, 2500.0, (1, 2)), 0.3 * i, rng.uniform(-0.5, 0.5)
        t = np.array([0.2 * i])
        observers[0].feel(AntennaFrame(t, counts))
        observers[1].feel(AntennaFrame(t, counts[:, ::-1].copy()))
        own = observers[0].look(Gait(phase, offset))
        other = observers[1].look(Gait(phase + np.pi, -offset))
    seen, told = imitate.mirrored(own, np.array([imitate.TURN_L]))
    assert np.abs(seen - other).max() < 1e-6
    assert np.abs(seen - own).max() > 0.1
    assert told.tolist() == [imitate.TURN_R]


def test_the_blind_twin_is_given_what_a_robot_without_readings_is(imitate: Any) -> None:
    """The same walk: but for what is felt, the observations are the same, bit for bit."""
    seen = {}
    for readings in ("own", "none"):
        env = gym.make("antennate/Tunnel-v1", interface=imitate.INTERFACE, readings=readings)
        seen[readings], _ = env.reset(seed=5)
        for _ in range(8):
            seen[readings], *_ = env.step(imitate.CHOICES[0].astype(np.float32))
    own, none = (seen[name][None] for name in ("own", "none"))
    assert (own != none).any()
    assert (imitate.untouched(own) == none).all()
    network = imitate.Network(own.shape[1])
    imitate.blindfold(network)
    scores = [network(imitate.torch.from_numpy(x)).detach().numpy() for x in (own, none)]
    assert (scores[0] == scores[1]).all()


@pytest.mark.slow
def test_the_example_teaches_and_its_policy_walks(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("onnxruntime")
    script = str(EXAMPLES / "imitate.py")
    words = [sys.executable, script, "--scene", "uturn", "--decisions", "600", "--out", "p"]
    subprocess.run(words, cwd=tmp_path, check=True)
    path, rows = tmp_path / "p/policy.onnx", list[TrialResult]()
    config = TunnelConfig(time_limit=3.0, scene="uturn", controllers=(str(path),))
    run_trials(config, str(path), [0], lambda r: rows.append(r[0]))
    assert rows[0].outcome != "invalid"


ENTRY = Path(__file__).parents[1] / "entries/apprentice"


def test_the_entry_keeps_the_protocol_of_controllers() -> None:
    pytest.importorskip("onnxruntime")
    path = str(ENTRY / "policy.onnx")
    check_controller(lambda c, r, b: make_controller(path, c, r, b))


def test_its_blind_twin_answers_alike_whatever_is_felt_and_it_does_not() -> None:
    pytest.importorskip("onnxruntime")
    rng = np.random.default_rng(8)
    for name, alike in (("blind", True), ("policy", False)):
        policy = Policy(ENTRY / f"{name}.onnx")
        felt = [i for i, q in enumerate(policy.contract.observations) if q.name.startswith("flex")]
        own = rng.normal(0.0, 1.0, (50, len(policy.contract.observations))).astype(np.float32)
        other = own.copy()
        other[:, felt] = rng.normal(0.5, 1.0, (50, len(felt)))
        answers = [[policy.answer(x[None], {})[0] for x in seen] for seen in (own, other)]
        assert np.array_equal(*answers) == alike
