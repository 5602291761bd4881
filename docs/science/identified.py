"""Hidden robots that `antennate fit` has to find: `python docs/science/identified.py FOLDER`.

Ten robots are drawn from a seed. Each goes through the protocol `identify` on the plant of the twin
in virtual time, with the noise of its sensors and the rounding of its servos, and leaves a log;
`fit` gets the log and the default robot with an inertial sensor, and never the hidden one.

The criterion, before the run: of the numbers that are told, 80 to 98 % have their truth within the
90 % interval; on steps that were left out, speed and turn in a cycle and lag are predicted within
5 % or twice the repeatability. Two seeds are judged, each once: 60601 on robots without errors of
their zeros, whose legs always slip alike, and 60602 on robots with both as the twin has them
(`VariationParams`), after `fit` had learnt of the latter. While `fit` was made, others were used.

FOLDER/numbers.csv has a row for each parameter of each robot, FOLDER/steps.csv one for each measure
of each step that was left out. Robots that are in the folder are not made anew.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from antennate.control.protocol import Protocol, Step, lead, targets
from antennate.params.base import put_over
from antennate.params.control import ControlParams
from antennate.params.scene import VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.world import World
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.writer import LogWriter
from antennate.types import Floats
from antennate_lab.fit import measures
from antennate_lab.fit.config import FitConfig
from antennate_lab.fit.parameters import parameters
from antennate_lab.fit.run import run
from antennate_lab.fit.simulated import PHYSICS, Course, commands, simulated, world_of
from dynamixel_bus.model import POSITION_UNIT

JUDGED = 60602
"""Seed of the judged run."""
KNOWN = RobotSpec.model_validate({"imu": {"kind": "head"}})
"""The robot that `fit` is given."""
REPEATS = 4
"""Walks of one robot from postures that differ by POSTURE, which tell the repeatability."""
POSTURE = 0.002
"""Standard deviation of the joints' angles at the beginning [rad]."""
CONTROL = ControlParams()
TWIN = VariationParams()
"""What chance does on the twin."""
STEADY = VariationParams(slip_log_sd=0.0)
"""The same without friction that wanders."""
VARIATIONS = {60601: VariationParams(joint_bias=0.0, slip_log_sd=0.0)}
"""What chance does with a seed, if not as on the twin."""
_NEITHER, _NOWHERE = (math.nan, math.nan), (math.nan, math.nan, math.nan)
BEGIN = 1000.0
"""What the clock of motion capture shows when the log begins [s]."""
CAPTURE = (0.0003, 0.0003, 0.005)
"""Standard deviation of a place [m] and a heading [rad] by motion capture."""
Pose = tuple[float, float, float]
"""Place x, y [m] and heading [rad]."""


def record(
    robot: RobotSpec,
    protocol: Protocol,
    path: Path,
    seed: int,
    seen: Path | None = None,
    variation: VariationParams = STEADY,
) -> None:
    """Write the log of a robot that goes through a protocol.

    Args:
        robot: The robot as it is.
        protocol: Made for it.
        path: The log, new.
        seed: Of the noise of its sensors.
        seen: Table of poses of the head on the floor to write, with a clock of its own.
        variation: What chance does.
    """
    header = Header(
        controller="protocol",
        params=CONTROL,
        robot=KNOWN,
        protocol=protocol.model_dump(mode="json"),
    )
    rng = np.random.default_rng(seed)
    with LogWriter(path, header) as log:
        rows = []
        for tick, pose in _ticks(robot, protocol, variation, rng):
            log.write(tick)
            rows.append((BEGIN + tick.now, *pose))
    if seen is not None:
        table = pd.DataFrame(rows, columns=["time", "x", "y", "heading"]).dropna()
        chance = np.random.default_rng([seed, 2])  # what a marker is off [m], and two of them [rad]
        table[["x", "y", "heading"]] += chance.standard_normal((len(table), 3)) * CAPTURE
        table.to_csv(seen, index=False, lineterminator="\n")


