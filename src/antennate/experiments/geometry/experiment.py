"""The experiment `geometry`: model against engine, the best lead, speed and cost, the twist map."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from antennate.experiments.gait.physics import rolling_speed
from antennate.experiments.geometry.physics import (
    GeometryConfig,
    Walked,
    columns,
    plan,
    walk,
)
from antennate.experiments.geometry.torus import Torus
from antennate.mechanics.twist import TwistMap, Wave
from antennate.robots.mechanics import cycles, peaks, phase_law
from antennate.studies.experiment import Experiment, OnRow, OnStep, Outcome, no_row, no_step
from antennate.studies.measures import Measure, Table, shown
from antennate.studies.pool import Workers, gather
from antennate.studies.statistics import mean95
from antennate.types import Floats

SPEED_R, SPEED_RMSE, YAW_R, LEAD_DEG = 0.96, 0.02, 0.95, 15.0
"""What the model has to reach, set before the first run: correlations, m/s, and degrees."""
FASTER = 1.15
"""How much faster a gait has to be than the configured one, at no more cost."""
_RESAMPLES = 2000


@dataclass(frozen=True, slots=True)
class GeometryOutcome(Outcome):
    """All gaits by model and engine, and what belongs to the model alone.

    Attributes:
        walked: A row for each gait.
        torus: Motion over body and leg phase, None if legs lift.
        twists: The twist map, None likewise.
        summary: The content of result.json.
    """

    config: GeometryConfig
    walked: list[Walked]
    torus: Torus | None
    twists: TwistMap | None
    summary: dict[str, Any]

    @property
    def rows(self) -> Sequence[Walked]:
        """The gaits, in the order in which they are planned."""
        return self.walked

    def part(self, name: str) -> list[Walked]:
        """The gaits of a part."""
        return _part(self.walked, name)

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return self.summary


def _part(rows: Sequence[Walked], name: str) -> list[Walked]:
    return [row for row in rows if row.part == name]


def summary(config: GeometryConfig, rows: Sequence[Walked], torus: Torus | None) -> dict[str, Any]:
    """The content of result.json."""
    names = dict.fromkeys(row.name for row in _part(rows, "named"))
    named = [_repeated(config, [row for row in rows if row.name == name]) for name in names]
    front = [_numbers(row, config) for row in _part(rows, "front")]
    return {
        "schema": 1,
        "command": "geometry",
        "frequency_hz": config.gait.frequency,
        "body_length_m": config.length,
        "measured_body_lengths_per_cycle": config.measured,
        "agreement": agreement(config, _part(rows, "random")),
        "leads": leads(config, _part(rows, "lead")),
        "named": named,
        "front": front,
        "fastest_at_no_more_cost": _fastest(named[0], [*front, *named[:-1]]),
        "torus": None if torus is None else _torus(config, torus),
        "turns": turns(_part(rows, "turn")),
    }


def _repeated(config: GeometryConfig, rows: Sequence[Walked]) -> dict[str, Any]:
    """A named gait: means over its walks, with their intervals."""
    numbers = [_numbers(row, config) for row in rows]
    middle = dict(numbers[len(rows) // 2])
    for key in ("speed_m_s", "cost_of_transport", "body_lengths_per_cycle"):
        values = np.array([row[key] for row in numbers], float)
        middle[key], middle[f"{key}_95"] = mean95(values)
    return middle


def _numbers(row: Walked, config: GeometryConfig) -> dict[str, Any]:
    values = asdict(row)
    lengths = config.length * row.frequency_hz
    values["body_lengths_per_cycle"] = row.speed_m_s / lengths
    values["model_body_lengths_per_cycle"] = row.model_speed_m_s / lengths
    return values


def _fastest(default: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The fastest gait that costs no more than the default one, and whether that is enough."""
    most = default["cost_of_transport"]
    able = [
        row for row in rows if most is not None and (row["cost_of_transport"] or math.inf) <= most
    ]
    best = max([default, *able], key=lambda row: row["speed_m_s"])
    ratio = best["speed_m_s"] / default["speed_m_s"]
    return {"gait": best, "speed_over_default": ratio, "reached": ratio >= FASTER}


