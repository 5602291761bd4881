"""Libraries of reinforcement learning train in the environments; each is tested where it is."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from pages import blocks

from antennate import envs
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]
EXAMPLE = Path(__file__).parents[1] / "examples/train_ppo.py"
MINUTE = 60.0


def test_the_example_trains_and_its_policy_walks(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("onnxruntime")
    words = [sys.executable, str(EXAMPLE), "--minutes", "1", "--scene", "flat", "--out", "policy"]
    subprocess.run(words, cwd=tmp_path, check=True)
    options = json.loads((tmp_path / "policy/options.json").read_text())
    assert options["scene"] == ["flat"]
    path, rows = tmp_path / "policy/policy.onnx", list[TrialResult]()
    run_trials(
        TunnelConfig(time_limit=3.0, scene="flat"), str(path), [0], lambda r: rows.append(r[0])
    )
    assert rows[0].outcome != "invalid"


@pytest.fixture
def train_ppo() -> Any:
    """The example, where its packages are."""
    pytest.importorskip("torch")
    pytest.importorskip("onnxruntime")
    return example("train_ppo")


def contract_with(interface: dict[str, Any]) -> Any:
    """The contract of a policy of the default robot."""
    from antennate.control.policy.contract import contract_of

    config = envs.AntennaEnv("flat", interface=interface).config
    return contract_of(config.interface, config.control, config.robot)


def test_the_exported_network_answers_as_torch_does(train_ppo: Any, tmp_path: Path) -> None:
    """Round trip with a normaliser of drawn numbers: at most 1e-5 apart."""
    import torch

    from antennate.control.policy.controller import Policy

    contract = contract_with(train_ppo.INTERFACE)
    size = len(contract.observations)
    network = train_ppo.Network(size, 4)
    network.learn_scale(torch.randn(500, size) * 3.0 + 1.0)
    train_ppo.save(tmp_path, network, contract)
    policy = Policy(train_ppo.export(tmp_path))
    x = np.random.default_rng(0).normal(0.0, 3.0, (100, size)).astype(np.float32)
    with torch.no_grad():
        wanted = network(torch.from_numpy(x))[0].numpy()
    answers = np.concatenate([policy.answer(row[None], {})[0] for row in x])
    assert np.abs(answers - wanted).max() < 1e-5


def test_a_policy_that_was_taught_without_readings_feels_none(
    train_ppo: Any, tmp_path: Path
) -> None:
    from antennate.control.policy.controller import Policy

    contract = contract_with(train_ppo.INTERFACE)
    names = [number.name for number in contract.observations]
    train_ppo.save(tmp_path, train_ppo.Network(len(names), 4), contract, "none")
    policy = Policy(train_ppo.export(tmp_path))
    x = np.zeros((1, len(names)), np.float32)
    touched, phase = x.copy(), x.copy()
    touched[0, [name.startswith("flex_") for name in names]] = 1.0
    phase[0, [name.startswith("pace") for name in names]] = 1.0
    plain = policy.answer(x, {})[0]
    assert (policy.answer(touched, {})[0] == plain).all()
    assert (policy.answer(phase, {})[0] != plain).any()


def test_more_scenes_than_workers_are_refused() -> None:
    words = ["--out", "no", "--scene", "flat", "wall", "--workers", "1"]
    done = subprocess.run(
        [sys.executable, str(EXAMPLE), *words], check=False, capture_output=True, text=True
    )
    if "No module named 'torch'" in done.stderr:
        pytest.skip("no PyTorch here")
    assert done.returncode == 2
    assert "expected a worker for each of 2 scenes, found --workers 1" in done.stderr


def test_stable_baselines_trains() -> None:
    sb3 = pytest.importorskip("stable_baselines3")
    env = gym.make("antennate/Flat-v1", action="gait", time_limit=5.0)
    model = sb3.PPO("MlpPolicy", env, n_steps=128, device="cpu", seed=1)
    start, steps = time.monotonic(), 0
    while time.monotonic() - start < MINUTE:
        model.learn(256, reset_num_timesteps=False)
        steps += 256
    assert model.num_timesteps >= steps
    observation, _ = env.reset(seed=3)
    assert env.action_space.contains(model.predict(observation, deterministic=True)[0])


def test_the_page_writes_a_policy_of_stable_baselines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("stable_baselines3")
    pytest.importorskip("onnxscript")
    monkeypatch.chdir(tmp_path)
    (code,) = (b.text for b in blocks("envs.md") if b.kind == "python" and "PPO(" in b.text)
    exec(code, {})
    assert [file.name for file in tmp_path.iterdir()] == ["mine.onnx"]
    config, rows = TunnelConfig(time_limit=1.0, scene="flat"), list[TrialResult]()
    run_trials(config, "mine.onnx", [0], lambda r: rows.append(r[0]))
    assert rows[0].outcome != "invalid"


def test_skrl_trains() -> None:
    pytest.importorskip("skrl")
    torch = pytest.importorskip("torch")
    from skrl.agents.torch.ppo import PPO, PPO_CFG
    from skrl.envs.wrappers.torch import wrap_env
    from skrl.memories.torch import RandomMemory
    from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
    from skrl.trainers.torch import SequentialTrainer

    class Actor(GaussianMixin, Model):
        def __init__(self, observation_space, action_space, device):
            Model.__init__(
                self,
                observation_space=observation_space,
                action_space=action_space,
                device=device,
            )
            GaussianMixin.__init__(self)
            self.net = torch.nn.Linear(self.num_observations, self.num_actions)
            self.spread = torch.nn.Parameter(torch.zeros(self.num_actions))

        def compute(self, inputs, role):
            return self.net(inputs["observations"]), {"log_std": self.spread}

    class Critic(DeterministicMixin, Model):
        def __init__(self, observation_space, action_space, device):
            Model.__init__(
                self,
                observation_space=observation_space,
                action_space=action_space,
                device=device,
            )
            DeterministicMixin.__init__(self)
            self.net = torch.nn.Linear(self.num_observations, 1)

        def compute(self, inputs, role):
            return self.net(inputs["observations"]), {}

    env = wrap_env(gym.make_vec("antennate/Flat-v1", num_envs=4, action="gait", time_limit=5.0))
    spaces = (env.observation_space, env.action_space, env.device)
    memory = RandomMemory(memory_size=32, num_envs=4, device=env.device)
    models = {"policy": Actor(*spaces), "value": Critic(*spaces)}
    agent = PPO(
        models=models,
        memory=memory,
        observation_space=env.observation_space,
        action_space=env.action_space,
        device=env.device,
        cfg=PPO_CFG(rollouts=32),
    )
    before = models["policy"].net.weight.clone()
    trainer = SequentialTrainer(
        env=env, agents=agent, cfg={"timesteps": 96, "disable_progressbar": True, "headless": True}
    )
    start = time.monotonic()
    while time.monotonic() - start < MINUTE:
        trainer.train()
    assert not torch.equal(before, models["policy"].net.weight)


def test_rsl_rl_trains() -> None:
    pytest.importorskip("rsl_rl")
    from rsl_rl.runners import OnPolicyRunner

    env = example("rsl_rl_env").RslRlEnv("antennate/Flat-v1", num_envs=4, time_limit=5.0)
    assert env.max_episode_length == 50
    network = {"class_name": "MLPModel", "hidden_dims": [32]}
    config = {
        "algorithm": {"class_name": "PPO"},
        "actor": {**network, "distribution_cfg": {"class_name": "GaussianDistribution"}},
        "critic": network,
        "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
        "num_steps_per_env": 24,
        "save_interval": 1000,
    }
    runner = OnPolicyRunner(env, config)
    before = [parameter.clone() for parameter in runner.alg.actor.parameters()]
    start = time.monotonic()
    while time.monotonic() - start < MINUTE:
        runner.learn(2)
    after = [*runner.alg.actor.parameters()]
    assert not all(map(torch_equal, before, after))


def torch_equal(one: Any, other: Any) -> bool:
    """Whether two tensors are the same."""
    return bool((one == other).all())


def example(name: str) -> Any:
    """A module among the examples."""
    sys.path.insert(0, str(EXAMPLE.parent))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(EXAMPLE.parent))


def test_lerobot_takes_it_as_of_its_hub() -> None:
    pytest.importorskip("lerobot")
    from lerobot.envs.utils import _call_make_env, _normalize_hub_result, preprocess_observation

    made = _normalize_hub_result(_call_make_env(example("lerobot_env"), 2, False, None))
    ((tasks,),) = (made.values(),)
    observation, _ = tasks[0].reset(seed=[1, 2])
    (state,) = preprocess_observation(observation).values()
    assert tuple(state.shape) == tasks[0].observation_space["agent_pos"].shape
    assert tasks[0].call("_max_episode_steps") == (1000, 1000)
    *_, info = tasks[0].step(tasks[0].action_space.sample())
    assert info["is_success"].tolist() == [False, False]