def _ticks(
    robot: RobotSpec, protocol: Protocol, variation: VariationParams, rng: np.random.Generator
) -> Iterator[tuple[Tick, Pose]]:
    """Ticks of the whole protocol with the head's pose, which is NaN in the air.

    Hanging steps and those on the floor have a world each.
    """
    period, number = CONTROL.period, 0
    chance = Disturbance(rng, variation, robot, period)
    for hanging in (True, False):
        steps = [step for step in protocol.steps if (step.place == "hanging") == hanging]
        sim = SimRobot(1, robot, period, PHYSICS.timestep)
        rest = np.zeros(len(robot.joint_names))
        world = world_of(robot, protocol.hook if hanging else None, rest)
        sim.load(0, world, chance)
        for at, (angles, events) in enumerate(_courses(steps, robot, protocol.carry), 1):
            frame, number = sim.read(), number + 1
            pose = _NOWHERE if hanging else (*world.head[:2].tolist(), world.heading)
            sim.write(next(commands(robot, angles[None])))
            sim.sleep_until(at * period)
            tick = Tick(
                number=number,
                t=(number - 1) * period,
                now=(number - 1) * period,
                counts=(float(frame.counts[0, 0]), float(frame.counts[0, 1])),
                reading=(float(frame.counts[0, 0]), float(frame.counts[0, 1])),
                level=_NEITHER,
                contact=(2, 2),
                maneuver=4,
                phase=math.nan,
                angles=tuple(angles.tolist()),
                state="OK",
                sent=number,
                positions=tuple(
                    (np.rint(frame.positions[0] / POSITION_UNIT) * POSITION_UNIT).tolist()
                ),
                angular_velocity=tuple(frame.angular_velocity[0].tolist()),
                linear_acceleration=tuple(frame.linear_acceleration[0].tolist()),
                events=events,
            )
            yield tick, pose


def _courses(
    steps: list[Step], robot: RobotSpec, carry: float
) -> Iterator[tuple[Floats, tuple[str, ...]]]:
    """Joint targets of each tick, and what begins or ends with it; first it is carried there."""
    last, after = np.zeros(len(robot.joint_names)), ()
    for _ in range(round(carry / CONTROL.period)):
        yield last, after
    for step in steps:
        wanted = targets(step, robot, CONTROL)
        for angles in lead(last, wanted[0], robot, CONTROL.period, 1.0):
            yield angles, after
            last, after = angles, ()
        turns = np.rint((last - wanted[0]) / (2.0 * math.pi)) * 2.0 * math.pi
        begin = (f"begin {step.called}",)
        for angles in wanted + turns * np.isinf(robot.limits):
            yield angles, begin
            last, begin = angles, ()
        after = (f"end {step.called}",)
    yield last, after


def hidden(seed: int, number: int) -> RobotSpec:
    """The robot of a number: within the bounds that the issue names."""
    rng = np.random.default_rng([seed, number])
    factors = np.ones(KNOWN.leg_count)
    factors[rng.integers(KNOWN.leg_count)] = 0.5
    backlash = np.zeros(KNOWN.yaw_count)
    backlash[rng.integers(KNOWN.yaw_count)] = math.radians(1.0)
    springs, gains = rng.uniform(0.8, 1.2, (2, 2))
    servos = {}
    for name in ("xc430_w240", "xl330_m288"):
        usual = KNOWN.servos.of(name).gain_divisor
        delay = float(rng.uniform(0.0, 0.02))
        servos[name] = {"gain_divisor": usual / 2.0 ** rng.uniform(-1.0, 1.0), "delay": delay}
    antenna = KNOWN.antenna
    over = {
        "leg_friction": float(rng.uniform(0.4, 1.0)),
        "legs": {"friction_factors": factors.tolist()},
        "yaw": {"backlash": backlash.tolist()},
        "servos": servos,
        "antenna": {
            "three_coil_stiffness_n_mm_per_deg": springs[0]
            * antenna.three_coil_stiffness_n_mm_per_deg,
            "sensor": {"bend_gain": gains[0] * antenna.sensor.bend_gain},
        },
        "antennae": {"right_stiffness": springs[1] / springs[0], "right_gain": gains[1] / gains[0]},
    }
    return RobotSpec.model_validate(put_over(KNOWN.model_dump(), over))