def agreement(config: GeometryConfig, rows: Sequence[Walked]) -> dict[str, Any]:
    """Model against engine on the random gaits, with intervals over gaits, and the rival.

    The rival knows legs that roll on their longest radius, 2 pi f (R + e); where legs lift it knows
    the mean speed of these very gaits.
    """
    speed, model = columns(rows, "speed_m_s", "model_speed_m_s")
    yaw, turn = columns(rows, "yaw_deg_per_cycle", "model_yaw_deg_per_cycle")
    model_cost, cost = columns(rows, "model_cost", "cost_of_transport")
    cost = np.nan_to_num(cost, nan=np.inf)  # it hardly moves
    rolling = rolling_speed(config.gait, config.robot) if config.rolls else float(speed.mean())
    sample = np.random.default_rng(config.seed).integers(len(speed), size=(_RESAMPLES, len(speed)))

    def of(measure: Any, *values: Floats) -> dict[str, Any]:
        drawn = [measure(*(value[rows] for value in values)) for rows in sample]
        low, high = np.nanpercentile(drawn, [2.5, 97.5]).tolist()
        return {"value": measure(*values), "interval95": [low, high]}

    rival = np.full_like(speed, rolling)
    result = {
        "gaits": len(speed),
        "speed_r": of(_correlation, model, speed),
        "speed_rmse_m_s": of(_rmse, model, speed),
        "yaw_r": of(_correlation, turn, yaw),
        "yaw_rmse_deg": of(_rmse, turn, yaw),
        "cost_rank_r": of(_correlation, _ranks(model_cost), _ranks(cost)),
        "rival_speed_m_s": rolling,
        "rival_rmse_m_s": of(_rmse, rival, speed),
        "rival_less_model_m_s": of(lambda a, b, c: _rmse(b, c) - _rmse(a, c), model, rival, speed),
    }
    result["reached"] = {
        "speed_r": result["speed_r"]["value"] >= SPEED_R,
        "speed_rmse_m_s": result["speed_rmse_m_s"]["value"] <= SPEED_RMSE,
        "yaw_r": result["yaw_r"]["value"] >= YAW_R,
        "better_than_rival": result["rival_less_model_m_s"]["interval95"][0] > 0.0,
    }
    return result


def _correlation(a: Floats, b: Floats) -> float:
    a, b = a - a.mean(), b - b.mean()
    return float((a * b).sum() / max(math.sqrt((a**2).sum() * (b**2).sum()), 1e-300))


def _ranks(values: Floats) -> Floats:
    """Rank of each value from 0 on."""
    return values.argsort().argsort().astype(float)


def _rmse(a: Floats, b: Floats) -> float:
    return float(np.sqrt(((a - b) ** 2).mean()))


def leads(config: GeometryConfig, rows: Sequence[Walked]) -> list[dict[str, Any]]:
    """Best lead of each wave number: engine, model, and the law of stiff servos."""
    found = []
    for number in config.wave_numbers:
        some = [row for row in rows if row.wave_number == number]
        lead, speed, model = columns(some, "lead_rad", "speed_m_s", "model_speed_m_s")
        (best, own), (top, _) = peaks(np.stack([lead, lead]), np.stack([speed, model]))
        entry = {
            "wave_number": number,
            "engine_deg": math.degrees(best) % 360.0,
            "model_deg": math.degrees(own) % 360.0,
            "model_less_engine_deg": math.degrees(own - best),
            "engine_speed_m_s": float(top),
            "reached": abs(math.degrees(own - best)) <= LEAD_DEG,
        }
        if config.rolls:
            law = float(phase_law(config.robot.links, number))
            entry |= {
                "law_deg": math.degrees(law),
                "law_less_engine_deg": _apart(law, best),
                "stiff_less_law_deg": _apart(stiff_lead(config, number), law),
            }
        found.append(entry)
    return found


def stiff_lead(config: GeometryConfig, number: float) -> float:
    """Best lead of a small wave on stiff servos [rad]: the first harmonic of speed over lead."""
    lead = np.arange(24) * math.pi / 12
    wave = Wave(0.1, number, lead, 0.0)
    speed = cycles(config.robot, config.gait, wave, stiff=True).step
    return float(np.angle((speed * np.exp(1j * lead)).sum()))


