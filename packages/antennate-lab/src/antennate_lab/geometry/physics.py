"""The gaits of `antennate geometry`: which are walked, and what model and engine make of each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from antennate.control.readers import HARDWARE_ALONE, unread_lift, unused
from antennate.params.base import Params, number, require_whole_steps
from antennate.params.gaits import GAITS, GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.mechanics import best_lead, cycles, require_wave, twist_map
from antennate.robots.spec import RobotSpec, WalkingRobot
from antennate.types import Floats, Maneuver
from antennate_lab.gait.config import GaitStudyConfig
from antennate_lab.gait.physics import measure, walk_flat
from antennate_lab.geometry.result import Walked
from geometric_locomotion.twist import TwistMap, Wave

SEED = 2611
"""Seed of the random gaits, written here before their first run."""
LEAST_AMPLITUDE = 0.1
"""Smallest amplitude of a random gait [rad]; without a wave lead and wave number mean nothing."""
LARGEST_OFFSET = 0.35
"""Largest offset of a random gait either way [rad]."""
WAVES = (0.5, 1.5)
"""Wave numbers of random gaits; leads are those of a full turn."""
STEP_OF_LEAD = math.radians(10.0)
"""Between two leads that are walked."""
_SPREAD = math.radians(1.0)
"""Between the first and the last lead of a gait that is walked again and again [rad]."""
SPARE = 0.003
"""What the fastest gaits leave of the joints' limit [rad]."""


class GeometryConfig(Params):
    """Everything that decides the outcome of `antennate geometry`."""

    unread: ClassVar[tuple[str, ...]] = (
        *(path for path in HARDWARE_ALONE if path != "robot.yaw.fastest"),
        "gait.turn_offset",
    )
    gaits: int = number(60, "1", "assumed: an interval of a few percent", ge=3, le=10_000)
    """Random gaits, all at the frequency of the gait."""
    seed: int = number(SEED, "1", "assumed: any, chosen before the first run", ge=0)
    """Seed of the random gaits."""
    wave_numbers: tuple[Annotated[float, Field(gt=0, le=3)], ...] = number(
        (0.5, 0.75, 1.0, 1.25, 1.5),
        "1",
        "assumed: the range of the random gaits",
        min_length=1,
        max_length=50,
    )
    """Wave numbers whose best lead is sought."""
    leads: int = number(9, "1", "assumed: 40 deg to both sides of the model's best", ge=5, le=36)
    """Leads walked about each best one, 10 deg apart."""
    front_waves: int = number(9, "1", "assumed: steps of 0.1", ge=1, le=50)
    """Wave numbers from 0.4 to 1.2 of the gaits that may be fast or cheap."""
    turns: int = number(12, "1", "assumed: as many as show a trend", ge=0, le=500)
    """Twists of the map that are walked; robots with lifting legs have no map."""
    cells: int = number(24, "1", "assumed: steps of 15 deg", ge=6, le=200)
    """Cells of the map over body and leg phase, each way."""
    repeats: int = number(9, "1", "assumed: enough for an interval", ge=1, le=1000)
    """Walks of each named gait, its lead spread over 1 deg: contacts magnify what is tiny."""
    largest_amplitude: float | None = number(None, "rad", "assumed: see below", gt=0.1, le=1.2)
    """Largest amplitude; the limit of the yaw joints if legs roll, else that of the gait."""
    cycles: int = number(4, "1", "measured: antennate gait, as there", ge=2, le=100)
    """Gait cycles measured."""
    settling_cycles: int = number(2, "1", "measured: antennate gait, as there", ge=0, le=100)
    """Gait cycles before measuring."""
    rate: float = number(100.0, "Hz", "paper: about 100 Hz over serial", gt=0, le=1000)
    """Control ticks per second."""
    body_length: float | None = number(None, "m", "assumed: the links in a row", gt=0)
    """What counts as a body length; the length of the robot if not given."""
    measured: float | None = number(None, "1", "assumed: nobody measured it")
    """Body lengths a cycle that a real robot was measured to walk."""
    robot: WalkingRobot = RobotSpec()
    gait: GaitParams = GaitParams()
    physics: PhysicsParams = PhysicsParams()

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and the step of legs that do not lift."""
        return unused(self.robot) | unread_lift(self.robot, "gait")

    @property
    def rolls(self) -> bool:
        """Whether the legs roll."""
        return self.robot.legs.kind == "rolling"

    @property
    def largest(self) -> float:
        """Largest amplitude [rad]."""
        if self.largest_amplitude is not None:
            return self.largest_amplitude
        fastest = self.robot.yaw.fastest / (2.0 * math.pi * self.gait.frequency)
        return min(self.robot.yaw_limit - SPARE, fastest) if self.rolls else self.gait.amplitude

    @property
    def length(self) -> float:
        """A body length [m]."""
        return self.robot.length if self.body_length is None else self.body_length

    @model_validator(mode="after")
    def _agree(self) -> GeometryConfig:
        require_whole_steps("rate", self.rate, self.physics.timestep)
        self.robot.require_pace("gait.frequency", self.gait.frequency)
        require_wave(self.robot, self.gait)
        widest = self.gait.model_copy(update={"amplitude": self.largest})
        require_wave(self.robot, widest)
        return self


def random_waves(config: GeometryConfig) -> Wave:
    """The random gaits: all four numbers uniform; what would bend too far is cut by the gait."""
    rng, count = np.random.default_rng(config.seed), config.gaits
    return Wave(
        amplitude=rng.uniform(LEAST_AMPLITUDE, config.largest, count),
        wave_number=rng.uniform(*WAVES, count),
        lead=rng.uniform(0.0, 2.0 * math.pi, count),
        offset=rng.uniform(-LARGEST_OFFSET, LARGEST_OFFSET, count),
    )


def lead_waves(config: GeometryConfig) -> Wave:
    """Leads about the model's best for each wave number, at the amplitude of the gait."""
    number = np.array(config.wave_numbers)
    best = best_lead(config.robot, config.gait, Wave(config.gait.amplitude, number, 0.0, 0.0))
    return _about(config, config.gait.amplitude, number, best, config.leads)


