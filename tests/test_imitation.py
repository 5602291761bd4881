"""The example of imitation: what its teacher says, and what its student is given."""

from __future__ import annotations

import importlib
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from antennate.control.policy.controller import Policy
from antennate.control.policy.interface import PolicyInterface
from antennate.control.policy.observer import Observer
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame

pytest.importorskip("torch")  # here: it begins a process of its own once
pytest.importorskip("gymnasium")
EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture
def imitate(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module("imitate")


def advice(teacher: Any, flex: tuple[float, float], done: int) -> int:
    return int(teacher.advise(np.array([flex]), np.array([done]))[0])


@pytest.mark.parametrize(("bent", "side"), [((0.6, 0.1), "TURN_R"), ((0.1, 0.6), "TURN_L")])
def test_readings_that_repeat_are_told_to_back_off_and_to_turn_from_what_stays_bent(
    imitate: Any, bent: tuple[float, float], side: str
) -> None:
    """Patience 3 s; 0.5 m back, 1.3 s at the 0.38 m/s of antennate geometry at 1 Hz."""
    teacher, told = imitate.Teacher(ControlParams(), RobotSpec(), 1), [imitate.FORWARD]
    while len(told) < 100 and not {imitate.TURN_L, imitate.TURN_R} & set(told):
        told.append(advice(teacher, bent, told[-1]))  # it does as it is told
    assert told[-1] == getattr(imitate, side)
    walked, backed = (told.count(maneuver) for maneuver in (imitate.FORWARD, imitate.REVERSE))
    assert abs(walked * imitate.DECISION - 3.0) < 0.5
    assert abs(backed * imitate.DECISION - 1.3) < 0.25
    turned, right, tries, left, walked, free, known = teacher.state()[0]
    assert (np.sign(turned), right) == ((1.0, 1.0) if side == "TURN_R" else (-1.0, -1.0))
    assert (tries, walked, free) == (0.25, 0.0, 0.0)  # the first of four; it does not walk
    assert known == 0.0  # it is told no side
    begun = imitate.DECISION / (math.radians(60.0) / 0.67)  # of a turn, after one decision
    assert abs(left / abs(turned) - (1.0 - begun)) < 0.02


@pytest.mark.parametrize(("side", "turn"), [(1, "TURN_L"), (-1, "TURN_R")])
def test_a_teacher_that_knows_the_side_turns_there_whatever_is_bent(
    imitate: Any, side: int, turn: str
) -> None:
    """Bent more on the side of the way, as where the antenna leans into the opening."""
    bent = (0.6, 0.1) if side == 1 else (0.1, 0.6)
    teacher, told = imitate.Teacher(ControlParams(), RobotSpec(), 1), [imitate.FORWARD]
    teacher.knowledge = imitate.Knowledge(side=np.array([side]))
    while len(told) < 100 and not {imitate.TURN_L, imitate.TURN_R} & set(told):
        told.append(advice(teacher, bent, told[-1]))
    assert told[-1] == getattr(imitate, turn)
    assert teacher.state()[0, -1] == -side  # positive to the right, as all of a state


def test_a_robot_that_feels_nothing_is_told_to_walk(imitate: Any) -> None:
    teacher = imitate.Teacher(ControlParams(), RobotSpec(), 1)
    for _ in range(100):
        assert advice(teacher, (0.0, 0.0), imitate.FORWARD) == imitate.FORWARD


def test_another_will_than_that_of_the_teacher_is_gone_on_with_after_a_while(imitate: Any) -> None:
    teacher = imitate.Teacher(ControlParams(), RobotSpec(), 1)
    told = [advice(teacher, (0.0, 0.0), imitate.TURN_L) for _ in range(20)]
    assert told[: imitate.PATIENCE - 1] == [imitate.FORWARD] * (imitate.PATIENCE - 1)
    assert told[imitate.PATIENCE] == imitate.TURN_L
    over = told.index(imitate.FORWARD, imitate.PATIENCE)  # the turn has had its time
    assert abs((over + 1) * imitate.DECISION - math.radians(60.0) / 0.67) < 0.25


class Gait:
    """A gait state of one robot."""

    def __init__(self, phase: float, offset: float) -> None:
        self.phase, self.offset = np.array([phase]), np.array([offset])
        self.pace, self.amplitude = np.ones(1), np.full(1, 0.4)

    def goals(self) -> None:
        return None


def test_a_mirrored_observation_is_that_of_the_mirrored_robot(imitate: Any) -> None:
    """Antennae exchanged, offset negated, and the gait half a turn later."""
    interface = PolicyInterface.model_validate(imitate.interface_of(1.0))
    observers = [Observer(interface, ControlParams(), RobotSpec(), 1) for _ in range(2)]
    rng = np.random.default_rng(2)
    for i in range(40):
        counts, phase, offset = rng.uniform(1500.0, 2500.0, (1, 2)), 0.3 * i, rng.uniform(-0.5, 0.5)
        t = np.array([0.2 * i])
        observers[0].feel(AntennaFrame(t, counts))
        observers[1].feel(AntennaFrame(t, counts[:, ::-1].copy()))
        own = observers[0].look(Gait(phase, offset))
        other = observers[1].look(Gait(phase + np.pi, -offset))
    state, first = np.array([[0.5, 1.0, 0.25, 0.1, 0.0, 0.0, 1.0]]), np.array([True])
    seen, told, begins, why = imitate.mirrored(own, np.array([imitate.TURN_L]), first, state)
    assert np.abs(seen - other).max() < 1e-6
    assert np.abs(seen - own).max() > 0.1
    assert told.tolist() == [imitate.TURN_R]
    assert begins.tolist() == [True]
    assert why.tolist() == [[-0.5, -1.0, 0.25, 0.1, 0.0, 0.0, -1.0]]


def test_the_blind_twin_is_given_what_a_robot_without_readings_is(imitate: Any) -> None:
    """The same walk: but for what is felt, the observations are the same, bit for bit."""
    seen = {}
    for readings in ("own", "none"):
        env = imitate.gym.make(
            "antennate/Tunnel-v1",
            robot=imitate.robot_of("scuttle", 1.0),
            interface=imitate.interface_of(1.0),
            readings=readings,
        )
        seen[readings], _ = env.reset(seed=5)
        for _ in range(8):
            seen[readings], *_ = env.step(imitate.CHOICES[0].astype(np.float32))
    own, none = (seen[name][None] for name in ("own", "none"))
    assert (own != none).any()
    assert (imitate.untouched(own) == none).all()
    network, torch = imitate.Network(own.shape[1]), imitate.torch
    start = torch.zeros(1, imitate.UNITS), torch.tensor([True])
    touching = [network(torch.from_numpy(x), *start)[0].detach().numpy() for x in (own, none)]
    imitate.blindfold(network)
    blind = [network(torch.from_numpy(x), *start)[0].detach().numpy() for x in (own, none)]
    assert (touching[0] != touching[1]).any()
    assert (blind[0] == blind[1]).all()


def test_a_written_student_answers_as_it_did(imitate: Any, tmp_path: Path) -> None:
    """The file and PyTorch choose alike over 200 decisions, and remember the same to 1e-5."""
    pytest.importorskip("onnxruntime")
    words = {"robot": imitate.robot_of("scuttle", 1.0), "interface": imitate.interface_of(1.0)}
    env = imitate.gym.make("antennate/Tunnel-v1", **words)
    size, torch = env.observation_space.shape[0], imitate.torch
    torch.manual_seed(0)
    network, rng = imitate.Network(size), np.random.default_rng(0)
    network.mean.copy_(torch.rand(size))
    network.scale.copy_(torch.rand(size) + 0.5)
    policy = Policy(network.save(tmp_path / "p.onnx", env.unwrapped.config, "a test"))
    states, memory, first = policy.start(), torch.zeros(1, imitate.UNITS), np.array([True])
    for x in rng.normal(0.0, 1.0, (200, 1, size)).astype(np.float32):
        answer, states = policy.answer(x, states)
        chosen, memory = network.choose(x, memory, first)
        assert (answer[0] == imitate.CHOICES[chosen[0]].astype(np.float32)).all()
        assert np.abs(states["memory"][0] - memory.numpy()).max() <= 1e-5
        first[:] = False


@pytest.mark.slow
def test_the_example_teaches_and_its_policy_walks(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime")
    script = str(EXAMPLES / "imitate.py")
    words = [sys.executable, script, "--scene", "uturn", "--decisions", "600", "--out", "p"]
    words += ["--robot", "scuttle", "--frequency", "0.8", "--teacher-knows", "side"]
    subprocess.run(words, cwd=tmp_path, check=True)
    path, rows = tmp_path / "p/policy.onnx", list[TrialResult]()
    config = TunnelConfig(time_limit=3.0, scene="uturn", controllers=(str(path),))
    run_trials(config, str(path), [0], lambda r: rows.append(r[0]))
    assert rows[0].outcome != "invalid"