def _apart(first: float, second: float) -> float:
    """Difference of two angles [deg], within half a turn."""
    return math.degrees(math.remainder(first - second, 2.0 * math.pi))


def _torus(config: GeometryConfig, torus: Torus) -> dict[str, Any]:
    """The map over body and leg phase, against cycles of a stiff robot walked as a whole."""
    gait = config.gait
    wave = Wave(gait.amplitude, gait.wave_number, torus.phase, 0.0)
    step = cycles(config.robot, gait, wave, stiff=True).step
    gain = (np.roll(step, -1) - np.roll(step, 1)) / (2.0 * (torus.phase[1] - torus.phase[0]))
    best = float(torus.phase[torus.steps.argmax()])
    return {
        "cells": len(torus.phase),
        "gain_r": _correlation(torus.gains, gain),
        "step_rmse_m": _rmse(torus.steps, step),
        "best_lead_deg": math.degrees(best),
        "law_deg": math.degrees(float(phase_law(config.robot.links, gait.wave_number))),
    }


def turns(rows: Sequence[Walked]) -> dict[str, Any] | None:
    """Twists that were asked of the map, as the engine walks them."""
    if not rows:
        return None
    wanted, speed, bend = columns(rows, "wanted_m_s", "speed_m_s", "wanted_per_m")
    curvature = np.array([row.curvature for row in rows])
    return {
        "turns": len(rows),
        "speed_rmse_m_s": _rmse(speed, wanted),
        "curvature_rmse_per_m": _rmse(curvature, bend),
        "curvature_r": _correlation(curvature, bend) if len(rows) > 1 else None,
        "wanted_per_m": bend.tolist(),
        "curvature_per_m": curvature.tolist(),
        "wanted_m_s": wanted.tolist(),
        "speed_m_s": speed.tolist(),
    }


