"""A day with faults at realistic rates; K1 is a row of a fault table."""

from __future__ import annotations

import gc
import sys
from pathlib import Path

import numpy as np
import pytest
from hardware_rig import LIMIT, PERIOD
from soak_rig import SHORTEST, Soak, schedule

OLDEST = LIMIT + PERIOD + SHORTEST + 0.002
"""Oldest sample that is acted upon [s]. Ages are known to be within the limit, but the host looks
for samples once a period: how long they wait for it and the shortest delay of the wire cannot be
seen. 2 ms are the error of ages (E6)."""


@pytest.mark.ci
def test_K1_faults_in_quick_succession_are_all_seen_and_no_hold_is_without_one() -> None:
    events = schedule(np.random.default_rng(1), hours=2, hour=150.0, apart=20.0)
    soak = Soak(events)
    soak.run(300.0)
    assert len(events) == soak.seen == 9
    assert soak.oldest <= OLDEST
    assert soak.share_of_motion > 0.7


@pytest.mark.slow
def test_K1_a_day_of_faults() -> None:
    """8 640 000 samples; memory may grow by less than 1 MB after the first hour."""
    events = schedule(np.random.default_rng(2), hours=24, hour=3600.0, apart=120.0)
    soak = Soak(events)
    soak.run(3600.0)
    gc.collect()
    before = soak.memory if Path("/proc/self/statm").exists() else None
    soak.run(86_400.0)
    gc.collect()
    grown = 0 if before is None else soak.memory - before
    assert len(events) == soak.seen == 24 * 4 + 12
    assert soak.oldest <= OLDEST
    assert soak.share_of_motion > 0.99
    assert grown < 1_000_000
    sys.stdout.write(
        f"{soak.seen} faults seen, {soak.holds} ticks held, oldest sample {1e3 * soak.oldest:.1f} "
        f"ms, moved in {100 * soak.share_of_motion:.2f} % of ticks, {grown} bytes grown\n"
    )
