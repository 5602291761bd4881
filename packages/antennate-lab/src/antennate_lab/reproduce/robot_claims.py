"""What the paper says of the gait, and of robots in the tunnel.

In the tunnel the rival of touch is a robot that feels nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from antennate.antenna.springs import endurance
from antennate.control.registry import RIVAL
from antennate.params.spring import SpringParams
from antennate.studies.columns import shown
from antennate.studies.statistics import wilson95
from antennate_lab.reproduce.verdict import (
    ENOUGH_TO_STAY,
    Bar,
    Claim,
    Ends,
    Finding,
    above,
    agrees,
    all_of,
    claim,
    counted,
    difference,
    lead,
    share_of,
)

if TYPE_CHECKING:
    from antennate.experiments.tunnel.result import Pair, TunnelResult
    from antennate_lab.gait.result import GaitResult

_OPEN = "open"
_NEAR_POINTS = 15.0
"""Distance from the paper's share of robots that cross [points] that agrees with it."""
_NEAR_SPEED = 0.2
"""Likewise of its speeds, as a share of them."""
_ALL = 95.0
"""Share of robots from which all of them count as crossing [%]."""
_PAPER_SPEED = {"closed": 0.12, _OPEN: 0.04}
"""Mean speed of the paper's robots over those that crossed [m/s]."""
_HALF_LEAD_POINTS = 20.0
"""Half of the lead of touch over none in the paper [points]: 10 against 6 of 10."""
_HALF_LEAD_SPEED = 0.04
"""Half of it in speed [m/s]."""
_BLIND = (
    f"robots that feel nothing: `{RIVAL}`" if RIVAL == _OPEN else f"`{RIVAL}`, which feels nothing"
)
_OURS = "the rule is ours"


@claim(
    "gait",
    "m/s",
    paper="walks",
    criterion="It walks forward, and faster than the rival",
    rival="the legs alone, without the body wave",
    ceiling="the lead of the wave over the legs is ours",
)
def forward(result: GaitResult) -> Finding:
    """A body wave from head to tail with stepping legs walks forward."""
    speed, alone = result.maneuvers["forward"].speed_m_s, result.wave_off.speed_m_s
    return Finding(
        f"{speed:.3f} m/s with the body wave, {alone:.3f} m/s without",
        speed > alone > 0,
        "The paper gives no lead of the body wave over the legs, and the worst lead walks at "
        f"{100 * result.cost_of_phase.worst_over_best:.0f} % of the best speed.",
        (Bar("legs alone", alone), Bar("with the body wave", speed)),
    )


@claim(
    "gait",
    "deg a cycle",
    paper="turns to both sides",
    criterion="It turns by more than 5° a cycle to either side",
    rival="no offset, which walks straight",
    ceiling="the offset is ours",
)
def turns(result: GaitResult) -> Finding:
    """An offset of the body wave turns the robot."""
    left, right = (result.maneuvers[n].yaw_deg_per_cycle for n in ("turn_l", "turn_r"))
    return Finding(
        f"{left:+.0f}° and {right:+.0f}° a cycle",
        left > 5 and right < -5,
        "The size of the offset is unpublished; ours is assumed.",
        (Bar("ours, turn left", left), Bar("ours, turn right", right)),
    )


@claim(
    "gait",
    "m/s",
    paper="reverses",
    criterion="It walks backwards",
    rival="the body wave alone run backwards, which does not reverse rolling legs",
    ceiling="we reverse body and legs",
)
def reverse(result: GaitResult) -> Finding:
    """The body wave run backwards reverses the robot."""
    forward, back = (result.maneuvers[n].speed_m_s for n in ("forward", "reverse"))
    return Finding(
        f"{back:+.3f} m/s",
        back < 0,
        "If the legs run backwards with the wave.",
        (Bar("ours, forward", forward), Bar("ours, reverse", back)),
    )


def _blinds(result: TunnelResult) -> list[str]:
    """The controllers without touch that a claim is held against: that of the paper, the rival."""
    return [n for n in dict.fromkeys((_OPEN, RIVAL)) if n in result.controllers]


def _pair(result: TunnelResult, ours: str, other: str) -> tuple[Pair | None, bool]:
    """What is told of two controllers on the same trials, and whether ours comes first."""
    first = result.paired.get(f"{ours}-{other}")
    return (first, True) if first else (result.paired.get(f"{other}-{ours}"), False)


def _gain(ends: Ends | None, ours_first: bool) -> Ends | None:
    """95 % interval of the other's number less ours, of that of a difference in `paired`."""
    return (-ends[1], -ends[0]) if ends and ours_first else ends


def _of_ten(successes: int) -> Bar:
    """The paper's share [%]."""
    low, high = wilson95(successes, 10)
    return Bar("paper", 10.0 * successes, (100 * low, 100 * high))


def _all_cross(share: float, interval: Ends) -> bool | None:
    """Whether a share is all of them [%]; few trials decide nothing."""
    few = interval[1] - interval[0] > 2 * (100.0 - _ALL)
    if interval[1] >= _ALL and (few or share < _ALL):
        return None
    return share >= _ALL


