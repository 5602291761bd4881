"""Train a policy that steers by touch, with PPO on PyTorch alone, and write it as ONNX.

    python examples/train_ppo.py --out my_policy                  # 20 minutes on one core
    antennate tunnel --controllers timed closed my_policy/policy.onnx --seed 5

Needs the extra `gym` and PyTorch (CPU); the extra `onnx` for the last step, which can also be done
later, on another computer: `python examples/train_ppo.py --export --out my_policy`.

Each worker process steps a vector of robots with the newest weights. The learner takes all their
decisions, updates the weights (Schulman et al. 2017, arXiv:1707.06347) and sends them out again.
"""

from __future__ import annotations

import argparse
import csv
import json
import multiprocessing
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import torch
from torch import nn

import antennate.envs  # registers the environments
from antennate.control.policy.contract import Contract, contract_of
from antennate.control.policy.writer import write_policy

SCENES = {scene: name for name, scene in antennate.envs.ids().items()}
INTERFACE = {"action": "maneuver", "ticks": 50, "history": 16}
"""A decision every 0.5 s; what was felt in the last 8 s."""
FELT = ("flex_", "level_", "counts_")
"""How the names of numbers begin that antennae tell."""
ROWS = 8
"""Robots of a worker."""
DECISIONS = 32
"""Decisions of each robot between two updates."""
GAMMA, LAMBDA = 0.995, 0.95
CLIP, EPOCHS, MINIBATCH, RATE, ENTROPY = 0.2, 8, 256, 5e-4, 0.01
UNITS = 64
AHEAD = 1.5
"""Score of FORWARD at first: a robot that walks gets on."""


class Network(nn.Module):
    """Scores of the maneuvers and the value of an observation, which it normalises itself."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.actor, self.critic = mlp(inputs, outputs, 0.01), mlp(inputs, 1, 1.0)
        with torch.no_grad():
            self.actor[-1].bias[0] = AHEAD
        self.register_buffer("mean", torch.zeros(inputs))
        self.register_buffer("scale", torch.ones(inputs))
        self.register_buffer("count", torch.tensor(1e-4))

    def forward(self, observation: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        x = ((observation - self.mean) / self.scale).clamp(-10.0, 10.0)
        return self.actor(x), self.critic(x).squeeze(-1)

    def learn_scale(self, observations: torch.Tensor) -> None:
        """Take more observations, shape (n, inputs), into mean and standard deviation."""
        mean, variance, n = observations.mean(0), observations.var(0), len(observations)
        total = self.count + n
        change = mean - self.mean
        old = self.scale**2 * self.count
        joint = (old + variance * n + change**2 * self.count * n / total) / total
        self.mean += change * n / total
        self.scale.copy_(joint.sqrt().clamp(min=0.05))
        self.count.copy_(total)


def mlp(inputs: int, outputs: int, gain: float) -> nn.Sequential:
    layers = [nn.Linear(inputs, UNITS), nn.Tanh(), nn.Linear(UNITS, UNITS), nn.Tanh()]
    layers.append(nn.Linear(UNITS, outputs))
    for layer in layers[::2]:
        nn.init.orthogonal_(layer.weight, 2**0.5 if layer is not layers[-1] else gain)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(*layers)


def make_envs(scene: str, readings: str, rows: int) -> gym.vector.VectorEnv:
    words = {"autoreset_mode": "SAME_STEP", "interface": INTERFACE, "readings": readings}
    return gym.make_vec(SCENES[scene], num_envs=rows, **words)


def work(pipe, scene: str, readings: str, seed: int) -> None:
    """A worker: weights come in, decisions go out."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    envs = make_envs(scene, readings, ROWS)
    observation, _ = envs.reset(seed=seed)
    network = Network(observation.shape[1], envs.single_action_space.n)
    while (weights := pipe.recv()) is not None:
        network.load_state_dict({k: torch.from_numpy(v) for k, v in weights.items()})
        observation, rollout = collect(envs, network, observation)
        pipe.send(rollout)