def run(
    config: GeometryConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> GeometryOutcome:
    """Plan all gaits by the model, and walk each in the engine.

    Raises:
        SimulationError: The physics became invalid; from a worker it comes as a WorkerError.
    """
    plans = plan(config)
    walked = gather(walk, [(config, row) for row in plans.rows], workers, on_step, on_row)
    torus = None
    if config.rolls:
        gait = config.gait
        wave = Wave(gait.amplitude, gait.wave_number, gait.body_phase, 0.0)
        torus = Torus.of(config.robot, wave, config.cells)
    result = summary(config, walked, torus)
    return GeometryOutcome(config, walked, torus, plans.twists, result)


GAIT = (
    Measure("amplitude_rad", "amplitude", "deg", form=".1f", scale=math.degrees(1.0)),
    Measure("wave_number", "wave number"),
    Measure("lead_rad", "lead", "deg", form=".0f", scale=math.degrees(1.0)),
    Measure("speed_m_s", "speed", "m/s", form=".3f", interval="speed_m_s_95"),
    Measure("model_speed_m_s", "  by the model", "m/s", form=".3f"),
    Measure("body_lengths_per_cycle", "body lengths a cycle"),
    Measure("model_body_lengths_per_cycle", "  by the model"),
    Measure("cost_of_transport", "cost of transport", form=".3f", interval="cost_of_transport_95"),
    Measure("model_cost", "  friction alone, model", form=".3f"),
    Measure("model_torque_n_m", "torque of a yaw servo, model", "N·m"),
)
_LEAD = (
    Measure("engine_deg", "engine", "deg", form=".0f"),
    Measure("model_deg", "model", "deg", form=".0f"),
    Measure("law_deg", "law of stiff servos", "deg", form=".0f"),
    Measure("model_less_engine_deg", "model less engine", "deg", form="+.1f"),
    Measure("law_less_engine_deg", "law less engine", "deg", form="+.1f"),
    Measure("stiff_less_law_deg", "model on stiff servos less law", "deg", form="+.2f"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """Model against engine, best leads, and the gaits that matter."""
    named = {row["name"]: row for row in result["named"]}
    best = result["fastest_at_no_more_cost"]
    if not any(best["gait"]["trial"] == row["trial"] and row["name"] for row in result["named"]):
        named["of the front"] = best["gait"]
    word = "reached" if best["reached"] else "not reached"
    note = (
        f"At its frequency, the fastest gait that costs no more than the first walks at "
        f"{best['speed_over_default']:.2f} of its speed ({FASTER:g} was the aim: {word})."
    )
    if (measured := result["measured_body_lengths_per_cycle"]) is not None:
        note += f"\nMeasured on a robot: {measured:g} body lengths a cycle."
    lead_rows = {f"{row['wave_number']:g}": row for row in result["leads"]}
    gaits = Table.of("Gaits", named, GAIT, note)
    return (
        _agreement_table(result["agreement"]),
        Table.of("Best lead, over wave numbers", lead_rows, _LEAD, "Differences are of degrees."),
        gaits,
        *_turn_tables(result["turns"]),
    )


def _agreement_table(entry: Mapping[str, Any]) -> Table:
    lines = [
        ("speed, correlation", "speed_r", f"at least {SPEED_R:g}", ".3f"),
        ("speed, rms difference [m/s]", "speed_rmse_m_s", f"at most {SPEED_RMSE:g}", ".4f"),
        ("  of the rival", "rival_rmse_m_s", "", ".4f"),
        ("  rival less model", "rival_less_model_m_s", "above 0", ".4f"),
        ("yaw, correlation", "yaw_r", f"at least {YAW_R:g}", ".3f"),
        ("yaw, rms difference [deg a cycle]", "yaw_rmse_deg", "", ".1f"),
        ("cost of transport, rank correlation", "cost_rank_r", "", ".2f"),
    ]
    rows = [
        (
            label,
            [shown(entry[k]["value"], form), shown(entry[k]["interval95"], form), aim],
        )
        for label, k, aim, form in lines
    ]
    note = (
        f"{entry['gaits']} random gaits; intervals by bootstrap over gaits.\n"
        f"The rival is the constant {entry['rival_speed_m_s']:.3f} m/s."
    )
    return Table("Model against engine", ("value", "95 %", "aim"), rows, note)


def _turn_tables(entry: Mapping[str, Any] | None) -> Sequence[Table]:
    if entry is None:
        return ()
    pairs = zip(
        entry["wanted_m_s"],
        entry["speed_m_s"],
        entry["wanted_per_m"],
        entry["curvature_per_m"],
        strict=True,
    )
    rows = [(str(i), [f"{x:z.2f}" for x in numbers]) for i, numbers in enumerate(pairs)]
    note = (
        f"Rms differences {entry['speed_rmse_m_s']:.3f} m/s and "
        f"{entry['curvature_rmse_per_m']:.2f} 1/m."
    )
    heads = ("wanted [m/s]", "walked", "wanted [1/m]", "walked")
    return (Table("Twists of the map", heads, rows, note),)


def sentence(result: Mapping[str, Any]) -> str:
    """How well the model foretells the engine, and what it found."""
    entry, best = result["agreement"], result["fastest_at_no_more_cost"]
    worst = max(abs(row["model_less_engine_deg"]) for row in result["leads"])
    speed, yaw = entry["speed_rmse_m_s"]["value"], entry["yaw_rmse_deg"]["value"]
    return (
        f"On {entry['gaits']} random gaits the model foretells the speed of the engine within "
        f"{speed:.3f} m/s (r {entry['speed_r']['value']:.3f}), its yaw within {yaw:.1f} deg a "
        f"cycle (r {entry['yaw_r']['value']:.3f}) and its best lead within {worst:.0f} deg; the "
        f"fastest gait at no more cost walks at {best['speed_over_default']:.2f} of the speed of "
        "the configured one."
    )


EXPERIMENT = Experiment.of_folder(
    *(__name__, GeometryConfig, run, tables, sentence),
    parts="walks",
    captions={
        "agreement": "Speed and yaw of random gaits by the model, against those by the engine.",
        "leads": "The best lead over wave numbers: engine, model, and the law of stiff servos.",
        "front": "Speed and cost of transport, with the configured gait and named ones.",
        "torus": "Curvature over body and leg phase, with the loops of two leads.",
        "twists": "The twist map: amplitude and offset over speed and curvature, and walked turns.",
        "swimmer": "Beside it: the curvature of Purcell's swimmer, with its best strokes.",
    },
    explained="docs/results.md",
)