@claim(
    "tunnel",
    "% of trials",
    paper="6 of 10",
    criterion=f"Our share is within {_NEAR_POINTS:g} points of 60 %",
    rival="a tunnel that is chosen until it does",
    best="fitted",
    ceiling="the corner of 90° was chosen for this share",
)
def blind(result: TunnelResult) -> Finding:
    """Without feedback 6 of 10 robots cross the tunnel."""
    row = result.controllers[_OPEN]
    share, interval = share_of(row)
    return Finding(
        f"{counted(row)}",
        agrees(share, interval, 60.0, _NEAR_POINTS),
        "",
        (_of_ten(6), Bar("ours, open", share, interval)),
        "At 75° nearly all cross, at 90° as many as in the paper; all else was left as it was.",
    )


def _touch(name: str, text: str, reason: str = "", by_default: str = "") -> Claim:
    """The claim that all robots cross with the controller of this name."""

    def judge(result: TunnelResult) -> Finding:
        rows, blinds = result.controllers, _blinds(result)
        row, pairs = rows[name], [_pair(result, name, other) for other in blinds]
        share, interval = share_of(row)
        others = "".join(
            f"; `{n}` {counted(rows[n])}, McNemar p {pair.mcnemar_p if pair else 1.0:.2g}"
            for n, (pair, _) in zip(blinds, pairs, strict=True)
        )
        leads = [above(lead(*pair), _HALF_LEAD_POINTS) for pair in pairs]
        return Finding(
            f"{counted(row)}{others}",
            all_of(_all_cross(share, interval), *leads),
            reason,
            (
                _of_ten(10),
                Bar(f"ours, {name}", share, interval),
                *(Bar(f"ours, {n}", *share_of(rows[n])) for n in blinds),
            ),
            by_default,
        )

    return Claim(
        {"paper": "published_rule", "closed": "feedback"}[name],
        text,
        "10 of 10",
        f"At least {_ALL:g} % cross, and over {_HALF_LEAD_POINTS:g} points more than each rival on "
        "the same trials (half of the lead in the paper)",
        f"robots without feedback, and {_BLIND}",
        "conditional",
        "its margins and times are ours" if name == "paper" else _OURS,
        "tunnel",
        "% of trials",
        judge,
    )


def _speed(name: str, text: str, ceiling: str, by_default: str) -> Claim:
    """The claim that robots that cross do so at a speed."""
    paper = _PAPER_SPEED[name]

    def judge(result: TunnelResult) -> Finding:
        rows = result.controllers
        names = dict.fromkeys((name, *_blinds(result)))
        speeds = {n: speed for n in names if (speed := rows[n].speed_m_s) is not None}
        ends = rows[name].speed_95
        beside = "".join(f"; {n} {speed:.3f} m/s" for n, speed in speeds.items() if n != name)
        ours = speeds.get(name)
        return Finding(
            f"{shown(ours, '.3f')} m/s ({shown(ends, '.3f')}){beside}",
            None if ours is None else agrees(ours, ends, paper, _NEAR_SPEED * paper),
            "",
            (
                Bar("paper", paper),
                *(Bar(f"ours, {n}", speed, rows[n].speed_95) for n, speed in speeds.items()),
            ),
            by_default,
        )

    return Claim(
        {"closed": "speed", _OPEN: "blind_speed"}[name],
        text,
        f"{paper:g} m/s",
        f"Our mean over robots that cross is within {100 * _NEAR_SPEED:g} %",
        "the others, which cross at a speed of their own",
        "conditional",
        ceiling,
        "tunnel",
        "m/s",
        judge,
    )


@claim(
    "tunnel",
    "m/s",
    paper="0.12 against 0.04 m/s",
    criterion="By the paper's measure, the mean speed of those that cross, it leads each rival by "
    f"over {_HALF_LEAD_SPEED:g} m/s (half of the lead in the paper)",
    rival=f"robots without feedback, and {_BLIND}",
    ceiling=_OURS,
)
def faster(result: TunnelResult) -> Finding:
    """Feedback makes the robot faster through the tunnel."""
    rows, blinds = result.controllers, _blinds(result)
    ours = rows["closed"]
    leads = {
        n: difference(ours.speed_m_s, ours.speed_95, rows[n].speed_m_s, rows[n].speed_95)
        for n in blinds
    }
    beside = "".join(
        f", {n} {shown(rows[n].speed_m_s, '.3f')} (lead {shown(leads[n], '+.3f')})" for n in blinds
    )
    times = ", ".join(f"{shown(rows[n].restricted_mean_time_s, '.1f')} s of `{n}`" for n in blinds)
    pairs = [_pair(result, "closed", n) for n in blinds]
    saved = [_gain(pair and pair.time_difference_95, first) for pair, first in pairs]
    spans = " and ".join(shown(ends, "+.1f") for ends in saved)
    names = ("closed", *blinds)
    return Finding(
        f"{shown(ours.speed_m_s, '.3f')} m/s with feedback{beside}",
        all_of(*(above(ends, _HALF_LEAD_SPEED) for ends in leads.values())),
        "It compares different tunnels, as robots without feedback fail in the hard ones. "
        "By ours, the restricted mean time with failures as the limit, it is "
        f"{shown(ours.restricted_mean_time_s, '.1f')} s against {times}: {spans} s saved.",
        tuple(Bar(f"ours, {n}", rows[n].speed_m_s or 0.0, rows[n].speed_95) for n in names),
    )


