"""What the paper says of the gait."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antennate.experiments.reproduce.verdict import Bar, Finding, claim


@claim(
    "gait",
    "m/s",
    paper="walks",
    criterion="It walks forward, and faster than the rival",
    rival="the legs alone, without the body wave",
    ceiling="the lead of the wave over the legs is ours",
)
def forward(result: Mapping[str, Any]) -> Finding:
    """A body wave from head to tail with stepping legs walks forward."""
    speed, alone = result["maneuvers"]["forward"]["speed_m_s"], result["wave_off"]["speed_m_s"]
    return Finding(
        f"{speed:.3f} m/s with the body wave, {alone:.3f} m/s without",
        speed > alone > 0,
        "The paper gives no lead of the body wave over the legs, and the worst lead walks at "
        f"{100 * result['cost_of_phase']['worst_over_best']:.0f} % of the best speed.",
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
def turns(result: Mapping[str, Any]) -> Finding:
    """An offset of the body wave turns the robot."""
    left, right = (result["maneuvers"][n]["yaw_deg_per_cycle"] for n in ("turn_l", "turn_r"))
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
def reverse(result: Mapping[str, Any]) -> Finding:
    """The body wave run backwards reverses the robot."""
    forward, back = (result["maneuvers"][n]["speed_m_s"] for n in ("forward", "reverse"))
    return Finding(
        f"{back:+.3f} m/s",
        back < 0,
        "If the legs run backwards with the wave.",
        (Bar("ours, forward", forward), Bar("ours, reverse", back)),
    )


GAIT = (forward, turns, reverse)
