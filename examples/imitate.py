"""Teach a network to escape by touch, by imitation of `closed`; write it as ONNX.

    python examples/imitate.py --out my_policy                   # some 10 minutes on one core
    antennate tunnel --scene uturn --controllers timed closed my_policy/policy.onnx --seed 5

Needs the extra `gym` and PyTorch (CPU), and the extra `onnx` to write the file.

The teacher is the search of `closed`, in the time scale of a faster gait. The student learns on its
own episodes (DAgger: Ross, Gordon and Bagnell 2011, arXiv:1011.0686): it walks, at first in turns
with the teacher; the teacher says at each decision how to go on after what the student did; the
student learns all that it was told.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import torch
from torch import nn

import antennate.envs  # registers the environments
from antennate.control.conditioning import RepetitionDetector
from antennate.control.escape import Search
from antennate.control.policy.contract import contract_of
from antennate.control.policy.writer import write_policy
from antennate.params.control import ControlParams, SearchParams

SCENES = {scene: name for name, scene in antennate.envs.ids().items()}
FREQUENCY = 1.0
"""Gait cycles a second [Hz]."""
INTERFACE = {"action": "gait", "ticks": 20, "history": 60, "memory_time": 30.0}
"""A decision every 0.2 s, a fifth of a gait cycle; what was felt and done in the last 12 s."""
DECISION, WINDOW, PATIENCE = 0.2, 0.8, 3
"""Time of a decision [s]; gait cycles in which readings repeat; decisions of another will."""
HISTORY, CHANNELS = INTERFACE["history"], 7
FORWARD, TURN_L, TURN_R, REVERSE = range(4)
SIZE = 0.7153
"""Amplitude of the body wave, that of the default gait: 25 deg of 29 deg, -1 to 1."""
CHOICES = np.array(
    [[SIZE, 0.0, 1.0, 1.0], [SIZE, -1.0, 1.0, 1.0], [SIZE, 1.0, 1.0, 1.0], [SIZE, 0.0, 1.0, -1.0]]
)
"""Amplitude, offset, frequency and direction of what it chooses from, shape (4, 4)."""
ROWS, SEGMENT = 12, 25
"""Robots of each scene; decisions for which one of the two walks."""
ROUND = 50
"""Decisions of each robot between two trainings."""
TEACHING = 0.45
"""Share of the time in which the teacher walks less and less, down to never."""
UNITS, BATCH, RATE, EPOCHS = 64, 256, 1e-3, 2


def faster(search: SearchParams, factor: float) -> SearchParams:
    """A search whose times fit a gait that many times as fast."""
    times = {n: getattr(search, n) / factor for n in type(search).model_fields if n != "growth"}
    return search.model_copy(update=times)


class Teacher(Search):
    """The search of `closed`, told what the student did.

    Its clock stands still while the student does something else than it was told. After PATIENCE
    decisions of that it goes on as if it had wanted that itself.

    Args:
        control: All numbers of the control.
        batch: Number of robots B.
    """

    def __init__(self, control: ControlParams, batch: int) -> None:
        super().__init__(faster(control.search, FREQUENCY / control.gait.frequency), batch)
        repetition = control.repetition.model_copy(update={"window_cycles": WINDOW})
        self._pressure = repetition.pressure
        self._detector = RepetitionDetector(repetition, batch, DECISION, FREQUENCY)
        self._t = np.zeros(batch)
        self._astray = np.zeros(batch, np.int64)

    def begin(self, rows: np.ndarray) -> None:
        """Episodes begin in some rows, shape (B,)."""
        self.reset(rows)
        self._detector.reset(rows)
        self._t[rows], self._astray[rows] = 0.0, 0

    def advise(self, flex: np.ndarray, done: np.ndarray) -> np.ndarray:
        """What to do next, shape (B,), after flex (B, 2) was felt and a maneuver (B,) was done."""
        obeyed = done == self.maneuver
        self._astray = np.where(obeyed, 0, self._astray + 1)
        late = self._astray >= PATIENCE
        self._adopt(late, done)
        obeyed |= late
        stuck = self._detector.step(flex, (done == FORWARD) & obeyed)
        seen = np.where(obeyed[:, None], flex, np.nan)  # of a row with NaN the clock stands still
        self.step(self._t, seen, stuck, (flex > self._pressure).any(axis=1))
        self._t = self._t + DECISION
        return self.maneuver.copy()

    def _adopt(self, rows: np.ndarray, done: np.ndarray) -> None:
        """Go on in some rows as if what was done had been wanted."""
        times, passed = self._params, PATIENCE * DECISION
        size = np.select(
            [done == REVERSE, done == FORWARD], [times.reverse_time, 0.0], times.turn_time
        )
        turned = rows & ((done == TURN_L) | (done == TURN_R))
        self._turned = self._turned + turned * np.where(done == TURN_R, size, -size)
        self._right = np.where(turned, done == TURN_R, self._right)
        self.tries = self.tries + turned
        self._until = np.where(rows, self._t + size - passed, self._until)
        self._begun = np.where(rows, self._t + DECISION - passed, self._begun)
        self.maneuver = np.where(rows, done, self.maneuver)
        self._astray[rows] = 0


class Class:
    """Robots of one scene, the teacher beside them, and what the student was told.

    Args:
        scene: Name of the scene.
        readings: What the student is given to read: own or none.
        seed: Of the episodes.
    """

    def __init__(self, scene: str, readings: str, seed: int) -> None:
        words = {"num_envs": ROWS, "interface": INTERFACE, "autoreset_mode": "SAME_STEP"}
        self.envs = gym.make_vec(SCENES[scene], **words)
        self.scene, self.blind = scene, readings == "none"
        self.teacher = Teacher(self.envs.unwrapped.config.control, ROWS)
        self.done = np.zeros(ROWS, np.int64)
        self.taught = np.ones(ROWS, bool)
        self.observation, _ = self.envs.reset(seed=seed)
        self.ends: list[tuple[str, float, bool]] = []
        self.alone = np.ones(ROWS, bool)

    def seen(self) -> np.ndarray:
        """What the student is given, shape (B, n): nothing of its antennae if it is blind."""
        return untouched(self.observation) if self.blind else self.observation

    def walk(self, network: Network, share: float, rng: np.random.Generator):
        """Walk a round; observations (n, inputs) and advice (n,).

        Args:
            network: The student.
            share: Chance that the teacher walks a segment.
            rng: Says in which.
        """
        given, told = [], []
        for i in range(ROUND):
            if i % SEGMENT == 0:
                self.taught = rng.random(ROWS) < share
            flex = self.observation[:, [0, HISTORY]].astype(float)
            advice, seen = self.teacher.advise(flex, self.done), self.seen()
            given.append(seen.copy())
            told.append(advice)
            self.done = np.where(self.taught, advice, network.choose(seen))
            self.alone &= ~self.taught
            self.step()
        return np.concatenate(given), np.concatenate(told)

    def step(self) -> None:
        """Carry out what was chosen."""
        actions = CHOICES[self.done].astype(np.float32)
        self.observation, _, ended, cut, infos = self.envs.step(actions)
        if (over := ended | cut).any():
            final = infos["final_info"]
            for row in np.flatnonzero(over):
                end = final["outcome"][row], float(final["t"][row]), bool(self.alone[row])
                self.ends.append(end)
            self.teacher.begin(over)
            self.done[over], self.alone[over] = FORWARD, True


def untouched(observation: np.ndarray) -> np.ndarray:
    """Observations, shape (n, inputs), as of two antennae that touch nothing."""
    blind, past = observation.copy(), CHANNELS * HISTORY
    blind[:, : 4 * HISTORY] = blind[:, past : past + 4] = 0.0
    return blind


@torch.no_grad()
def blindfold(network: Network) -> None:
    """Let a network see nothing of its antennae, whatever they read."""
    past = CHANNELS * HISTORY
    network.layers[0].weight[:, : 4 * HISTORY] = 0.0
    network.layers[0].weight[:, past : past + 4] = 0.0


def mirrored(observation: np.ndarray, told: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Observations and advice with left and right exchanged; the gait phase is half a turn off."""
    past, means, phase = np.split(observation, [CHANNELS * HISTORY, CHANNELS * (HISTORY + 1)], 1)
    order, sign = [1, 0, 3, 2, 4, 5, 6], np.array([1, 1, 1, 1, 1, -1, 1], np.float32)
    past = past.reshape(-1, CHANNELS, HISTORY)[:, order] * sign[:, None]
    parts = [past.reshape(len(past), -1), means[:, order] * sign, -phase]
    return np.concatenate(parts, 1), np.array([FORWARD, TURN_R, TURN_L, REVERSE])[told]


