"""Springs, taper, sensor and ring-down of an antenna, worked out or simulated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from antennate.antenna import sensor, springs
from antennate.antenna.dynamics import LinearChain, Mode, fitted_mode
from antennate.antenna.statics import Chain, largest_force, pushed_at_tip, shape
from antennate.errors import ConfigError
from antennate.experiments.antenna.config import AntennaConfig
from antennate.experiments.antenna.result import (
    Bending,
    Ladder,
    Point,
    Pushed,
    Ringdown,
    Sensor,
    Spring,
    Springs,
    Swing,
    Taper,
    WoundSet,
)
from antennate.params.base import read_file
from antennate.robots.antenna import N_MM_PER_DEG
from antennate.robots.spec import RobotSpec
from antennate.sim.bench import Bench, compile_bench
from antennate.types import Floats

PAPER_TABLE = {3.0: 0.274, 6.0: 0.137, 9.0: 0.091}
"""Stiffness by active coils as printed in the paper [N·mm/deg]."""
E24 = (
    *(1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0),
    *(3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 7.5, 8.2, 9.1),
)
"""Resistors to be had in each decade (IEC 60063, series E24)."""
ANIMAL_CYCLE = 0.05
"""Cycle in which a cockroach's antenna loses over 90 % of a deflection [s] (Mongeau 2014)."""


class Readings(NamedTuple):
    """What the sensor reads.

    Attributes:
        loop: Bend [rad] and reading without noise [counts] over one loop after one, shape (k, 2).
        hold: Time [s], reading [counts] with noise and without, bend held from 0 on, shape (m, 3).
        resistors: Resistors tried [Ohm], shape (r,).
        spread: Spread of the readings with each [counts], shape (r,).
    """

    loop: Floats
    hold: Floats
    resistors: Floats
    spread: Floats


class Trace(NamedTuple):
    """The tip of an antenna after it is let go.

    Attributes:
        t: Times [s], shape (m,).
        tip: Sideways place of the tip over that at the start, shape (m,).
    """

    t: Floats
    tip: Floats

    def rejected(self, since: float) -> float:
        """Share of the deflection that the tip has lost for good after a time [s] or at the end."""
        return float(1.0 - abs(self.tip[self.t >= min(since, self.t[-1])]).max())


def springs_of(config: AntennaConfig) -> Springs:
    """Springs of an antenna as they are, one for each count of coils, and sets to wind."""
    for name in ("index_limits", "coil_limits", "ladder_limits"):
        low, high = getattr(config, name)
        if low >= high:
            raise ConfigError(f"{name}: expected the smaller first, found {low:g} and {high:g}")
    wire, (low, high) = config.wire_mm, config.index_limits
    if not low * (1 - 1e-9) <= config.coil_mm / wire <= high * (1 + 1e-9):
        raise ConfigError(
            f"coil_mm: expected {low:g} to {high:g} wire diameters of {wire:g} mm, "
            f"{low * wire:.3g} to {high * wire:.3g} mm, found {config.coil_mm:g}"
        )
    wanted = tuple(k * N_MM_PER_DEG for k in config.wanted_n_mm_per_deg)
    return Springs(
        wire=config.wire.replace("_", " "),
        spring_index=(1e-3 * config.coil_mm) / (1e-3 * wire),
        coil_outer_mm=config.coil_mm + wire,
        hinge_distance_mm=1e3 * config.antenna.link_length,
        springs=[_spring(config, coils) for coils in sorted({*config.antenna.active_coils})],
        wanted_n_mm_per_deg=list(config.wanted_n_mm_per_deg),
        windings=[
            WoundSet(
                wire_mm=1e3 * winding.wire,
                coil_mm=1e3 * winding.coil,
                mandrel_mm=1e3 * (winding.coil - winding.wire),
                spring_index=winding.index,
                active_coils=list(winding.coils),
                stiffness_n_mm_per_deg=[k / N_MM_PER_DEG for k in winding.stiffness],
                largest_error=winding.error,
                yield_angle_deg=math.degrees(winding.yield_angle),
                body_length_mm=1e3 * winding.length,
            )
            for winding in springs.windings(config, wanted)
        ],
    )