@claim(
    "tunnel",
    "m off the centre line",
    paper="the trajectory is centred, no number",
    criterion="Where both cross, its mean distance from the centre line over the length is smaller "
    "than that of each rival beyond the 95 % interval",
    rival=f"robots without feedback, and {_BLIND}",
    ceiling=_OURS,
)
def centred(result: TunnelResult) -> Finding:
    """Feedback keeps the robot in the middle of the tunnel."""
    blinds = _blinds(result)
    pairs = [_pair(result, "closed", n) for n in blinds]
    gains = [_gain(pair and pair.offset_difference_95, first) for pair, first in pairs]
    rows = {n: result.controllers[n] for n in ("closed", *blinds)}
    beside = "; ".join(
        f"nearer than `{n}` by {shown(ends, '+.3f')} m"
        for n, ends in zip(blinds, gains, strict=True)
    )
    return Finding(
        ", ".join(f"{n} {shown(row.offset_m, '.3f')} m" for n, row in rows.items()) + f"; {beside}",
        all_of(*(above(ends, 0.0) for ends in gains)),
        "Distance of the head from the centre line, each stretch of 5 cm counts alike.",
        tuple(
            Bar(f"ours, {n}", row.offset_m, row.offset_95)
            for n, row in rows.items()
            if row.offset_m is not None
        ),
        "The corridor leaves a robot in its middle 0.1 m to either side.",
    )


@claim(
    "tunnel",
    "MPa",
    paper="no antenna failures",
    criterion="The largest bending stress of a spring stays below yield, and its load would bear a "
    f"million cycles (Gerber), in {ENOUGH_TO_STAY} trials or more",
    rival="none: strengths of the wire from Shigley, tables 10-4 and 10-10",
    ceiling="wire and coil are ours",
    beside=("antenna",),
)
def unbroken(result: TunnelResult, wire: SpringParams) -> Finding:
    """No antenna fails."""
    row = result.controllers["closed"]
    low, high, cycles = row.spring_low_n_m, row.spring_high_n_m, row.spring_cycles
    if low is None or high is None or cycles is None:
        return Finding("no valid trial", None, "No trial of `closed` is valid.", ())
    usual = endurance(wire, max(low, -high), high)
    music = endurance(wire.model_copy(update={"wire": "music_wire"}), max(low, -high), high)
    stays = min(usual.yield_factor, usual.fatigue_factor) > 1.0
    few = row.trials - row.invalid < ENOUGH_TO_STAY
    yields = usual.stress * usual.yield_factor
    return Finding(
        f"largest stress {usual.stress / 1e6:.0f} MPa at {1e3 * high:.1f} N·mm, "
        f"{usual.yield_factor:.2f} of that is yield, {usual.fatigue_factor:.2f} the limit of a "
        f"million cycles; at most {cycles} cycles a trial",
        None if stays and few else stays,
        f"Stainless 302 of {wire.wire_mm:g} mm on a coil of {wire.coil_mm:g} mm; music wire yields "
        f"at {music.yield_factor:.2f} of the load and bears {music.fatigue_factor:.2f} of it for a "
        f"million cycles. That many are {1e6 / max(cycles, 1):.0f} trials: "
        + (
            "wear is no matter of a few trials."
            if usual.yield_factor > 1
            else "not wear, but a single strong bend decides, where an antenna is caught between "
            "robot and wall and a hinge goes to its stop."
        ),
        (Bar("yield", yields / 1e6), Bar("ours, largest", usual.stress / 1e6)),
    )


ROBOT = (
    *(forward, turns, reverse),
    blind,
    _touch(
        "paper",
        "With the published rule all robots cross",
        by_default="The plain rule alternates between REVERSE and FORWARD in the corner, or turns "
        "round and leaves; its margins and times are unpublished, ours are assumed.",
    ),
    _touch(
        "closed",
        "Two antennae are enough to cross the tunnel",
        "With our rule in place of the published one: it takes readings that repeat from gait "
        "cycle to gait cycle for being stuck. Who does as well without them needs none.",
    ),
    _speed(
        "closed",
        "With feedback the robot crosses at 0.12 m/s",
        _OURS,
        "A mean over successes; the robots without feedback that cross are as fast, so that this "
        "speed is no mark of feedback.",
    ),
    _speed(
        _OPEN,
        "Without feedback the robots that cross do so at 0.04 m/s",
        "we chose the corner",
        "Our blind robots cross at nearly free speed or lock for good; the paper's were slow.",
    ),
    *(faster, centred, unbroken),
)