def front_waves(config: GeometryConfig) -> Wave:
    """The largest amplitude at all wave numbers, with leads from 10 deg before the best one."""
    number = np.linspace(0.4, 1.2, config.front_waves)
    best = best_lead(config.robot, config.gait, Wave(config.largest, number, 0.0, 0.0))
    return _about(config, config.largest, number, best + STEP_OF_LEAD, 5)


def _about(
    config: GeometryConfig, amplitude: float, number: Floats, middle: Floats, count: int
) -> Wave:
    leads = middle[:, None] + STEP_OF_LEAD * (np.arange(count) - (count - 1) / 2)
    flat = np.repeat(number, count)
    return Wave(np.full(len(flat), amplitude), flat, leads.ravel(), np.zeros(len(flat)))


def named_gaits(config: GeometryConfig) -> dict[str, GaitParams]:
    """The gait of the run, named gaits for such legs, and the rival: the gait in more haste."""
    gaits = {"gait": config.gait}
    if config.rolls:
        for name, table in GAITS.items():
            gait = GaitParams.model_validate({"frequency": config.gait.frequency, **table})
            if "lift" not in table and gait.amplitude <= config.robot.yaw_limit:
                gaits[name] = gait
        gaits = {
            name: gait for name, gait in gaits.items() if name == "gait" or gait != config.gait
        }
    faster = min(1.15 * config.gait.frequency, config.robot.fastest_gait, 1.0)
    gaits["gait at 1.15 f"] = config.gait.model_copy(update={"frequency": faster})
    return gaits


def wanted_twists(config: GeometryConfig, twists: TwistMap) -> Floats:
    """Speeds [m/s] and curvatures [1/m] over what the map reaches, shape (turns, 2)."""
    sharp = 0.85 * twists.sharpest
    curvatures = np.linspace(-sharp, sharp, config.turns) if config.turns else np.zeros(0)
    wanted = np.zeros((config.turns, 2))
    for i, curvature in enumerate(curvatures.tolist()):
        low, high = twists.speeds(curvature)
        wanted[i] = low + (0.3, 0.6, 0.9)[i % 3] * (high - low), curvature
    return wanted


