"""Teach a network to escape by touch, by imitation of `geometric`; write it as ONNX.

    python examples/imitate.py --out my_policy                   # some 35 minutes on one core
    antennate tunnel --controllers timed my_policy/policy.onnx --robot.legs.fastest 6.29

It walks at 1 Hz, on a robot with faster legs than ours, which keeps up to 0.837 Hz: `--frequency
0.8` teaches one that the legs keep, `--robot FILE` one with other antennae, `--swing 20` one whose
antennae sweep by 20° to either side as it walks.
Needs the extra `gym` and PyTorch (CPU), and the extra `onnx` to write the file.
The teacher is the search of `geometric`, its ways and angles by a faster gait. The student learns
on its own episodes (DAgger: Ross, Gordon and Bagnell 2011, arXiv:1011.0686): it walks, at first in
turns with the teacher; the teacher says at each decision how to go on after what the student did;
the student learns all that it was told, and what the teacher goes by. With `--teacher-knows side`
the teacher is told the side on which the way goes on, and the student learns to say that, too.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import torch
from torch import nn

import antennate.envs  # registers the environments
from antennate.control.conditioning import RepetitionDetector
from antennate.control.escape import Search
from antennate.control.geometric import TwoGaits, sizes_of
from antennate.control.knowledge import Knowledge
from antennate.control.policy.contract import contract_of
from antennate.control.policy.writer import write_policy
from antennate.errors import ConfigError
from antennate.params.base import from_values, put_over
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec

SCENES = {scene: name for name, scene in antennate.envs.ids().items()}
FREQUENCY = 1.0
"""Gait cycles a second [Hz], unless another is asked for."""
INTERFACE = {"action": "gait", "ticks": 20, "history": 10, "memory_time": 30.0}
"""A decision every 0.2 s, a fifth of a gait cycle; what was felt and done in the last two."""
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
SLIP, SHORTEST, LONGEST = 0.01, 5, 20
"""Chance of a decision to begin a slip: so many decisions of something else than was chosen, from
which the student learns to go on (Laskey et al. 2017, arXiv:1703.09327)."""
ROUND = 50
"""Decisions of each robot between two trainings."""
TEACHING = 0.45
"""Share of the time in which the teacher walks less and less, down to never."""
UNITS, GROUP, RATE, EPOCHS = 128, 8, 2e-3, 2
"""Units of the memory; robots of a batch; step size; trainings over all that was told a round."""
MIRROR = np.array([-1, -1, 1, 1, 1, 1, -1], np.float32)
"""What the teacher goes by, once left and right are exchanged, shape (7,)."""


def interface_of(frequency: float) -> dict:
    """Interface of a student that walks at a frequency [Hz] at most."""
    return INTERFACE | {"frequency": (0.2, frequency)}


def robot_of(name: str, frequency: float) -> RobotSpec:
    """The robot of a name or file, with legs that keep up with a frequency [Hz]."""
    robot = RobotSpec.named(name)
    legs = {"fastest": max(robot.legs.fastest, round(2.0 * np.pi * frequency + 0.005, 2))}
    return from_values(RobotSpec, put_over(robot.model_dump(), {"legs": legs}))


class Teacher(Search):
    """The search of `geometric` at a frequency, told what the student did.

    Its clock stands still while the student does something else than it was told. After PATIENCE
    decisions of that it goes on as if it had wanted that itself.

    Args:
        control: All numbers of the control.
        robot: The robot that walks and turns.
        batch: Number of robots B.
        frequency: Gait cycles a second [Hz].
    """

    def __init__(
        self, control: ControlParams, robot: RobotSpec, batch: int, frequency: float = FREQUENCY
    ) -> None:
        gait = control.gait.model_copy(update={"frequency": frequency})
        own = control.geometric.model_copy(update={"forward": "gait"})
        moves = TwoGaits(control.model_copy(update={"gait": gait, "geometric": own}), robot, 1)
        super().__init__(sizes_of(control, moves.speed, moves.turning), batch)
        repetition = control.repetition.model_copy(update={"window_cycles": WINDOW})
        self._pressure = repetition.pressure
        self._detector = RepetitionDetector(repetition, batch, DECISION, frequency)
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

    def state(self) -> np.ndarray:
        """What it goes by, shape (B, 7).

        Turn so far, side, tries, three times, as shares; and the side of the way as it is told,
        1 to the right, 0 straight ahead or not told.
        """
        times, walks = self._params, self.maneuver == FORWARD
        left = np.where(walks, 0.0, np.maximum(self._until - self._t, 0.0)) / times.return_time
        walked = np.nan_to_num(self._t - self._begun) * walks / times.proof_time
        free = np.clip((self._t - self._felt) / times.free_time, 0.0, 2.0) * walks
        turned, side = self._turned / times.return_time, np.where(self._right, 1.0, -1.0)
        known = self.knowledge.side
        told = np.zeros(len(side)) if known is None else -known
        tries, walked = np.minimum(self.tries, 4) / 4, np.clip(walked, 0.0, 1.5)
        parts = turned, side, tries, left, walked, free, told
        return np.stack(parts, axis=1).astype(np.float32)

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
        told: Whether the teacher knows the side.
        frequency: Gait cycles a second [Hz].
        words: What its environments are made of.
    """

    def __init__(
        self, scene: str, readings: str, seed: int, told: bool, frequency: float, words: dict
    ) -> None:
        self.envs = gym.make_vec(SCENES[scene], ROWS, autoreset_mode="SAME_STEP", **words)
        self.blind, self.told = readings == "none", told
        config = self.envs.unwrapped.config
        self.teacher = Teacher(config.control, config.robot, ROWS, frequency)
        self.done, (self.new, self.taught) = np.zeros(ROWS, np.int64), np.ones((2, ROWS), bool)
        self.memory = torch.zeros(ROWS, UNITS)
        self.slips, self.other = np.zeros((2, ROWS), np.int64)
        self.observation, self.info = self.envs.reset(seed=seed)

    def walk(self, network: Network, share: float, rng: np.random.Generator):
        """Walk a round, a share of it with the teacher; the lessons of the student.

        Observations (ROUND, B, n), advice, first decisions, what the teacher went by (ROUND, B, 7).
        """
        lessons = []
        for i in range(ROUND):
            if i % SEGMENT == 0:
                self.taught = rng.random(ROWS) < share
            flex = self.observation[:, [0, HISTORY]].astype(float)
            if self.told:
                self.teacher.knowledge = Knowledge(side=self.info["side"])
            advice = self.teacher.advise(flex, self.done)
            seen = untouched(self.observation) if self.blind else self.observation
            lessons.append((seen.copy(), advice, self.new.copy(), self.teacher.state()))
            chosen, self.memory = network.choose(seen, self.memory, self.new)
            self.done = np.where(self.taught, advice, chosen)
            self.slip(rng)
            self.step()
        return [np.stack(parts) for parts in zip(*lessons, strict=True)]

    def slip(self, rng: np.random.Generator) -> None:
        """Let some robots do something else than was chosen, for a while."""
        begins = (self.slips == 0) & (rng.random(ROWS) < SLIP)
        self.slips = np.where(begins, rng.integers(SHORTEST, LONGEST + 1, ROWS), self.slips)
        self.other = np.where(begins, rng.integers(len(CHOICES), size=ROWS), self.other)
        self.done = np.where(self.slips > 0, self.other, self.done)
        self.slips = np.maximum(self.slips - 1, 0)

    def step(self) -> None:
        """Carry out what was chosen."""
        actions = CHOICES[self.done].astype(np.float32)
        self.observation, _, ended, cut, self.info = self.envs.step(actions)
        self.new = ended | cut
        if self.new.any():
            self.teacher.begin(self.new)
            self.done[self.new] = FORWARD


