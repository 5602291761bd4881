"""What the paper says of gait and tunnel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antennate.experiments.reproduce.verdict import (
    Bar,
    Claim,
    Finding,
    Verdict,
    above,
    agrees,
    claim,
    counted,
    judged,
    share_of,
)
from antennate.studies.statistics import wilson95

_NEAR_POINTS = 15.0
"""Distance from the paper's share of robots that cross [points] that agrees with it."""
_ALL = 95.0
"""Share of robots from which all of them count as crossing [%]."""


@claim(
    "gait",
    "m/s",
    "walks",
    "Conditional if it walks forward, and faster than on the legs alone; no more, as the lead "
    "of the wave is ours.",
)
def forward(result: Mapping[str, Any]) -> Finding:
    """A body wave from head to tail with stepping legs walks forward."""
    speed, alone = result["maneuvers"]["forward"]["speed_m_s"], result["wave_off"]["speed_m_s"]
    return Finding(
        f"{speed:.3f} m/s with the body wave, {alone:.3f} m/s without",
        judged(False, speed > alone > 0),
        "The lead of the body wave over the legs is ours: the paper gives none, and the worst lead "
        f"walks at {100 * result['cost_of_phase']['worst_over_best']:.0f} % of the best speed.",
        (Bar("legs alone", alone), Bar("with the body wave", speed)),
    )


@claim(
    "gait",
    "deg a cycle",
    "turns to both sides",
    "Conditional if it turns by more than 5° a cycle to either side; no more, as the offset is "
    "ours.",
)
def turns(result: Mapping[str, Any]) -> Finding:
    """An offset of the body wave turns the robot."""
    left, right = (result["maneuvers"][n]["yaw_deg_per_cycle"] for n in ("turn_l", "turn_r"))
    return Finding(
        f"{left:+.0f}° and {right:+.0f}° a cycle",
        judged(False, left > 5 and right < -5),
        "The size of the offset is unpublished; ours is assumed.",
        (Bar("ours, turn left", left), Bar("ours, turn right", right)),
    )


@claim(
    "gait",
    "m/s",
    "reverses",
    "Conditional if it walks backwards; no more, as we reverse body and legs.",
)
def reverse(result: Mapping[str, Any]) -> Finding:
    """The body wave run backwards reverses the robot."""
    forward, back = (result["maneuvers"][n]["speed_m_s"] for n in ("forward", "reverse"))
    return Finding(
        f"{back:+.3f} m/s",
        judged(False, back < 0),
        "If the legs run backwards with the wave: to reverse the body wave alone does not turn the "
        "direction of rolling legs.",
        (Bar("ours, forward", forward), Bar("ours, reverse", back)),
    )


def _of_ten(successes: int) -> Bar:
    """The paper's share [%]."""
    low, high = wilson95(successes, 10)
    return Bar("paper", 10.0 * successes, (100 * low, 100 * high))


@claim(
    "tunnel",
    "% of trials",
    "6 of 10",
    "Conditional if our share is within 15 points of 60 %; no more, as we chose the corner for "
    "it. Undecided if its interval reaches that and is wider than 30 points.",
)
def blind(result: Mapping[str, Any]) -> Finding:
    """Without feedback 6 of 10 robots cross the tunnel."""
    row = result["controllers"]["open"]
    share, interval = share_of(row)
    return Finding(
        f"{counted(row)}",
        agrees(share, interval, 60.0, _NEAR_POINTS),
        "The corner of 90° was chosen so that a blind robot does about as well as the paper's; "
        "everything else was left as it was.",
        (_of_ten(6), Bar("ours, open", share, interval)),
    )


def _all_cross(share: float, interval: tuple[float, float]) -> Verdict:
    """The verdict on a share of which the paper says all [%]; few trials are undecided."""
    few = interval[1] - interval[0] > 2 * (100.0 - _ALL)
    if interval[1] >= _ALL and (few or share < _ALL):
        return "undecided"
    return judged(False, share >= _ALL)


