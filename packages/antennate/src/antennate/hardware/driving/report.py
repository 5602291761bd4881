"""How a drive went: its walk, its worst state and why, and whether the computer was late."""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from antennate.control.loop import void_decisions
from antennate.hardware.safety.causes import DATA, Active, Cause
from antennate.hardware.safety.session import Session
from antennate.hardware.safety.supervisor import Outputs
from antennate.hardware.timing import LoopTiming
from antennate.types import Floats, Maneuver, State


class Walk:
    """Adds up the time of the ticks in which a command was sent.

    Attributes:
        time: All of it [s].
    """

    def __init__(self) -> None:
        self.time = 0.0
        self._spent: dict[int, float] = defaultdict(float)
        self._sent = 0
        self._last: float | None = None

    def watch(self, session: Session) -> None:
        """Count a tick."""
        now = session.clock.now()
        if self._last is not None and session.tally.sent > self._sent:
            self.time += now - self._last
            self._spent[session.control.decision.maneuver] += now - self._last
        self._sent, self._last = session.tally.sent, now

    @property
    def shares(self) -> dict[str, float]:
        """Share of that time, by maneuver."""
        return {m.name: self._spent[m] / self.time for m in Maneuver} if self.time else {}


MUCH = 0.02
"""Share of ticks missed since the walk began above which the computer is named late (assumed)."""
SOME = 0.005
"""Share of ticks missed that suffices where more answers than ticks times MUCH were missed, too: on
a computer that is not late up to 0.3 % of ticks are (measured, docs/hardware.md)."""
_FOLLOW = (Cause.LATE_ANSWERS, Cause.SILENT_SERVO, Cause.WATCHDOG, Cause.PAUSE)
"""What a late computer may cause by itself."""


MANY = 5
"""Ticks missed within a second above which a live view is given up once servos have torque: half of
what stops a robot, as they wait 0.1 s (assumed)."""
_SECOND = 1.0


class Recent:
    """Ticks that a loop missed within the last second."""

    def __init__(self) -> None:
        self._counts = deque[tuple[float, int]]()

    def step(self, now: float, missed: int) -> int:
        """Take how many it has missed by a time [s]; how many of them within the last second."""
        self._counts.append((now, missed))
        while self._counts[0][0] < now - _SECOND:
            self._counts.popleft()
        return missed - self._counts[0][1]


def late_sentence(result: Mapping[str, Any]) -> list[str]:
    """What a late computer did to a drive: one sentence, or none if it was not late.

    Args:
        result: The content of `result.json`.
    """
    walking, pace = result["walking"], result["pace"]
    if walking is None or pace is None:
        return []
    missed = result["missed_answers"]
    if walking["missed_share"] <= (SOME if missed > MUCH * pace["ticks"] else MUCH):
        return []
    share, worst = 100.0 * walking["missed_share"], 1e3 * pace["worst_lateness_s"]
    following = [cause.name for cause in _FOLLOW if cause.name in result["why"]]
    may = (
        f" {' and '.join(following)} may come from that, not from the servos." if following else ""
    )
    return [
        f"The computer was late: {share:.1f} % of ticks missed since the walk began, at most "
        f"{worst:.0f} ms late, and {missed} answers of servos missed; close other programs, see "
        f"Pace in docs/hardware.md.{may}"
    ]


RAISED = 0.02
"""Height above the lowest link from which on a link may hang in the air [m] (assumed: the radius
of the body)."""


def raised_links(pitch: Sequence[float], link_pitch: float) -> str:
    """What to hold before torque goes off, in words; empty if no link is higher than RAISED.

    The last link is taken as level and the lowest one as standing, as joints tell nothing of the
    floor.

    Args:
        pitch: Commanded pitch joints, head first [rad], positive where the part in front rises
            against the part behind.
        link_pitch: Joint spacing [m].
    """
    above = link_heights(pitch, link_pitch)
    links = np.flatnonzero(above - above.min() > RAISED).tolist()
    if not links:
        return ""
    *others, last = map(str, links)
    if not others:
        return f"link {last} is raised: hold it"
    return f"links {', '.join(others)} and {last} are raised: hold them"