def walked(
    robot: RobotSpec, course: Course, rng: np.random.Generator, wander: float = 0.0
) -> Floats:
    """Speed [m/cycle], turn [rad/cycle] and lag [s] of some walks, shape (REPEATS, 3)."""
    rows = []
    for number in range(REPEATS):
        places: list[tuple[float, float, float]] = []

        def look(world: World, places: list[tuple[float, float, float]] = places) -> None:
            places.append((*world.head[:2].tolist(), world.heading))

        noise = POSTURE * rng.standard_normal(course.positions[:1].shape)
        begin = replace(course, positions=course.positions + noise)
        made = simulated(robot, begin, look, wander, (number,))
        lag = float(measures.lags(made).mean())
        x, y, heading = np.array(places).T
        cycles = len(x) * course.period / course.cycle
        turn = float(np.unwrap(heading)[-1] - heading[0]) / cycles
        rows.append((math.hypot(x[-1] - x[0], y[-1] - y[0]) / cycles, turn, lag))
    return np.array(rows)


def judged(folder: Path, seed: int, number: int, workers: int) -> None:
    """Hide a robot, record it, fit it, and write what came out."""
    robot, own = hidden(seed, number), folder / f"robot-{number}"
    variation = VARIATIONS.get(seed, TWIN)
    own.mkdir(parents=True, exist_ok=True)
    (own / "known.toml").write_text('[imu]\nkind = "head"\n', encoding="utf-8")
    log = own / "drive.mcap"
    log.unlink(missing_ok=True)
    protocol = Protocol.named("identify").made_for(KNOWN, CONTROL)
    record(robot, protocol, log, number, variation=variation)
    config = FitConfig(log=(str(log),), robot=str(own / "known.toml"))
    outcome = run(config, workers, lambda done, of: print(f"\r{done}/{of}", end="", flush=True))
    numbers = []
    for row in outcome.rows:
        path, _, place = row.name.partition("[")
        at = int(place[:-1]) if place else None
        truth = parameters(robot, [(path, at)])[0].start
        low, high = row.low, row.high
        holds = low <= truth <= high
        known = {"robot": number, "name": row.name, "told": row.told, "before": row.before}
        numbers.append(
            known | {"truth": truth, "value": row.value, "low": low, "high": high, "holds": holds}
        )
    rng = np.random.default_rng([seed, number, 1])
    steps: list[dict[str, Any]] = []
    for _, course in outcome.courses:
        if course.name in outcome.held:
            three = [walked(robot, course, rng, variation.slip_log_sd)]
            three += [walked(each, course, rng) for each in (KNOWN, outcome.after)]
            for at, measure in enumerate(("speed", "turn", "lag")):
                truth, before, after = (float(each[:, at].mean()) for each in three)
                sd = float(three[0][:, at].std(ddof=1))
                allowed = max(0.05 * abs(truth), 2.0 * sd)
                within = {"before_within": abs(before - truth) <= allowed}
                within |= {"after_within": abs(after - truth) <= allowed}
                step = {"robot": number, "step": course.name, "measure": measure, "truth": truth}
                steps.append(step | {"sd": sd, "before": before, "after": after} | within)
    pd.DataFrame(steps).to_csv(own / "steps.csv", index=False, lineterminator="\n")
    pd.DataFrame(numbers).to_csv(own / "numbers.csv", index=False, lineterminator="\n")


def main() -> None:
    """Judge all robots."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=JUDGED)
    parser.add_argument("--robots", type=int, nargs="+", default=range(10))
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    for number in options.robots:
        if not (options.folder / f"robot-{number}" / "numbers.csv").exists():
            judged(options.folder, options.seed, number, options.workers)
    tables = {}
    for name in ("numbers", "steps"):
        parts = [
            pd.read_csv(options.folder / f"robot-{number}" / f"{name}.csv")
            for number in options.robots
        ]
        tables[name] = pd.concat(parts)
        tables[name].to_csv(options.folder / f"{name}.csv", index=False, lineterminator="\n")
    numbers, steps = tables["numbers"], tables["steps"]
    told = numbers[numbers.told]
    found = {
        "seed": options.seed,
        "told": f"{len(told)} of {len(numbers)}",
        "held": round(float(told.holds.mean()), 3),
        "predicted": steps.groupby("measure").after_within.mean().round(3).to_dict(),
        "by_default": steps.groupby("measure").before_within.mean().round(3).to_dict(),
    }
    (options.folder / "identified.json").write_text(
        json.dumps(found, indent=2) + "\n", encoding="utf-8"
    )
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