def untouched(observation: np.ndarray) -> np.ndarray:
    """Observations, shape (B, n), as of two antennae that touch nothing."""
    blind, past = observation.copy(), CHANNELS * HISTORY
    blind[:, : 4 * HISTORY] = blind[:, past : past + 4] = 0.0
    return blind


@torch.no_grad()
def blindfold(network: Network) -> None:
    """Let a network see nothing of its antennae, whatever they read."""
    past = CHANNELS * HISTORY
    network.memory.weight_ih[:, : 4 * HISTORY] = 0.0
    network.memory.weight_ih[:, past : past + 4] = 0.0


def mirrored(observation, told, first, why):
    """Lessons with left and right exchanged; the gait phase is half a turn off."""
    past, means, phase = np.split(observation, [CHANNELS * HISTORY, CHANNELS * (HISTORY + 1)], -1)
    order, sign = [1, 0, 3, 2, 4, 5, 6], np.array([1, 1, 1, 1, 1, -1, 1], np.float32)
    shape = (*past.shape[:-1], CHANNELS, HISTORY)
    turned = (past.reshape(shape)[..., order, :] * sign[:, None]).reshape(past.shape)
    other = np.concatenate([turned, means[..., order] * sign, -phase], -1)
    return other, np.array([FORWARD, TURN_R, TURN_L, REVERSE])[told], first, why * MIRROR