def _touch(name: str, reason: str) -> Any:
    def judge(result: Mapping[str, Any]) -> Finding:
        row, blind = result["controllers"][name], result["controllers"]["open"]
        share, interval = share_of(row)
        pair = result["paired"][f"open-{name}"]
        better = pair["only_second"] > pair["only_first"] and pair["mcnemar_p"] < 0.05
        return Finding(
            f"{counted(row)}, blind {counted(blind)}, McNemar p {pair['mcnemar_p']:.2g}",
            _all_cross(share, interval),
            reason + ("" if better else " At this number of trials it is not told from blind."),
            (
                _of_ten(10),
                Bar(f"ours, {name}", share, interval),
                Bar("ours, open", *share_of(blind)),
            ),
        )

    return judge


def _speed(name: str, paper: float, reason: str) -> Any:
    def judge(result: Mapping[str, Any]) -> Finding:
        speed = result["controllers"][name]["speed_m_s"] or 0.0
        near = abs(speed - paper) <= 0.2 * paper
        return Finding(
            f"{speed:.3f} m/s",
            judged(False, near),
            reason,
            (Bar("paper", paper), Bar(f"ours, {name}", speed)),
        )

    return judge


@claim(
    "tunnel",
    "s",
    "0.12 against 0.04 m/s",
    "Conditional if the restricted mean time is shorter; no more, as the rule is ours. "
    "Undecided if the 95 % interval of the paired difference reaches 0, or there is none.",
)
def faster(result: Mapping[str, Any]) -> Finding:
    """Feedback makes the robot faster through the tunnel."""
    rows = {name: result["controllers"][name] for name in ("open", "closed")}
    times = {name: row["restricted_mean_time_s"] for name, row in rows.items()}
    speeds = {name: row["speed_m_s"] or 0.0 for name, row in rows.items()}
    ends = result["paired"]["open-closed"]["time_difference_95"]
    shorter = f", {ends[0]:.1f} to {ends[1]:.1f} s shorter" if ends else ""
    return Finding(
        f"restricted mean time {times['closed']:.1f} s with, {times['open']:.1f} s without"
        f"{shorter}",
        above(tuple(ends), 0.0) if ends else "undecided",
        "With our rule for being stuck, and failures counted as the time limit. By the paper's own "
        f"measure, the mean speed over successes, it is {speeds['closed']:.3f} m/s with feedback "
        f"and {speeds['open']:.3f} m/s without; that compares different tunnels, as robots "
        "without feedback fail in the hard ones.",
        tuple(Bar(n, times[n], rows[n]["restricted_mean_time_95"]) for n in times),
    )


ROBOT = (
    forward,
    turns,
    reverse,
    blind,
    Claim(
        "published_rule",
        "With the published rule all robots cross",
        "10 of 10",
        "Conditional if at least 95 % cross by that rule; no more, as its margins and times are "
        "ours. Undecided if the interval of the share reaches 95 %, and fewer cross or it is wider "
        "than 10 points.",
        "tunnel",
        "% of trials",
        _touch(
            "paper",
            "The plain rule alternates between REVERSE and FORWARD in the corner, or turns round "
            "and leaves; its margins and times are unpublished, ours are assumed.",
        ),
    ),
    Claim(
        "feedback",
        "Two antennae are enough to cross the tunnel",
        "10 of 10",
        "Conditional if at least 95 % cross; no more, as the rule is ours. Undecided if the "
        "interval of the share reaches 95 %, and fewer cross or it is wider than 10 points.",
        "tunnel",
        "% of trials",
        _touch(
            "closed",
            "With our rule in place of the published one: it takes readings that repeat from gait "
            "cycle to gait cycle for being stuck.",
        ),
    ),
    Claim(
        "speed",
        "With feedback the robot crosses at 0.12 m/s",
        "0.12 m/s",
        "Conditional if our mean over successes is within 20 %; no more, as the rule is ours.",
        "tunnel",
        "m/s",
        _speed("closed", 0.12, "With our rule; a mean over successes."),
    ),
    Claim(
        "blind_speed",
        "Without feedback the robots that cross do so at 0.04 m/s",
        "0.04 m/s",
        "Conditional if our mean over successes is within 20 %; no more, as we chose the corner.",
        "tunnel",
        "m/s",
        _speed(
            "open",
            0.04,
            "Our blind robots cross at nearly free speed or lock for good; the paper's were slow.",
        ),
    ),
    faster,
)