def link_heights(pitch: Sequence[float], link_pitch: float) -> Floats:
    """Heights of the middles of all links over that of the last, which is level [m], head first.

    Args:
        pitch: Pitch joints, head first [rad], shape (n,): the slope of the link in front of a joint
            less that of the link behind it.
        link_pitch: Joint spacing [m].

    Returns:
        Heights, shape (n + 1,).
    """
    slopes = np.cumsum([0.0, *reversed(pitch)])
    half = np.sin(slopes) * link_pitch / 2  # from the middle of a link to either end
    return np.cumsum([0.0, *(half[:-1] + half[1:])])[::-1]


_FILLING = (Cause.STALE, Cause.LOST)
"""What is said of a healthy board, too, until it has sent a few readings."""
_FILLED = 1.0
"""Time that the first good reading of each antenna may take [s]: ten times what it takes by a board
that samples at 100 Hz (assumed)."""


@dataclass(slots=True)
class _Spell:
    """A time in one bad state; a cause found while it lasts makes it clearer."""

    state: State
    why: str
    causes: set[Cause]
    noise: str = ""
    ticks: int = 0

    @property
    def rank(self) -> tuple[State, bool, int]:
        """What counts more: a worse state, one that is not the operator's wish, a longer one."""
        causes = {cause for cause in self.causes if cause.severity is self.state}
        wished = causes - {Cause.UNKNOWN_CONTACT} == {Cause.RELEASED}
        return self.state, not wished, self.ticks

    def go_on(self, why: str, causes: set[Cause], noise: str) -> None:
        """One more tick of it; a hum is told as large as it was."""
        if self.noise and noise:
            self.why = self.why.replace(self.noise, noise)
        self.noise = noise or self.noise
        more = causes == self.causes and len(why) > len(self.why)  # of the same causes, more servos
        if more or not causes <= self.causes:
            self.why = why
        self.causes |= causes
        self.ticks += 1