class Network(nn.Module):
    """Scores of the four choices, by its memory; it also learns to say what the teacher goes by."""

    def __init__(self, inputs: int) -> None:
        super().__init__()
        self.memory, self.scores = nn.GRUCell(inputs, UNITS), nn.Linear(UNITS, len(CHOICES))
        self.why = nn.Linear(UNITS, len(MIRROR))
        self.register_buffer("mean", torch.zeros(inputs))
        self.register_buffer("scale", torch.ones(inputs))

    def forward(self, observation: torch.Tensor, memory: torch.Tensor, first: torch.Tensor):
        """Scores (B, 4) and memory (B, UNITS) after it; rows that begin remember nothing."""
        x = ((observation - self.mean) / self.scale).clamp(-5.0, 5.0)
        memory = self.memory(x, torch.where(first[:, None], 0.0, memory))
        return self.scores(memory), memory

    @torch.no_grad()
    def choose(self, observation: np.ndarray, memory: torch.Tensor, first: np.ndarray):
        """The choice for each observation, shape (B,), and the memory after it."""
        scores, memory = self(torch.from_numpy(observation), memory, torch.from_numpy(first))
        return scores.argmax(1).numpy(), memory

    def save(self, path: Path, config, about: str) -> Path:
        """Write it as a policy."""
        contract = contract_of(config.interface, config.control, config.robot, about=about)
        unit, last = self.memory, self.scores
        parts = unit.weight_ih, unit.weight_hh, unit.bias_ih, unit.bias_hh, last.weight, last.bias
        *memory, weight, bias = (part.detach().numpy() for part in parts)
        normal = self.mean.numpy(), self.scale.numpy(), 5.0
        return write_policy(path, contract, [(weight, bias)], *normal, CHOICES, memory)