@torch.no_grad()
def collect(envs: gym.vector.VectorEnv, network: Network, observation: np.ndarray):
    """Walk DECISIONS of every robot; the next observations, and arrays of (decisions, rows)."""
    parts = {name: [] for name in ("obs", "action", "logp", "value", "reward", "over", "tail")}
    ends = []
    for _ in range(DECISIONS):
        given = torch.from_numpy(observation)
        scores, value = network(given)
        choice = torch.distributions.Categorical(logits=scores)
        action = choice.sample()
        following, reward, ended, cut, infos = envs.step(action.numpy())
        over, tail = ended | cut, np.zeros(len(reward))
        if over.any():
            final = infos["final_info"]
            ends += [(final["outcome"][row], final["t"][row]) for row in np.flatnonzero(over)]
            last = np.stack([infos["final_obs"][row] for row in np.flatnonzero(over)])
            tail[over] = network(torch.from_numpy(last))[1].numpy() * cut[over]
        values = (observation, action.numpy(), choice.log_prob(action).numpy(), value.numpy())
        for name, part in zip(parts, (*values, reward, over, tail), strict=True):
            parts[name].append(part)
        observation = following
    rollout = {name: np.stack(part) for name, part in parts.items()}
    rollout["after"] = network(torch.from_numpy(observation))[1].numpy()
    return observation, (rollout, ends)


def advantages(rollout: dict[str, np.ndarray]) -> np.ndarray:
    """Generalised advantage estimates (Schulman et al. 2016), shape (decisions, rows)."""
    result, ahead = np.zeros_like(rollout["reward"]), 0.0
    following = rollout["after"]
    for i in reversed(range(len(result))):
        over = rollout["over"][i]
        beyond = np.where(over, rollout["tail"][i], following)
        error = rollout["reward"][i] + GAMMA * beyond - rollout["value"][i]
        result[i] = ahead = error + GAMMA * LAMBDA * np.where(over, 0.0, ahead)
        following = rollout["value"][i]
    return result


def update(network: Network, optimiser, rollouts: list[dict[str, np.ndarray]]) -> None:
    """Some epochs of clipped policy gradient on the newest decisions."""
    gains = [advantages(r) for r in rollouts]
    flat = {
        name: torch.from_numpy(
            np.concatenate([r[name].reshape(-1, *r[name].shape[2:]) for r in rollouts])
        )
        for name in ("obs", "action", "logp", "value")
    }
    gain = torch.from_numpy(np.concatenate([g.ravel() for g in gains])).float()
    goal = gain + flat["value"]
    gain = (gain - gain.mean()) / (gain.std() + 1e-8)
    for _ in range(EPOCHS):
        for some in torch.randperm(len(gain)).split(MINIBATCH):
            scores, value = network(flat["obs"][some])
            choice = torch.distributions.Categorical(logits=scores)
            ratio = (choice.log_prob(flat["action"][some]) - flat["logp"][some]).exp()
            clipped = ratio.clamp(1.0 - CLIP, 1.0 + CLIP)
            policy = -torch.min(ratio * gain[some], clipped * gain[some]).mean()
            fit = 0.5 * (value - goal[some]).square().mean()
            loss = policy + fit - ENTROPY * choice.entropy().mean()
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 0.5)
            optimiser.step()


def save(folder: Path, network: Network, contract: Contract, readings: str = "own") -> None:
    """Weights and contract, of which `export` makes the policy; taught by none, it feels none."""
    state = {name: value.numpy().copy() for name, value in network.state_dict().items()}
    if readings == "none":
        felt = [number.name.startswith(FELT) for number in contract.observations]
        state["actor.0.weight"][:, felt] = 0.0
    np.savez(folder / "weights.npz", **state)
    (folder / "contract.json").write_text(contract.model_dump_json(indent=2), encoding="utf-8")


def export(folder: Path) -> Path:
    """Write policy.onnx of the saved weights and contract."""
    contract = Contract.model_validate_json((folder / "contract.json").read_text("utf-8"))
    with np.load(folder / "weights.npz") as state:
        layers = [(state[f"actor.{i}.weight"], state[f"actor.{i}.bias"]) for i in (0, 2, 4)]
        mean, scale = state["mean"], state["scale"]
    return write_policy(folder / "policy.onnx", contract, layers, mean, scale, clip=10.0)


