"""The experiment `geometry`: model against engine, the best lead, speed and cost, the twist map."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from antennate.robots.mechanics import cycles, peaks, phase_law, wave_of
from antennate.studies.columns import Frame, shown
from antennate.studies.experiment import Done, Experiment
from antennate.studies.pool import Workers, gather
from antennate.studies.pooling import by, frame
from antennate.studies.statistics import mean95
from antennate.studies.tables import Table
from antennate.studies.trials import OnRow, OnStep, no_row, no_step
from antennate.types import Floats
from antennate_lab.gait.physics import rolling_speed
from antennate_lab.geometry.physics import GeometryConfig, plan, walk
from antennate_lab.geometry.result import (
    Agreement,
    AimsReached,
    BestLead,
    Estimate,
    Fastest,
    Gait,
    GeometryResult,
    NamedGait,
    TorusFit,
    Turns,
    Walked,
)
from antennate_lab.geometry.torus import Torus
from geometric_locomotion.twist import TwistMap, Wave

SPEED_R, SPEED_RMSE, YAW_R, LEAD_DEG = 0.96, 0.02, 0.95, 15.0
"""What the model has to reach, set before the first run: correlations, m/s, and degrees."""
FASTER = 1.15
"""How much faster a gait has to be than the configured one, at no more cost."""
_RESAMPLES = 2000


@dataclass(frozen=True)
class GeometryOutcome(Done):
    """All gaits by model and engine, what they come to, and what belongs to the model alone.

    Attributes:
        torus: Motion over body and leg phase, None if legs lift.
        twists: The twist map, None likewise.
    """

    config: GeometryConfig
    torus: Torus | None
    twists: TwistMap | None


def summarise(
    config: GeometryConfig, rows: Sequence[Walked], torus: Torus | None
) -> GeometryResult:
    """The result of the gaits of a run."""
    parts = by(frame(rows, Walked), "part", ("random", "lead", "turn"))
    names = dict.fromkeys(row.name for row in rows if row.name)
    named = [_repeated(config, rows, name) for name in names]
    front = [_gait(config, row) for row in rows if row.part == "front"]
    return GeometryResult(
        frequency_hz=config.gait.frequency,
        body_length_m=config.length,
        measured_body_lengths_per_cycle=config.measured,
        agreement=agreement(config, parts["random"]),
        leads=[_lead(config, parts["lead"], number) for number in config.wave_numbers],
        named=named,
        front=front,
        fastest_at_no_more_cost=_fastest(named[0], [*front, *named[:-1]]),
        torus=None if torus is None else _torus(config, torus),
        turns=_turns(parts["turn"]),
    )


def _gait(config: GeometryConfig, row: Walked) -> Gait:
    length = config.length * row.frequency_hz
    return Gait(
        **vars(row),
        body_lengths_per_cycle=row.speed_m_s / length,
        model_body_lengths_per_cycle=row.model_speed_m_s / length,
    )


def _repeated(config: GeometryConfig, rows: Sequence[Walked], name: str) -> NamedGait:
    """A named gait: means over its walks, with their intervals."""
    walks = [_gait(config, row) for row in rows if row.name == name]
    many = frame(walks)
    speed, speed_95 = mean95(many.speed_m_s.to_numpy())
    lengths, lengths_95 = mean95(many.body_lengths_per_cycle.to_numpy())
    cost, cost_95 = mean95(many.cost_of_transport.to_numpy(float))
    moves = math.isfinite(cost)  # in every walk
    middle = replace(
        walks[len(walks) // 2],
        speed_m_s=speed,
        body_lengths_per_cycle=lengths,
        cost_of_transport=cost if moves else None,
    )
    return NamedGait(
        **vars(middle),
        speed_m_s_95=speed_95,
        body_lengths_per_cycle_95=lengths_95,
        cost_of_transport_95=cost_95 if moves else None,
    )


def _fastest(default: Gait, gaits: Sequence[Gait]) -> Fastest:
    """The fastest gait that costs no more than the default one, and whether that is enough."""
    most = default.cost_of_transport
    able = [
        gait for gait in gaits if most is not None and (gait.cost_of_transport or math.inf) <= most
    ]
    best = max([default, *able], key=lambda gait: gait.speed_m_s)
    ratio = best.speed_m_s / default.speed_m_s
    return Fastest(gait=best, speed_over_default=ratio, reached=ratio >= FASTER)


def agreement(config: GeometryConfig, rows: Frame) -> Agreement:
    """Model against engine on the random gaits, with intervals over gaits, and the rival.

    The rival knows legs that roll on their longest radius, 2 pi f (R + e); where legs lift it knows
    the mean speed of these very gaits.
    """
    speed, model = rows.speed_m_s.to_numpy(), rows.model_speed_m_s.to_numpy()
    yaw, turn = rows.yaw_deg_per_cycle.to_numpy(), rows.model_yaw_deg_per_cycle.to_numpy()
    cost = np.nan_to_num(rows.cost_of_transport.to_numpy(float), nan=np.inf)  # it hardly moves
    rolling = rolling_speed(config.gait, config.robot) if config.rolls else float(speed.mean())
    sample = np.random.default_rng(config.seed).integers(len(speed), size=(_RESAMPLES, len(speed)))

    def of(measure: Callable[..., float], *values: Floats) -> Estimate:
        drawn = [measure(*(value[rows] for value in values)) for rows in sample]
        low, high = np.nanpercentile(drawn, [2.5, 97.5]).tolist()
        return Estimate(value=measure(*values), interval95=(low, high))

    rival = np.full_like(speed, rolling)
    speed_r, speed_rmse = of(_correlation, model, speed), of(_rmse, model, speed)
    yaw_r = of(_correlation, turn, yaw)
    less = of(lambda a, b, c: _rmse(b, c) - _rmse(a, c), model, rival, speed)
    return Agreement(
        gaits=len(speed),
        speed_r=speed_r,
        speed_rmse_m_s=speed_rmse,
        yaw_r=yaw_r,
        yaw_rmse_deg=of(_rmse, turn, yaw),
        cost_rank_r=of(_correlation, _ranks(rows.model_cost.to_numpy()), _ranks(cost)),
        rival_speed_m_s=rolling,
        rival_rmse_m_s=of(_rmse, rival, speed),
        rival_less_model_m_s=less,
        reached=AimsReached(
            speed_r=speed_r.value >= SPEED_R,
            speed_rmse_m_s=speed_rmse.value <= SPEED_RMSE,
            yaw_r=yaw_r.value >= YAW_R,
            better_than_rival=less.interval95[0] > 0.0,
        ),
    )


def _correlation(a: Floats, b: Floats) -> float:
    a, b = a - a.mean(), b - b.mean()
    return float((a * b).sum() / max(math.sqrt((a**2).sum() * (b**2).sum()), 1e-300))


def _ranks(values: Floats) -> Floats:
    """Rank of each value from 0 on."""
    return values.argsort().argsort().astype(float)


def _rmse(a: Floats, b: Floats) -> float:
    return float(np.sqrt(((a - b) ** 2).mean()))


def _lead(config: GeometryConfig, rows: Frame, number: float) -> BestLead:
    """Best lead of a wave number: engine, model, and the law of stiff servos."""
    some = rows[rows.wave_number == number]
    lead, speed, model = some[["lead_rad", "speed_m_s", "model_speed_m_s"]].to_numpy().T
    (best, own), (top, _) = peaks(np.stack([lead, lead]), np.stack([speed, model]))
    law = float(phase_law(config.robot.links, number)) if config.rolls else None
    return BestLead(
        wave_number=number,
        engine_deg=math.degrees(best) % 360.0,
        model_deg=math.degrees(own) % 360.0,
        law_deg=None if law is None else math.degrees(law),
        model_less_engine_deg=math.degrees(own - best),
        law_less_engine_deg=None if law is None else _apart(law, best),
        stiff_less_law_deg=None if law is None else _apart(stiff_lead(config, number), law),
        engine_speed_m_s=float(top),
        reached=abs(math.degrees(own - best)) <= LEAD_DEG,
    )


def stiff_lead(config: GeometryConfig, number: float) -> float:
    """Best lead of a small wave on stiff servos [rad]: the first harmonic of speed over lead."""
    lead = np.arange(24) * math.pi / 12
    wave = Wave(0.1, number, lead, 0.0)
    speed = cycles(config.robot, config.gait, wave, stiff=True).step
    return float(np.angle((speed * np.exp(1j * lead)).sum()))


def _apart(first: float, second: float) -> float:
    """Difference of two angles [deg], within half a turn."""
    return math.degrees(math.remainder(first - second, 2.0 * math.pi))


def _torus(config: GeometryConfig, torus: Torus) -> TorusFit:
    """The map over body and leg phase, against cycles of a stiff robot walked as a whole."""
    wave = wave_of(config.gait)._replace(lead=torus.phase)
    step = cycles(config.robot, config.gait, wave, stiff=True).step
    gain = (np.roll(step, -1) - np.roll(step, 1)) / (2.0 * (torus.phase[1] - torus.phase[0]))
    return TorusFit(
        cells=len(torus.phase),
        gain_r=_correlation(torus.gains, gain),
        step_rmse_m=_rmse(torus.steps, step),
        best_lead_deg=math.degrees(torus.phase[torus.steps.argmax()]),
        law_deg=math.degrees(float(phase_law(config.robot.links, config.gait.wave_number))),
    )


def _turns(rows: Frame) -> Turns | None:
    """Twists that were asked of the map, as the engine walks them."""
    if rows.empty:
        return None
    speed, bend = rows.speed_m_s.to_numpy(), rows.wanted_per_m.to_numpy(float)
    wanted = rows.wanted_m_s.to_numpy(float)
    yaw = np.radians(rows.yaw_deg_per_cycle.to_numpy())
    curvature = yaw * rows.frequency_hz.to_numpy() / speed
    return Turns(
        turns=len(rows),
        speed_rmse_m_s=_rmse(speed, wanted),
        curvature_rmse_per_m=_rmse(curvature, bend),
        curvature_r=_correlation(curvature, bend) if len(rows) > 1 else None,
        wanted_per_m=bend.tolist(),
        curvature_per_m=curvature.tolist(),
        wanted_m_s=wanted.tolist(),
        speed_m_s=speed.tolist(),
    )


def run(
    config: GeometryConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> GeometryOutcome:
    """Plan all gaits by the model, and walk each in the engine."""
    plans = plan(config)
    walked = gather(walk, [(config, row) for row in plans.rows], workers, on_step, on_row)
    wave = wave_of(config.gait)
    torus = Torus.of(config.robot, wave, config.cells) if config.rolls else None
    return GeometryOutcome(
        rows=walked,
        found=summarise(config, walked, torus),
        config=config,
        torus=torus,
        twists=plans.twists,
    )


def tables(result: GeometryResult) -> Sequence[Table]:
    """Model against engine, best leads, and the gaits that matter."""
    named: dict[str, Gait] = {gait.name: gait for gait in result.named}
    best = result.fastest_at_no_more_cost
    if not best.gait.name:
        named["of the front"] = best.gait
    word = "reached" if best.reached else "not reached"
    note = (
        f"At its frequency, the fastest gait that costs no more than the first walks at "
        f"{best.speed_over_default:.2f} of its speed ({FASTER:g} was the aim: {word})."
    )
    if (measured := result.measured_body_lengths_per_cycle) is not None:
        note += f"\nMeasured on a robot: {measured:g} body lengths a cycle."
    leads = {f"{lead.wave_number:g}": lead for lead in result.leads}
    return (
        _agreement_table(result.agreement),
        Table.of("Best lead, over wave numbers", leads, note="Differences are of degrees."),
        Table.of("Gaits", named, note=note),
        *_turn_tables(result.turns),
    )


def _agreement_table(found: Agreement) -> Table:
    lines = {
        "speed, correlation": (found.speed_r, ".3f", f"at least {SPEED_R:g}"),
        "speed, rms difference [m/s]": (found.speed_rmse_m_s, ".4f", f"at most {SPEED_RMSE:g}"),
        "  of the rival": (found.rival_rmse_m_s, ".4f", ""),
        "  rival less model": (found.rival_less_model_m_s, ".4f", "above 0"),
        "yaw, correlation": (found.yaw_r, ".3f", f"at least {YAW_R:g}"),
        "yaw, rms difference [deg a cycle]": (found.yaw_rmse_deg, ".1f", ""),
        "cost of transport, rank correlation": (found.cost_rank_r, ".2f", ""),
    }
    rows = [
        (label, [shown(each.value, form), shown(each.interval95, form), aim])
        for label, (each, form, aim) in lines.items()
    ]
    note = (
        f"{found.gaits} random gaits; intervals by bootstrap over gaits.\n"
        f"The rival is the constant {found.rival_speed_m_s:.3f} m/s."
    )
    return Table("Model against engine", ("value", "95 %", "aim"), rows, note)


def _turn_tables(found: Turns | None) -> Sequence[Table]:
    if found is None:
        return ()
    pairs = zip(
        found.wanted_m_s, found.speed_m_s, found.wanted_per_m, found.curvature_per_m, strict=True
    )
    rows = [(str(i), [f"{x:z.2f}" for x in numbers]) for i, numbers in enumerate(pairs)]
    note = (
        f"Rms differences {found.speed_rmse_m_s:.3f} m/s and {found.curvature_rmse_per_m:.2f} 1/m."
    )
    heads = ("wanted [m/s]", "walked", "wanted [1/m]", "walked")
    return (Table("Twists of the map", heads, rows, note),)


def sentence(result: GeometryResult) -> str:
    """How well the model foretells the engine, and what it found."""
    found, best = result.agreement, result.fastest_at_no_more_cost
    worst = max(abs(lead.model_less_engine_deg) for lead in result.leads)
    speed, yaw = found.speed_rmse_m_s.value, found.yaw_rmse_deg.value
    return (
        f"On {found.gaits} random gaits the model foretells the speed of the engine within "
        f"{speed:.3f} m/s (r {found.speed_r.value:.3f}), its yaw within {yaw:.1f} deg a "
        f"cycle (r {found.yaw_r.value:.3f}) and its best lead within {worst:.0f} deg; the "
        f"fastest gait at no more cost walks at {best.speed_over_default:.2f} of the speed of "
        "the configured one."
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    GeometryConfig,
    run,
    tables,
    sentence,
    result=GeometryResult,
    row=Walked,
    captions={
        "agreement": "Speed and yaw of random gaits by the model, against those by the engine.",
        "leads": "The best lead over wave numbers: engine, model, and the law of stiff servos.",
        "front": "Speed and cost of transport, with the configured gait and named ones.",
        "torus": "Curvature over body and leg phase, with the loops of two leads.",
        "twists": "The twist map: amplitude and offset over speed and curvature, and walked turns.",
        "swimmer": "Beside it: the curvature of Purcell's swimmer, with its best strokes.",
    },
)
