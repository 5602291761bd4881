"""What is measured of each controller in the tunnel, and of two on the same trials."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from antennate.experiments.tunnel.physics import Measured, TunnelConfig
from antennate.sim.scenes.registry import TUNNEL
from antennate.sim.scenes.scene import TIME_LIMIT
from antennate.studies import statistics
from antennate.studies.columns import Ends, Frame, column, percent, tabular
from antennate.studies.pooling import by, mean, pooled, total, valid
from antennate.studies.statistics import Outcomes, PairedTest
from antennate.types import Floats


@tabular
class Ended(Outcomes):
    """How the trials of a controller ended."""

    overturned: int | None = column("overturned", form="d", default=None)
    """Robots on their backs, part of the sum of all trials; `null` if there are none."""
    fell: int | None = column("fell", form="d", default=None)
    """Robots that fell, likewise."""
    speed_m_s: float | None = column("speed over successes", "m/s", form=".3f", interval="speed_95")
    """Mean speed over successes, progress over time, and its interval by Student's t."""
    speed_95: Ends | None
    time_over_successes_s: float | None
    """Mean time of a success."""
    progress_per_time_m_s: float | None = column("progress over time", "m/s", form=".3f")
    """Progress of all valid trials over their time, a failure counted as the limit."""
    restricted_mean_time_s: float | None = column(
        "restricted mean time", "s", form=".1f", interval="restricted_mean_time_95"
    )
    """Mean time, a failure counted as the limit; `null` where trials have limits of their own."""
    restricted_mean_time_95: Ends | None
    restricted_mean_share: float | None = percent(
        "restricted mean time", "% of limit", form=".1f", interval="restricted_mean_share_95"
    )
    """Mean time as a share of the limit of each trial, 1 for a failure."""
    restricted_mean_share_95: Ends | None


def _of_time(label: str) -> Any:
    return percent(label, "% of time", mean, form=".1f", least=0.0, most=1.0)


@tabular
class Shares:
    """Shares of the time in each maneuver, means over trials."""

    forward: float | None = _of_time("forward")
    turn_l: float | None = _of_time("turn left")
    turn_r: float | None = _of_time("turn right")
    reverse: float | None = _of_time("reverse")
    hold: float | None = _of_time("hold")


@tabular
class ControllerSummary(Measured, Ended):
    """All trials of a controller."""

    share: Shares = column()
    """Shares of the time in each maneuver."""
    offset_m: float | None = column(
        "off the middle", "m", form=".3f", least=0.0, interval="offset_95"
    )
    """Mean distance from the centre line over successes; `null` in a scene without one."""
    offset_95: Ends | None
    void_decisions: int = 0
    """Decisions of a learned policy whose answer was no number, so that the robot held; of all
    trials, 0 for other controllers."""


@tabular
class Pair(PairedTest):
    """Two controllers on the trials that are valid in both, the first minus the second."""

    share_difference: float | None = percent(
        "difference", "% of limit", form="+.1f", interval="share_difference_95", default=None
    )
    """Mean of restricted time as shares of the limit, in place of `time_difference_s` where trials
    have limits of their own."""
    share_difference_95: Ends | None = None
    offset_difference_m: float | None = column(
        "off the middle", "m", form="+.3f", interval="offset_difference_95"
    )
    """Distance from the centre line, on trials that succeed in both."""
    offset_difference_95: Ends | None


@tabular
class TunnelResult:
    """What a run comes to."""

    schema: int = 2
    command: str = "tunnel"
    seed: int
    scene: str
    """Name of the scene, or its MJCF file."""
    knows: tuple[str, ...] = ()
    """What the simulation gave to the controllers."""
    time_limit_s: float | None
    """Time after which a trial has failed; `null` where each has its own."""
    length_m: float | None
    """Length of the centre line; `null` in a scene that is no tunnel."""
    interrupted: bool = False
    controllers: dict[str, ControllerSummary]
    """Each controller, by name; with other readings than its own as `closed@yoked`."""
    paired: dict[str, Pair]
    """Every two controllers, as `first-second`."""

    @property
    def failed(self) -> bool:
        """Whether every trial of some controller is invalid."""
        return any(0 < each.trials == each.invalid for each in self.controllers.values())