def _spring(config: AntennaConfig, coils: float) -> Spring:
    wire, coil = 1e-3 * config.wire_mm, 1e-3 * config.coil_mm
    k = springs.spring_stiffness(springs.modulus_of(config), wire, coil, coils)
    return Spring(
        active_coils=coils,
        stiffness_n_mm_per_deg=k / N_MM_PER_DEG,
        stiffness_n_m_per_rad=k,
        paper_n_mm_per_deg=PAPER_TABLE.get(coils),
        angle_deg=config.angle_deg,
        torque_at_angle_n_mm=1e3 * k * math.radians(config.angle_deg),
        yield_angle_deg=math.degrees(springs.yield_angle(config, wire, coil, coils)),
    )


def taper_of(config: AntennaConfig) -> Taper:
    """An animal's taper, the distance of the springs from it, and springs that follow it better."""
    diameters = springs.diameters(config)
    proxy, coils = springs.proxy(diameters), np.array(config.antenna.active_coils)
    stretches = springs.binned(proxy, len(coils))
    animal = stretches / stretches[0]
    return Taper(
        diameters_mm=(1e3 * diameters).tolist(),
        proxy=proxy.tolist(),
        base_over_tip=float(1.0 / proxy[-1]),
        stretches=animal.tolist(),
        stretch_ratio=float(stretches[0] / stretches[-1]),
        ladder=_ladder(coils, animal),
        suggested=_ladder(springs.follow(animal, *config.ladder_limits), animal),
    )


def _ladder(coils: Floats, animal: Floats) -> Ladder:
    """Springs of these coils beside the stretches of the animal, both of shape (m,)."""
    proxy = springs.ladder_proxy(coils)
    return Ladder(
        active_coils=coils.tolist(),
        proxy=proxy.tolist(),
        base_over_tip=float(proxy[0] / proxy[-1]),
        distance_decades=springs.distance_decades(proxy, animal),
    )


def sensor_of(config: AntennaConfig) -> tuple[Sensor, Readings]:
    """The sensor of an antenna, and its readings."""
    params = config.antenna.sensor
    flex = np.linspace(0.0, config.largest_flex, config.points)
    counts = sensor.counts(params, flex)
    if np.ptp(counts) == 0:
        raise ConfigError(
            "antenna.sensor: expected readings that change with bending, found "
            f"{counts[0]:g} counts at every bend; choose another divider"
        )
    resistors = np.array([base * 10.0**d for d in range(2, 7) for base in E24])
    best, spread = sensor.best_divider(params, config.largest_flex, resistors)
    loop, hold = _loop(config), _hold(config)
    ohms = sensor.resistance(params, sensor.sensed_flex(params, flex))
    volts = sensor.divider(params, ohms)
    table = np.stack([np.degrees(flex), ohms, volts, counts], axis=1).tolist()
    found = Sensor(
        kind=params.kind,
        polarity=1 if counts[-1] > counts[0] else -1,
        curve=[
            Point(flex_deg=deg, resistance_ohm=ohm, voltage_v=volt, counts=reading)
            for deg, ohm, volt, reading in table
        ],
        counts_span=float(abs(counts[-1] - counts[0])),
        loop_width_share=_width(loop, config.largest_flex / 2),
        creep_counts=float(abs(hold[-1, 2] - hold[0, 2])),
        noise_sd_counts=float(np.std(hold[:, 1] - hold[:, 2])),
        divider_ohm=params.divider_resistance,
        best_divider_ohm=best,
        best_counts_span=float(spread.max()),
        clipped=bool((volts < sensor.transfer_curve(params)[0][0]).any())
        or bool((counts >= sensor.FULL_SCALE).any()),
    )
    return found, Readings(loop, hold, resistors, spread)


def _width(loop: Floats, middle: float) -> float:
    """Gap of a loop at a bend [rad] over its span of readings."""
    half = len(loop) // 2
    there, back = loop[:half], loop[half:][::-1]
    gap = np.interp(middle, *there.T) - np.interp(middle, *back.T)
    return float(abs(gap) / np.ptp(loop[:, 1]))


