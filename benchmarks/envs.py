"""Environments beside trials of `tunnel`, and their resets beside those of fresh processes.

    uv run python benchmarks/envs.py                  # control ticks per processor second, 2 min
    uv run python benchmarks/envs.py --resets 4096    # first observations, bit for bit, 4 min

Ticks: B rows of the vector environment that walk FORWARD, over B trials of `tunnel` in lockstep
under `open` and under `closed`, from the same starts, taken in turn in this process. Drawing and
compiling a tunnel is in neither. Every row must end where the trial under `open` ends, bit for bit.

Resets: one environment begins episodes one after the other, each walked a few decisions, and
processes that begin a part of them each in the opposite order must get the same observations.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from typing import Any
from unittest import mock

import gymnasium as gym
import numpy as np
from measuring import cpu_seconds, in_turn, ratios, spread
from trial import prepare

import antennate.envs
from antennate.envs import episodes
from antennate.experiments.tunnel import lockstep
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.physics import TunnelConfig

SECONDS = 4.0
"""Time that each trial walks [s]; within it none gets out."""
BATCHES = (8, 24)
PROCESSES = 8
"""Fresh processes that begin the same episodes."""
WALKED = 3
"""Decisions walked after each reset, so that there is something to leave behind."""


def ticks(batch: int, repetitions: int) -> dict[str, Any]:
    """Control ticks of all rows per second of processor time."""
    config = TunnelConfig(time_limit=SECONDS - 0.005)  # the tick at SECONDS is the last
    count = batch * round(SECONDS * config.control.rate)
    ends: dict[str, np.ndarray] = {}

    def trials(name: str) -> float:
        starts = prepare(config, batch)
        with mock.patch.object(lockstep, "draw_trial", lambda _, __, i, *___: starts[i]):
            run = lambda: run_trials(config, name, range(batch), lambda _: None, batch)  # noqa: E731
            seconds = cpu_seconds(run)
        ends[name] = np.array([start.world.head for start in starts])
        return count / seconds

    def vector(ticks: int) -> float:
        starts = prepare(config, batch)
        drawn = lambda _, __, seed, i: (starts[i], np.ones(2), np.zeros(2))  # noqa: E731
        with mock.patch.object(episodes, "draw_episode", drawn):
            envs = gym.make_vec("antennate/Tunnel-v1", batch, interface={"ticks": ticks})
            envs.reset(seed=0)
            forward = np.zeros(batch, np.int64)

            def walk() -> None:
                for _ in range(count // batch // ticks):
                    envs.step(forward)

            seconds = cpu_seconds(walk)
        ends[f"vector {ticks}"] = np.array([start.world.head for start in starts])
        return count / seconds

    cases = {
        "open": lambda: trials("open"),
        "closed": lambda: trials("closed"),
        10: lambda: vector(10),
        1: lambda: vector(1),
    }
    rates = in_turn(cases, repetitions)
    for name in ("vector 10", "vector 1"):
        if not np.array_equal(ends[name], ends["open"]):
            raise SystemExit(f"{name}: expected to end where the trials under open end")
    return {
        "rows": batch,
        "ticks_a_second": {str(name): spread(values) for name, values in rates.items()},
        "over": {
            f"decision of {n} ticks over {name}": spread(ratios(rates[n], rates[name]))
            for n in (10, 1)
            for name in ("open", "closed")
        },
    }


def first_observations(scene: str, numbers: list[int]) -> list[str]:
    """First observations of episodes as hexadecimal digits, by one environment in turn."""
    env = gym.make(f"antennate/{scene}-v1", interface={"ticks": 2}).unwrapped
    texts = []
    for number in numbers:
        observation, info = env.reset(seed=7, options={"episode_number": number})
        texts.append(observation.tobytes().hex() + np.array(info["head"]).tobytes().hex())
        for step in range(WALKED):
            env.step((number + step) % 4)
    return texts


def resets(scene: str, count: int) -> dict[str, Any]:
    """How many first observations differ from those of fresh processes."""
    numbers = [*range(count)]
    ours = first_observations(scene, numbers)
    differ = 0
    for first in range(PROCESSES):
        part = numbers[first::PROCESSES][::-1]
        words = [sys.executable, __file__, "--scene", scene, "--part", json.dumps(part)]
        reply = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        theirs = json.loads(reply)
        differ += sum(ours[n] != text for n, text in zip(part, theirs, strict=True))
    return {"scene": scene, "resets": count, "processes": PROCESSES, "differ": differ}


def main() -> None:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--resets", type=int, help="how many resets to compare")
    parser.add_argument("--scene", default="Tunnel", help="name of the scene in an id")
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--part", type=json.loads, help=argparse.SUPPRESS)
    options = parser.parse_args()
    antennate.envs.register()
    if options.part is not None:
        print(json.dumps(first_observations(options.scene, options.part)))
    elif options.resets:
        print(json.dumps(resets(options.scene, options.resets), indent=2))
    else:
        for batch in BATCHES:
            print(json.dumps(ticks(batch, options.repetitions), indent=2))


if __name__ == "__main__":
    main()
