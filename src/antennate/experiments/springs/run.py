"""The springs of an antenna: what they are, and how others would be wound."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from antennate.antenna import springs
from antennate.antenna.springs import Winding
from antennate.errors import ConfigError
from antennate.params import SpringParams
from antennate.robots.antenna import N_MM_PER_DEG
from antennate.studies.experiment import Outcome

PAPER_TABLE = {3.0: 0.274, 6.0: 0.137, 9.0: 0.091}
"""Stiffness by active coils as printed in the paper [N·mm/deg]."""
PAPER_DIGITS = 3
"""Decimals of that table."""


@dataclass(frozen=True)
class SpringsOutcome(Outcome):
    """The springs as they are, and sets that could be wound.

    Attributes:
        config: What was asked.
        windings: The best set of each stock wire, the smallest error first.
    """

    config: SpringParams
    windings: list[Winding]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        config = self.config
        wire, coil = 1e-3 * config.wire_mm, 1e-3 * config.coil_mm
        return {
            "schema": 1,
            "command": "springs",
            "wire": config.wire,
            "modulus_pa": springs.modulus_of(config),
            "wire_mm": config.wire_mm,
            "coil_mm": config.coil_mm,
            "spring_index": coil / wire,
            "springs": [_spring(config, wire, coil, coils) for coils in config.active_coils],
            "wanted_n_mm_per_deg": list(config.wanted_n_mm_per_deg),
            "windings": [_winding(winding) for winding in self.windings],
        }


def _spring(config: SpringParams, wire: float, coil: float, coils: float) -> dict[str, Any]:
    k = springs.spring_stiffness(springs.modulus_of(config), wire, coil, coils)
    yields = springs.yield_angle(config, wire, coil, coils)
    printed = PAPER_TABLE.get(coils)
    return {
        "active_coils": coils,
        "stiffness_n_mm_per_deg": k / N_MM_PER_DEG,
        "stiffness_n_m_per_rad": k,
        "paper_n_mm_per_deg": printed,
        "paper_exact_n_mm_per_deg": None if printed is None else 3 * PAPER_TABLE[3.0] / coils,
        "torque_at_angle_n_mm": 1e3 * k * math.radians(config.angle_deg),
        "yield_angle_deg": math.degrees(yields),
    }


def _winding(winding: Winding) -> dict[str, Any]:
    return {
        "wire_mm": 1e3 * winding.wire,
        "coil_mm": 1e3 * winding.coil,
        "mandrel_mm": 1e3 * (winding.coil - winding.wire),
        "spring_index": winding.index,
        "active_coils": list(winding.coils),
        "stiffness_n_mm_per_deg": [k / N_MM_PER_DEG for k in winding.stiffness],
        "largest_error": winding.error,
        "yield_angle_deg": math.degrees(winding.yield_angle),
        "body_length_mm": 1e3 * winding.length,
    }


def run(config: SpringParams) -> SpringsOutcome:
    """Work out the springs.

    Raises:
        ConfigError: The spring index lies outside its limits, where the law does not hold, or
            limits are the wrong way round.
    """
    for name in ("index_limits", "coil_limits"):
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
    return SpringsOutcome(config, springs.windings(config, wanted))