def summarise(config: TunnelConfig, rows: Frame) -> TunnelResult:
    """The result of the rows of a run."""
    limit = limit_of(rows, config.time_limit)
    by_name = by(rows, "controller", config.conditions)
    return TunnelResult(
        seed=config.seed,
        scene=config.scene,
        knows=config.knows,
        time_limit_s=limit,
        length_m=config.tunnel.length if config.scene == TUNNEL else None,
        controllers={name: summary(some, limit) for name, some in by_name.items()},
        paired=paired(by_name, limit),
    )


def limit_of(rows: Frame, wanted: float | None) -> float | None:
    """The time limit that all valid trials share [s], None where each has its own."""
    limits = set(valid(rows)["limit_s"].tolist()) or {TIME_LIMIT}
    return wanted or (limits.pop() if len(limits) == 1 else None)


def summary(rows: Frame, limit: float | None) -> ControllerSummary:
    """One controller in numbers; invalid trials are counted and left out of all others.

    The restricted mean time lies between 0 and the time limit [s], and so does its interval; it is
    None where trials have limits of their own. The mean share of the limits is there always.
    """
    sound = valid(rows)
    won = sound[sound["outcome"] == "success"]
    times, limits = sound["time_s"].to_numpy(float), sound["limit_s"].to_numpy(float)
    progress = sum(sound["progress_m"].tolist())
    speed, speeds = statistics.mean95((won["progress_m"] / won["time_s"]).to_numpy(float), 0.0)
    offset, offsets = statistics.mean95(won["offset_m"].to_numpy(float), 0.0)
    mean_share, share_ends = statistics.mean95(times / limits, 0.0, 1.0, restricted=True)
    seconds, ends = None, None
    if limit is not None:
        seconds, ends = statistics.mean95(times, 0.0, limit, restricted=True)
    return pooled(
        ControllerSummary,
        rows,
        **{n: k for n in ("overturned", "fell") if (k := int((sound["outcome"] == n).sum()))},
        void_decisions=total(rows, "void_decisions"),
        speed_m_s=speed if len(won) else None,
        speed_95=speeds,
        time_over_successes_s=mean(won, "time_s"),
        progress_per_time_m_s=progress / float(times.sum()) if len(sound) else None,
        restricted_mean_time_s=seconds if len(sound) else None,
        restricted_mean_time_95=ends,
        restricted_mean_share=mean_share if len(sound) else None,
        restricted_mean_share_95=share_ends,
        **_known("offset", "m", offset, offsets),
    )


def _known(name: str, unit: str, value: float, ends: Ends | None) -> dict[str, Any]:
    """A number and its interval by name, None where it is not known."""
    known = math.isfinite(value)
    return {f"{name}_{unit}": value if known else None, f"{name}_95": ends if known else None}


def paired(by_controller: Mapping[str, Frame], limit: float | None) -> dict[str, Pair]:
    """Every two controllers on the trials that are valid in both, with the time limit [s].

    Where there is none of all, the times that are compared are shares of the limit of each trial.
    """
    tests: dict[str, Pair] = {}
    for first, second in combinations(by_controller, 2):
        one, two = (valid(by_controller[name]).set_index("trial") for name in (first, second))
        both = sorted(set(one.index) & set(two.index))
        if both:
            tests[f"{first}-{second}"] = _pair(one.loc[both], two.loc[both], limit)
    return tests


def _pair(first: Frame, second: Frame, limit: float | None) -> Pair:
    won = np.array([(rows["outcome"] == "success").to_numpy() for rows in (first, second)])
    times: Floats = np.array([rows["time_s"].to_numpy(float) for rows in (first, second)])
    units = first["limit_s"].to_numpy(float) if limit is None else 1.0
    one, two = times / units
    test = statistics.compare(won[0], won[1], one, two, limit or 1.0)
    found = vars(test)
    if limit is None:
        difference, ends = test.time_difference_s, test.time_difference_95
        means = times[:, won.all(axis=0)].mean(axis=1).tolist() if test.both else None
        found = {**found, "share_difference": difference, "share_difference_95": ends}
        found |= {"time_difference_s": None, "time_difference_95": None}
        found |= {"both_time_s": means and tuple(means)}
    apart = (first["offset_m"] - second["offset_m"]).to_numpy(float)
    offset = statistics.mean95(apart[won.all(axis=0)])
    return Pair(**found, **_known("offset_difference", "m", *offset))