class Lessons:
    """All that the student was told, robot by robot in the order of time, and its training."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._optimiser = torch.optim.AdamW(network.parameters(), RATE, weight_decay=1e-3)
        self._rounds: list[list[torch.Tensor]] = []

    def add(self, walks: list[list[np.ndarray]]) -> None:
        """Take a round of lessons, as they are and mirrored."""
        both = [each for walk in walks for each in (walk, mirrored(*walk))]
        joined = (np.concatenate(parts, axis=1) for parts in zip(*both, strict=True))
        self._rounds.append([torch.from_numpy(part) for part in joined])

    def train(self, epochs: int = EPOCHS, rate: float = RATE) -> float:
        """Some epochs over all; the share of advice that the student repeats, of the last one."""
        network, right, count = self._network, 0, 0
        seen = torch.cat([given.flatten(0, 1) for given, *_ in self._rounds])
        network.mean.copy_(seen.mean(0))
        network.scale.copy_(seen.std(0).clamp(min=0.02))
        self._optimiser.param_groups[0]["lr"] = rate
        for _ in range(epochs):
            right = count = 0
            for rows in torch.randperm(self._rounds[0][1].shape[1]).split(GROUP):
                memory = torch.zeros(len(rows), UNITS)
                for lessons in self._rounds:
                    memory, good = self._learn(*(part[:, rows] for part in lessons), memory)
                    right, count = right + good, count + ROUND * len(rows)
        return right / count

    def _learn(self, given, told, first, why, memory):
        """Learn one round of some robots; the memory after it, and how often it was right."""
        scores, said = [], []
        for i in range(len(told)):
            score, memory = self._network(given[i], memory, first[i])
            scores.append(score)
            said.append(self._network.why(memory))
        scores = torch.stack(scores)
        loss = nn.functional.cross_entropy(scores.flatten(0, 1), told.flatten())
        loss = loss + nn.functional.mse_loss(torch.stack(said), why)
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._network.parameters(), 1.0)
        self._optimiser.step()
        return memory.detach(), int((scores.argmax(2) == told).sum())


def teach(options: argparse.Namespace) -> Path:
    """Walk and train until all decisions are made; the policy file."""
    torch.manual_seed(options.seed)
    torch.set_num_threads(1)
    rng, readings = np.random.default_rng(options.seed), options.readings
    first = 10_000_000 + 1000 * options.seed
    robot, pace = robot_of(options.robot, options.frequency), options.frequency
    told, gait = options.teacher_knows == "side", {"antenna_amplitude": math.radians(options.swing)}
    words = {"robot": robot, "interface": interface_of(pace), "control": {"gait": gait}}
    how = told, pace, words
    classes = [Class(scene, readings, first + i, *how) for i, scene in enumerate(options.scene)]
    network = Network(classes[0].observation.shape[1])
    if readings == "none":
        blindfold(network)
    lessons, start, decisions = Lessons(network), time.monotonic(), 0
    while decisions < options.decisions:
        share = max(0.0, 1.0 - decisions / (TEACHING * options.decisions))
        lessons.add([group.walk(network, share, rng) for group in classes])
        decisions += ROUND * ROWS * len(classes)
        right = lessons.train()
        minutes = (time.monotonic() - start) / 60.0
        print(f"{minutes:.1f} min: {decisions} decisions, {100 * right:.0f} % as told", flush=True)
    lessons.train(10, RATE / 5)
    words = f"scenes {' '.join(options.scene)}, readings {readings}, seed {options.seed}"
    words += f", robot {options.robot}, {pace:g} Hz, swing {options.swing:g}°"
    words += f", teacher knows {options.teacher_knows}"
    about = f"examples/imitate.py, {words}, {decisions} decisions"
    options.out.mkdir(parents=True, exist_ok=True)
    return network.save(options.out / "policy.onnx", classes[0].envs.unwrapped.config, about)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the policy")
    parser.add_argument("--scene", nargs="+", default=["uturn", "room"], choices=[*SCENES])
    parser.add_argument("--readings", default="own", choices=["own", "none"], help="what it feels")
    parser.add_argument("--robot", default="scuttle", help="name or TOML file of the robot")
    parser.add_argument("--frequency", type=float, default=FREQUENCY, help="of the gait [Hz]")
    parser.add_argument("--swing", type=float, default=0.0, help="of the antenna bases [deg]")
    parser.add_argument("--teacher-knows", default="nothing", choices=["nothing", "side"])
    parser.add_argument("--decisions", type=int, default=60_000, help="600 a scene and round")
    parser.add_argument("--seed", type=int, default=1, help="of all chance")
    options = parser.parse_args()
    if options.decisions < 1:
        parser.error(f"--decisions: expected at least 1, found {options.decisions}")
    try:
        print(teach(options))
    except ConfigError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
