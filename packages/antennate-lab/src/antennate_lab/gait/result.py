"""What the walks of `antennate gait` come to: the content of its result.json."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from antennate.studies.columns import Ends, column, tabular
from antennate.types import Maneuver
from antennate_lab.gait.config import GaitStudyConfig
from antennate_lab.gait.physics import Pace, Speed, Walk, measure, rolling_speed

MANEUVERS = (Maneuver.FORWARD, Maneuver.TURN_L, Maneuver.TURN_R, Maneuver.REVERSE)
WAVE_OFF, OPTIMISED = "wave_off", "optimised"
"""Names of two more walks."""


@tabular
class WaveOff:
    """FORWARD with a straight body."""

    speed_m_s: float
    """Speed of the legs alone."""
    expected_m_s: float | None
    """Speed of legs that roll without slip; `null` for lifting legs."""
    ratio: float | None
    """Speed over the expected one; `null` for lifting legs."""


@tabular
class PhasePoint(Speed):
    """FORWARD with one lead of the body wave over the legs."""

    body_phase_rad: float
    """Lead of the body wave."""


@tabular
class CostOfPhase:
    """What a wrong lead costs, as shares of the speed at the best lead that was tried."""

    chosen_over_best: float
    """Speed at the lead of the configuration."""
    worst_over_best: float
    """Speed at the slowest lead."""


@tabular
class UnknownNumber:
    """FORWARD with one unknown number at both ends of its range, all others as configured."""

    range: Ends
    """Both ends of its range."""
    body_lengths_per_cycle: Ends
    """Body lengths per gait cycle at either end."""
    change: float
    """Body lengths per gait cycle at the upper end less those at the lower."""


@tabular
class UnknownNumbers:
    """FORWARD over draws of all unknown numbers, in body lengths per gait cycle."""

    draws: int
    """Number of draws."""
    median: float = column("median")
    """Median of the draws."""
    interval95: Ends = column("95 % of the draws")
    """Interval that holds 95 % of the draws."""
    range: Ends = column("all draws")
    """Smallest and largest draw."""
    body_lengths_per_cycle: list[float]
    """Every draw."""
    parameters: dict[str, UnknownNumber]
    """Each unknown number alone, by its dotted name."""


@tabular
class GaitNumbers:
    """The numbers of a gait that are chosen."""

    amplitude_rad: float = column("amplitude", "deg", form=".1f", scale=math.degrees(1.0))
    """Amplitude of the body wave."""
    wave_number: float = column("wave number")
    """Waves along the body."""
    body_phase_rad: float = column("lead", "deg", form=".0f", scale=math.degrees(1.0))
    """Lead of the body wave over the legs."""
    turn_offset_rad: float | None = column("yaw offset", "deg", form=".1f", scale=math.degrees(1.0))
    """Offset of the yaw joints in a turn; `null` where turning is not the goal."""


@tabular
class NumberedPace(Pace, GaitNumbers):
    """A gait by its numbers, and how it walks."""


@tabular
class Optimised:
    """A gait that is best by the model, beside the one it is compared with."""

    goal: str
    """What it is best at: `speed`, `cost` or `turning`."""
    gaits: dict[str, NumberedPace]
    """The configured gait as `forward` or, where turning is the goal, `turn_l`, and `optimised`."""


@tabular
class GaitResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "gait"
    body_length_m: float
    """Body length: `--body-length`, or the length of the robot without antennae."""
    frequency_hz: float
    """Gait cycles per second."""
    maneuvers: dict[str, Pace]
    """`forward`, `turn_l`, `turn_r` and `reverse`."""
    wave_off: WaveOff
    """The legs without the body wave."""
    phase_sweep: list[PhasePoint]
    """FORWARD over leads of the body wave."""
    chosen_body_phase_rad: float
    """Lead of the configuration."""
    best_body_phase_rad: float
    """Fastest lead of `phase_sweep`."""
    cost_of_phase: CostOfPhase
    """Speed at other leads than the best one."""
    measured_body_lengths_per_cycle: float | None
    """Body lengths per gait cycle of a real robot, as given by `--measured`; `null` without."""
    unknown: UnknownNumbers | None
    """FORWARD over the unknown numbers; `null` if all are known."""
    optimised: Optimised | None
    """With `--optimise`: the best gait; else `null`."""


def summarise(config: GaitStudyConfig, walks: Mapping[str, Walk]) -> GaitResult:
    """The result of all walks by name."""
    paces = {
        name: measure(walk, config.settling_cycles, config.cycles) for name, walk in walks.items()
    }
    maneuvers = {m.name.lower(): paces[m.name.lower()] for m in MANEUVERS}
    sweep = [
        PhasePoint(
            body_phase_rad=walks[name].gait.body_phase,
            speed_m_s=paces[name].speed_m_s,
            body_lengths_per_cycle=paces[name].body_lengths_per_cycle,
        )
        for name in (f"sweep{i}" for i in range(config.sweep_points))
    ]
    best = max(sweep, key=lambda point: point.speed_m_s)
    worst = min(sweep, key=lambda point: point.speed_m_s)
    return GaitResult(
        body_length_m=config.length,
        frequency_hz=config.gait.frequency,
        maneuvers=maneuvers,
        wave_off=_wave_off(config, paces[WAVE_OFF].speed_m_s),
        phase_sweep=sweep,
        chosen_body_phase_rad=config.gait.body_phase,
        best_body_phase_rad=best.body_phase_rad,
        cost_of_phase=CostOfPhase(
            chosen_over_best=maneuvers["forward"].speed_m_s / best.speed_m_s,
            worst_over_best=worst.speed_m_s / best.speed_m_s,
        ),
        measured_body_lengths_per_cycle=config.measured,
        unknown=_unknown(config, paces) if config.unknown else None,
        optimised=_optimised(config, walks, paces) if OPTIMISED in walks else None,
    )


def _wave_off(config: GaitStudyConfig, speed: float) -> WaveOff:
    rolls = config.robot.legs.kind == "rolling"
    rolling = rolling_speed(config.gait, config.robot) if rolls else None
    ratio = None if rolling is None else speed / rolling
    return WaveOff(speed_m_s=speed, expected_m_s=rolling, ratio=ratio)


def _optimised(
    config: GaitStudyConfig, walks: Mapping[str, Walk], paces: Mapping[str, Pace]
) -> Optimised:
    turning = config.optimise == "turning"
    gaits = {name: walks[name].gait for name in ("turn_l" if turning else "forward", OPTIMISED)}
    return Optimised(
        goal=config.optimise,
        gaits={
            name: NumberedPace(
                amplitude_rad=gait.amplitude,
                wave_number=gait.wave_number,
                body_phase_rad=gait.body_phase,
                turn_offset_rad=gait.turn_offset if turning else None,
                **vars(paces[name]),
            )
            for name, gait in gaits.items()
        },
    )


def _unknown(config: GaitStudyConfig, paces: Mapping[str, Pace]) -> UnknownNumbers:
    lengths = np.array([paces[f"draw{i}"].body_lengths_per_cycle for i in range(config.draws)])
    low, median, high = np.percentile(lengths, [2.5, 50.0, 97.5]).tolist()
    parameters = dict[str, UnknownNumber]()
    for one in config.unknowns:
        lower, upper = (
            paces[f"{one.name}:{end}"].body_lengths_per_cycle for end in ("low", "high")
        )
        parameters[one.name] = UnknownNumber(
            range=(one.low, one.high),
            body_lengths_per_cycle=(lower, upper),
            change=upper - lower,
        )
    return UnknownNumbers(
        draws=len(lengths),
        median=median,
        interval95=(low, high),
        range=(float(lengths.min()), float(lengths.max())),
        body_lengths_per_cycle=lengths.tolist(),
        parameters=parameters,
    )