def train(options: argparse.Namespace) -> None:
    torch.manual_seed(options.seed)
    folder: Path = options.out
    folder.mkdir(parents=True, exist_ok=True)
    readings = options.readings
    probe = make_envs(options.scene[0], readings, 1).unwrapped
    contract = contract_of(probe.config.interface, probe.config.control, probe.config.robot)
    network = Network(probe.single_observation_space.shape[0], probe.single_action_space.n)
    if options.begin is not None:
        with np.load(options.begin / "weights.npz") as state:
            network.load_state_dict({name: torch.from_numpy(state[name]) for name in state})
    optimiser = torch.optim.Adam(network.parameters(), RATE, eps=1e-5)
    context, pipes = multiprocessing.get_context("spawn"), []
    for i in range(options.workers):
        pipe, other = context.Pipe()
        seed = 10_000_000 + 1000 * options.seed + i
        scene = options.scene[i % len(options.scene)]
        words = (other, scene, readings, seed)
        context.Process(target=work, args=words, daemon=True).start()
        pipes.append(pipe)
    start, saved, decisions, recent = time.monotonic(), -1.0, 0, []
    with (folder / "progress.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["minutes", "decisions", "episodes", "success", "mean_time_s", "reward"])
        while (minutes := (time.monotonic() - start) / 60.0) < options.minutes:
            for group in optimiser.param_groups:
                group["lr"] = RATE * (1.0 - minutes / options.minutes)
            weights = {name: value.numpy() for name, value in network.state_dict().items()}
            for pipe in pipes:
                pipe.send(weights)
            rollouts, ends = zip(*(pipe.recv() for pipe in pipes), strict=True)
            update(network, optimiser, list(rollouts))
            seen = [r["obs"].reshape(-1, r["obs"].shape[-1]) for r in rollouts]
            network.learn_scale(torch.from_numpy(np.concatenate(seen)))
            minutes = (time.monotonic() - start) / 60.0
            decisions += sum(r["reward"].size for r in rollouts)
            recent = [*recent, *(end for part in ends for end in part)][-100:]
            success = np.mean([end[0] == "success" for end in recent]) if recent else np.nan
            times = np.mean([end[1] for end in recent]) if recent else np.nan
            reward = np.mean([r["reward"].mean() for r in rollouts])
            figures = [minutes, decisions, len(recent), success, times, reward]
            table.writerow([f"{figure:.5g}" for figure in figures])
            file.flush()
            if minutes - saved > 1.0:
                saved = minutes
                save(folder, network, contract, readings)
                print(
                    f"{minutes:.1f} min: {decisions} decisions, of the last {len(recent)} "
                    f"episodes {100 * success:.0f} % out, {times:.1f} s on average"
                )
    for pipe in pipes:
        pipe.send(None)
    save(folder, network, contract, readings)
    (folder / "options.json").write_text(json.dumps(vars(options), default=str), "utf-8")


def main() -> None:
    words = {"formatter_class": argparse.ArgumentDefaultsHelpFormatter}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], **words)
    parser.add_argument("--out", type=Path, required=True, help="folder of the policy")
    parser.add_argument(
        "--scene",
        nargs="+",
        default=["tunnel"],
        choices=[*SCENES],
        help="scenes, one for each worker in turn",
    )
    parser.add_argument(
        "--readings", default="own", choices=["own", "none"], help="what it feels while it learns"
    )
    parser.add_argument("--workers", type=int, default=1, help="processes that step robots")
    parser.add_argument("--minutes", type=float, default=20.0, help="how long it learns")
    parser.add_argument("--seed", type=int, default=1, help="of all chance but the load")
    parser.add_argument("--begin", type=Path, help="folder whose weights it begins with")
    parser.add_argument(
        "--export", action="store_true", help="only write the ONNX file of the weights in --out"
    )
    options = parser.parse_args()
    if len(options.scene) > options.workers:
        parser.error(
            f"expected a worker for each of {len(options.scene)} scenes, found "
            f"--workers {options.workers}"
        )
    needed = (options.begin, options.out if options.export else None)
    for folder in filter(None, needed):
        if not (folder / "weights.npz").is_file():
            parser.error(f"expected saved weights, found no {folder / 'weights.npz'}")
    if not options.export and (options.out / "progress.csv").exists():
        parser.error(f"expected a new folder, found one of another training, {options.out}")
    if not options.export:
        train(options)
    try:
        print(export(options.out))
    except ImportError as error:
        print(f"saved, not exported: {error}")


if __name__ == "__main__":
    main()