class Network(nn.Module):
    """Scores of the four choices; it normalises an observation by itself."""

    def __init__(self, inputs: int) -> None:
        super().__init__()
        sizes = [inputs, UNITS, UNITS, len(CHOICES)]
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in itertools.pairwise(sizes))
        self.register_buffer("mean", torch.zeros(inputs))
        self.register_buffer("scale", torch.ones(inputs))

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        x = ((observation - self.mean) / self.scale).clamp(-5.0, 5.0)
        for layer in self.layers[:-1]:
            x = torch.tanh(layer(x))
        return self.layers[-1](x)

    @torch.no_grad()
    def choose(self, observation: np.ndarray) -> np.ndarray:
        """The choice for each observation, shape (B,)."""
        return self(torch.from_numpy(observation)).argmax(1).numpy()

    def save(self, path: Path, config, about: str) -> Path:
        """Write it as a policy."""
        contract = contract_of(config.interface, config.control, config.robot, about=about)
        layers = [(x.weight.detach().numpy(), x.bias.detach().numpy()) for x in self.layers]
        mean, scale = self.mean.numpy(), self.scale.numpy()
        return write_policy(path, contract, layers, mean, scale, 5.0, CHOICES)


class Lessons:
    """All that the student was told, and its training."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._optimiser = torch.optim.AdamW(network.parameters(), RATE, weight_decay=1e-3)
        self._given: list[torch.Tensor] = []
        self._told: list[torch.Tensor] = []

    def add(self, given: np.ndarray, told: np.ndarray) -> None:
        """Take observations and advice, as they are and mirrored."""
        for x, y in ((given, told), mirrored(given, told)):
            self._given.append(torch.from_numpy(x))
            self._told.append(torch.from_numpy(y))

    def train(self, epochs: int = EPOCHS, rate: float = RATE) -> float:
        """Some epochs over all; the share of advice that the student repeats, of the last one."""
        given, told = torch.cat(self._given), torch.cat(self._told)
        network, right = self._network, 0
        network.mean.copy_(given.mean(0))
        network.scale.copy_(given.std(0).clamp(min=0.02))
        self._optimiser.param_groups[0]["lr"] = rate
        for _ in range(epochs):
            right = 0
            for some in torch.randperm(len(told)).split(BATCH):
                scores = network(given[some])
                loss = nn.functional.cross_entropy(scores, told[some])
                self._optimiser.zero_grad()
                loss.backward()
                self._optimiser.step()
                right += int((scores.argmax(1) == told[some]).sum())
        return right / len(told)


def teach(options: argparse.Namespace) -> Path:
    """Walk and train until the time is over; the policy file."""
    torch.manual_seed(options.seed)
    torch.set_num_threads(1)
    rng, readings = np.random.default_rng(options.seed), options.readings
    first = 10_000_000 + 1000 * options.seed
    classes = [Class(scene, readings, first + i) for i, scene in enumerate(options.scene)]
    network = Network(classes[0].observation.shape[1])
    if readings == "none":
        blindfold(network)
    lessons, start, decisions = Lessons(network), time.monotonic(), 0
    while decisions < options.decisions:
        share = max(0.0, 1.0 - decisions / (TEACHING * options.decisions))
        for group in classes:
            lessons.add(*group.walk(network, share, rng))
            decisions += ROUND * ROWS
        right = lessons.train()
        minutes = (time.monotonic() - start) / 60.0
        own = [end for group in classes for end in group.ends[-25:] if end[2]]
        out = np.mean([end[0] == "success" for end in own]) if own else np.nan
        print(
            f"{minutes:.1f} min: {decisions} decisions, {100 * right:.0f} % as told; of its last "
            f"{len(own)} episodes {100 * out:.0f} % out",
            flush=True,
        )
    lessons.train(10, RATE / 5)
    episodes = sum(len(group.ends) for group in classes)
    about = (
        f"examples/imitate.py, scenes {' '.join(options.scene)}, readings {readings}, seed "
        f"{options.seed}, {decisions} decisions, {episodes} episodes"
    )
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "options.json").write_text(json.dumps(vars(options), default=str), "utf-8")
    return network.save(options.out / "policy.onnx", classes[0].envs.unwrapped.config, about)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the policy")
    parser.add_argument("--scene", nargs="+", default=["uturn", "room"], choices=[*SCENES])
    parser.add_argument("--readings", default="own", choices=["own", "none"])
    parser.add_argument("--decisions", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    print(teach(parser.parse_args()))


if __name__ == "__main__":
    main()