def _loop(config: AntennaConfig) -> Floats:
    """The second of two loops from straight to bent and back."""
    params = config.antenna.sensor
    chain = sensor.SensorChain(params, (), 1.0 / params.rate)
    ticks = max(4, 2 * round(config.loop_time * params.rate / 2))
    up = np.linspace(0.0, config.largest_flex, ticks // 2 + 1)
    bends = np.tile(np.concatenate([up[:-1], up[:0:-1]]), 2)
    readings = [float(chain.step(np.array(f))) for f in bends]
    return np.stack([bends, readings], axis=1)[ticks:]


def _hold(config: AntennaConfig) -> Floats:
    params = config.antenna.sensor
    period, ticks = 1.0 / params.rate, max(2, round(config.hold_time * params.rate))
    noise = sensor.reading_noise(params, np.random.default_rng(config.seed), (ticks,))
    noisy, clean = (sensor.SensorChain(params, (), period) for _ in range(2))
    bent = np.array(config.largest_flex)
    rows = [
        (i * period, float(noisy.step(bent, noise[i])), float(clean.step(bent)))
        for i in range(ticks)
    ]
    return np.array(rows)


def bending_of(config: AntennaConfig) -> Bending:
    """The antenna under forces on its tip, and the largest ones that it bears."""
    antenna, chain = config.antenna, Chain.of(config.antenna)
    wire, coil = 1e-3 * config.wire_mm, 1e-3 * config.coil_mm
    yields = np.array([springs.yield_angle(config, wire, coil, n) for n in antenna.active_coils])
    limits = np.minimum(yields, antenna.range)
    bearable = largest_force(chain, math.radians(config.angle_deg))
    sound = largest_force(chain, limits)
    forces = np.linspace(0.0, sound, config.points)
    angles = pushed_at_tip(chain, forces).angles
    tip = shape(chain, angles)[:, -1, 1]
    reached = abs(angles[-1]) / limits
    first = int(np.argmax(reached))
    unstable = reached[first] < 1.0 - 1e-6
    flex = angles[:, : antenna.sensed_hinges].sum(axis=1)
    most = abs(angles).max(axis=1)
    counts = sensor.counts(antenna.sensor, flex)
    rows = zip(1e3 * tip, forces, np.degrees(most), np.degrees(flex), counts, strict=True)
    names = ("tip_mm", "force_n", "most_bent_deg", "flex_deg", "counts")
    return Bending(
        curve=[Pushed(**dict(zip(names, map(float, row), strict=True))) for row in rows],
        bearable_n=bearable if bearable < sound * (1.0 - 1e-9) else None,
        angle_deg=config.angle_deg,
        sound_n=sound,
        ends_by="unstable" if unstable else "yield" if yields[first] < antenna.range else "stop",
        ends_at_hinge=None if unstable else first + 1,
    )


def ringdown_of(config: AntennaConfig) -> tuple[Ringdown, Trace]:
    """The ring-down of an antenna, its modes, and the path of its tip."""
    others = {
        title: read_file(Path(file), RobotSpec).antenna
        for title, file in _titled(config.beside).items()
    }
    chain = LinearChain.of(config.antenna)
    trace, engine = _let_go(config)
    found = Ringdown(
        engine=_swing(engine),
        chain=_swing(chain.first_mode()),
        rejected=trace.rejected(engine.cycle),
        rejected_in_animal_cycle=trace.rejected(ANIMAL_CYCLE),
        modes=[_swing(each) for each in chain.modes()],
        beside={name: _swing(LinearChain.of(other).first_mode()) for name, other in others.items()},
    )
    return found, trace


def _titled(files: Sequence[str]) -> dict[str, str]:
    """Different files by their names in words, or as given where two would have the same name."""
    files = [*dict.fromkeys(files)]
    titles = [Path(file).stem.replace("_", " ") for file in files]
    return {
        file if titles.count(title) > 1 else title: file
        for title, file in zip(titles, files, strict=True)
    }


def _swing(mode: Mode) -> Swing:
    return Swing(
        natural_hz=mode.natural_hz,
        swing_hz=mode.swing_hz,
        damping=mode.damping,
        cycle_s=mode.cycle,
    )


def _let_go(config: AntennaConfig) -> tuple[Trace, Mode]:
    """The path of the tip in the engine, bent before as by a load on it, and its first mode."""
    antenna, timestep = config.antenna, config.physics.timestep
    chain = LinearChain.of(antenna)
    mode = chain.first_mode()
    bench = Bench(compile_bench(config.physics, antenna), antenna)
    bench.place(0.0, 0.0, 0.0)
    bench.bend(config.deflection * chain.pushed_at_tip())
    ticks = math.ceil(max(config.cycles * mode.cycle, 1.2 * ANIMAL_CYCLE) / timestep)
    angles, speeds = np.empty((2, ticks + 1, antenna.hinges + 1))
    tip = np.empty(ticks + 1)
    for tick in range(ticks + 1):
        angles[tick], speeds[tick] = bench.chain()
        tip[tick] = bench.tip()[1]
        bench.step(1)
    t = np.linspace(0.0, ticks * timestep, ticks + 1)
    return Trace(t, tip / tip[0]), fitted_mode(mode, t, angles, speeds)