@dataclass(frozen=True)
class Plans:
    """All gaits of a run with what the model makes of them.

    Attributes:
        rows: The gaits; what the engine makes of them is still missing.
        twists: The twist map, None if legs lift.
    """

    rows: list[Walked]
    twists: TwistMap | None


def plan(config: GeometryConfig) -> Plans:
    """The gaits of a run, by the model alone."""
    rows = [
        *_modelled(config, "random", random_waves(config)),
        *_modelled(config, "lead", lead_waves(config)),
        *_modelled(config, "front", front_waves(config)),
    ]
    count = 0
    for name, gait in named_gaits(config).items():
        steps = (np.arange(config.repeats) - (config.repeats - 1) / 2) / max(config.repeats - 1, 1)
        leads: Floats = gait.body_phase + _SPREAD * steps
        many = Wave(gait.amplitude, gait.wave_number, leads, 0.0)
        for row in _modelled(config, "named", many, gait.frequency):
            rows.append(replace(row, trial=count, name=name))
            count += 1
    if not config.rolls:
        return Plans(rows, None)
    twists = twist_map(config.robot, config.gait)
    wanted = wanted_twists(config, twists)
    if len(wanted):
        gaits = [twists.gait(*pair) for pair in wanted.tolist()]
        turns = _modelled(
            config, "turn", Wave(*(np.array(part) for part in zip(*gaits, strict=True)))
        )
        pairs = zip(turns, wanted.tolist(), strict=True)
        rows += [replace(row, wanted_m_s=v, wanted_per_m=k) for row, (v, k) in pairs]
    return Plans(rows, twists)


def _modelled(
    config: GeometryConfig, part: str, wave: Wave, frequency: float | None = None
) -> list[Walked]:
    """Rows of some gaits, with what the model makes of them."""
    f = config.gait.frequency if frequency is None else frequency
    gait = config.gait.model_copy(update={"frequency": f})
    walked = cycles(config.robot, gait, wave)
    numbers = np.broadcast_arrays(*(np.atleast_1d(np.asarray(x, float)) for x in wave))
    amplitude, wave_number, lead, offset = (part.tolist() for part in numbers)
    yaw = np.degrees(walked.yaw).tolist()
    return [
        Walked(
            part=part,
            trial=i,
            name="",
            amplitude_rad=amplitude[i],
            wave_number=wave_number[i],
            lead_rad=lead[i],
            offset_rad=offset[i],
            frequency_hz=f,
            model_speed_m_s=f * float(walked.step[i]),
            model_yaw_deg_per_cycle=yaw[i],
            model_cost=float(walked.cost[i]),
            model_torque_n_m=float(walked.torque[i]),
        )
        for i in range(len(yaw))
    ]


def walk(config: GeometryConfig, row: Walked) -> Walked:
    """A gait by the engine too."""
    numbers = {
        "frequency": row.frequency_hz,
        "amplitude": row.amplitude_rad,
        "wave_number": row.wave_number,
        "body_phase": math.remainder(row.lead_rad, 2.0 * math.pi),
        "turn_offset": abs(row.offset_rad),
    }
    others = {n: getattr(config.gait, n) for n in GaitParams.model_fields if n not in numbers}
    gait = GaitParams(**numbers, **others)
    study = GaitStudyConfig().model_copy(
        update={
            "cycles": config.cycles,
            "settling_cycles": config.settling_cycles,
            "rate": config.rate,
            "body_length": config.body_length,
            "robot": config.robot,
            "gait": gait,
            "physics": config.physics,
        }
    )
    maneuver = Maneuver.FORWARD
    if row.offset_rad:
        maneuver = Maneuver.TURN_R if row.offset_rad > 0 else Maneuver.TURN_L
    pace = measure(
        walk_flat(study, row.part, gait, maneuver), config.settling_cycles, config.cycles
    )
    return replace(
        row,
        speed_m_s=pace.speed_m_s,
        yaw_deg_per_cycle=pace.yaw_deg_per_cycle,
        cost_of_transport=pace.cost_of_transport,
    )