@dataclass(slots=True)
class Report:
    """How a drive went.

    Attributes:
        timing: How well the pace was kept, None if no tick was run.
        before: The same up to the first tick with torque, None if it never came on.
        worst: Worst state since torque came on. The short wait for the first decision is left out,
            unless no command follows it. If torque never came on, HOLD if data are missing at the
            end, unless it ended before the first ones could be there.
        why: The causes of the longest time in that state, an operator's key that was let go last.
        refusal: Why torque did not come on although it was wanted, or would not after a dry run;
            empty if nothing forbade it.
        on: Servos that did not confirm that their torque is off; None if it never was on.
        held: What was to be held when torque went off, in words; empty if nothing was.
        ended: What ended it.
        walk: How long the robot walked.
    """

    timing: LoopTiming | None = None
    before: LoopTiming | None = None
    worst: State = State.OK
    why: str = ""
    refusal: str = ""
    on: list[int] | None = None
    held: str = ""
    ended: str = ""
    walk: Walk = field(default_factory=Walk)
    _torque: bool = False
    _felt: bool = False
    _waits: str = ""
    _spell: _Spell | None = None
    _worst: tuple[State, bool, int] = (State.OK, False, 0)

    @property
    def safe(self) -> bool:
        """No servo that was given torque still has it."""
        return not self.on

    def watch(self, session: Session) -> None:
        """Take note of a tick."""
        self.walk.watch(session)
        out = session.outputs
        self._felt |= out is not None and not any(map(_missing, out.causes))
        if out is None or not (self._torque or out.torque):
            return
        self._torque = True
        if self.before is None and session.timing is not None and session.tally.sent:
            self.before = session.timing.report()
        why = "; ".join(active.text for active in out.causes)
        if self.before is None and _only_undecided(out):
            self._waits = why
        elif out.state >= max(self.worst, State.DEGRADED) and not _ordered(out):
            self._explain(out, why)
        else:
            self._spell = None

    def _explain(self, out: Outputs, why: str) -> None:
        """Keep why the worst state lasted longest."""
        causes, spell = {active.cause for active in out.causes}, self._spell
        noise = "".join(a.detail for a in out.causes if a.cause is Cause.NOISE)
        if spell is None or out.state is not spell.state:
            spell = _Spell(out.state, why, causes | (spell.causes if spell else set()))
            self._spell = spell
        spell.go_on(why, causes, noise)
        if spell.rank > self._worst:
            self.worst, self.why, self._worst = spell.state, spell.why, spell.rank

    def close(self, session: Session) -> None:
        """The last tick is over."""
        self.timing = None if session.timing is None else session.timing.report()
        if self.before is None and self._waits and self.worst < State.HOLD:
            self._wait(self._waits)
        causes = () if session.outputs is None else session.outputs.causes
        begun = math.inf if self._felt else session.clock.now() - _FILLED
        missing = [
            a.text for a in causes if _missing(a) and (a.cause not in _FILLING or a.since <= begun)
        ]
        if not self._torque and missing:
            self._wait("; ".join(missing))

    def _wait(self, why: str) -> None:
        """Tell of a HOLD whose time is not known."""
        self.worst, self.why, self._worst = State.HOLD, why, (State.HOLD, True, 0)

    def result(self, session: Session) -> dict[str, Any]:
        """All of it as plain numbers and words, for result.json."""
        board, answers = session.board, session.actuators.tally
        return {
            "worst_state": self.worst.name,
            "worst_s": round(self._worst[2] * session.period, 3),
            "why": self.why,
            "refusal": self.refusal,
            "ended": self.ended,
            "torque_off": None if self.on is None else self.safe,
            "servos_on": self.on or [],
            "held": self.held,
            "pace": _pace(self.timing),
            "walking": _since(self.timing, self.before),
            "walked_s": self.walk.time,
            "shares": self.walk.shares,
            "frames": board.decoder.counters.good,
            "crc_errors": board.decoder.counters.crc_errors,
            "lost_samples": board.lost,
            "overdue_samples": board.overdue,
            **({} if session.imu is None else {"imu_readings": dict(session.imu.result())}),
            "resets": board.clock.resets,
            "missed_answers": answers.misses,
            "stale_answers": answers.stale,
            "broken_answers": answers.bad_crc,
            "echoes": answers.echoes,
            "margins": {
                name: round(share, 3)
                for name, share in asdict(session.actuators.state.margins).items()
            },
            "commands_sent": session.tally.sent,
            "commands_limited": session.tally.limited,
            "commands_refused": session.control.refused,
            "void_decisions": void_decisions(session.control.controller),
            "tracebacks": [
                *session.control.tracebacks.kept,
                *session.actuators.state.tracebacks.kept,
            ],
        }


def _missing(active: Active) -> bool:
    """Whether it is a loss of data that is still there."""
    return active.present and active.cause in DATA


def _only_undecided(out: Outputs) -> bool:
    """Whether it holds for want of a decision and for nothing else, as it does when it begins."""
    holds = {active.cause for active in out.causes if active.cause.severity is State.HOLD}
    return out.state is State.HOLD and holds == {Cause.UNKNOWN_CONTACT}


def _ordered(out: Outputs) -> bool:
    """Whether torque is off by the operator's order and for no other reason."""
    off = {active.cause for active in out.causes if active.cause.severity is State.OFF}
    return off == {Cause.STOPPED}


def _pace(timing: LoopTiming | None) -> dict[str, Any] | None:
    if timing is None:
        return None
    return {
        "ticks": timing.ticks,
        "missed_cycles": timing.missed_cycles,
        "missed_share": timing.missed_share,
        "worst_lateness_s": timing.worst_lateness,
        "worst_tick_s": timing.worst_tick,
        "stages": {
            name: {"worst_s": stage.worst, "overruns": stage.overruns}
            for name, stage in timing.stages.items()
        },
    }


def _since(end: LoopTiming | None, begin: LoopTiming | None) -> dict[str, Any] | None:
    """Ticks from the first command that was sent; the time that arming takes is before it."""
    if end is None or begin is None:
        return None
    ticks = end.ticks - begin.ticks
    missed = end.missed_cycles - begin.missed_cycles
    share = missed / max(1, ticks + missed)
    return {"ticks": ticks, "missed_cycles": missed, "missed_share": share}
