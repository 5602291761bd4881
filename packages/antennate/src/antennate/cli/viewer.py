"""What is shown of a drive: a line while it lasts, a table and what came out at its end.

Run as a module it is the other process of `antennate drive`, which keeps the log and shows the
line. It reads from its standard input what a `Feed` sends, and nobody waits for it. On its standard
output it says once whether the log has begun, and why it cannot be written any more.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import signal
import socket
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from antennate.cli.terminal import StatusLine, write_below_status
from antennate.control.loop import void_sentence
from antennate.control.readings import short_names
from antennate.errors import AntennateError, LogError
from antennate.hardware.driving.report import late_sentence
from antennate.hardware.safety.causes import what_to_do
from antennate.host import STOPS, Priority
from antennate.messages import one_line
from antennate.studies.columns import Column
from antennate.studies.tables import Table
from antennate.telemetry.feed import KEPT, NOT_KEPT, Message, messages
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.view.channel import HEADER, STATE, TICK, Channel
from antennate.telemetry.view.pace import RATE
from antennate.telemetry.writer import SYNC, LogWriter
from antennate.types import Maneuver, State

MODULE = "antennate.cli.viewer"
"""What Python runs as the process beside a drive."""
REQUIRED, EVERY, PAGE = "required", "every", "page="
_STDOUT = 1
_BEFORE = re.compile(r"(HOLD|FAULT|OFF) (?!NOT_READY|UNKNOWN_CONTACT|UNDECIDED)")
"""A cause that is also shown while the robot is not armed."""
_ASKED = re.compile(r"do=\(([^)]*)\)|touch=\((.*)\)(?= drift=|$)")
"""What a person is to do, within the note of a tick."""
_STEP = re.compile(r"step \d+ of \d+: .* min left")
"""Step of a protocol, the next one, and the time that is left, likewise."""


class Display:
    """The ticks as they come: a status line, and above it what a person is to do."""

    def __init__(self) -> None:
        self.status = StatusLine()
        self._asked = ""

    def show(self, tick: Tick, unlogged: int) -> None:
        """Show a tick, if one is due or if something new is asked."""
        match = _ASKED.search(tick.note)
        asked = (match[1] or match[2]) if match else ""
        if (step := _STEP.search(tick.note)) and any(e.startswith("begin") for e in tick.events):
            self.status.say(f"{step[0][0].upper()}{step[0][1:]}.")
        if asked not in ("", self._asked) and self.status.terminal:
            self.status.say(f"{asked[0].upper()}{asked[1:]}.")
        self._asked = asked
        if self.status.due(tick.now):
            text = line(tick, unlogged)
            self.status.show(text.replace(f"({asked})", "asked") if asked else text, asked)


def line(tick: Tick, unlogged: int) -> str:
    """All counters of a tick in one line."""
    left, right = ("-" if math.isnan(counts) else f"{counts:.0f}" for counts in tick.reading)
    state = tick.state or "-"
    why = f" ({_why(state, tick.causes)})" if tick.causes else ""
    maneuver = Maneuver.label(tick.maneuver)
    return (
        f"{tick.now:7.1f} s {state}{why} maneuver={maneuver} counts={left},{right} "
        f"age={1e3 * tick.age:.0f}ms {tick.note} missed_ticks={tick.missed} "
        f"missed_answers={tick.misses} stale={tick.stale} frames={tick.frames} crc={tick.crc} "
        f"lost={tick.lost} sent={tick.sent} refused={tick.refused} unlogged={unlogged}"
    )


def _why(state: str, causes: Sequence[str]) -> str:
    """The first cause; of a robot that is not armed yet also what is wrong."""
    first, *others = causes
    why = first.removeprefix(f"{state} ")
    if why.startswith("NOT_ARMED"):
        why = "; ".join([why, *filter(_BEFORE.match, others)][:2])
    return why


class _Page:
    """Sends ticks on to the process of a live view, which is never waited for.

    Args:
        file: Number of the file that leads there.
        folder: That of the results.
        every: Whether it gets each tick, and not those of pictures alone.
    """

    def __init__(self, file: int, folder: Path, every: bool) -> None:
        self._folder, self._every = folder, every
        self._channel = Channel(socket.socket(fileno=file))
        self._due = -math.inf

    def begin(self, first: Message) -> None:
        """The header of a log; nothing on the page can change anything."""
        with contextlib.suppress(LogError):
            header = Header.unpack(first.content)
            title = f"{header.controller} on the robot"
            theta = header.params.rule.threshold
            self._channel.tell(STATE, title=title, theta=theta, results=str(self._folder))
            self._channel.send(HEADER, first.content)

    def show(self, message: Message) -> None:
        """A tick, if it is wanted."""
        now = time.monotonic()
        if self._every or now >= self._due:
            self._due = now + 1.0 / RATE
            self._channel.send(TICK, message.content)


class _Log:
    """The log, while it can be written; why it cannot is said once, here and to the loop.

    Args:
        path: Its file.
        required: Whether the robot walks only with it.

    Attributes:
        keeps: Whether it takes ticks.
    """

    def __init__(self, path: Path, required: bool) -> None:
        self._path, self._required = path, required
        self._writer: LogWriter | None = None
        self._count, self.keeps = 0, False

    def begin(self, first: Message) -> None:
        """Begin it; the robot walks on without one that cannot be written."""
        try:
            self._writer = LogWriter(self._path, Header.unpack(first.content), sync=SYNC)
        except LogError as error:
            follows = "no command is sent" if self._required else "the robot walks on"
            say(LogError(f"{error}; {follows} without a log"))
            _answer(NOT_KEPT + str(error).encode())
        else:
            self.keeps = True
            _answer(KEPT)

    @property
    def unkept(self) -> int:
        """Ticks that came and that it lacks; those that it holds back for a moment are none."""
        written = 0 if self._writer is None else self._writer.kept
        return 0 if self.keeps else self._count - written

    def write(self, tick: Tick) -> None:
        """Take one tick."""
        self._count += 1
        self._carry_out(lambda writer: writer.write(tick))

    def settle(self) -> None:
        """Let no tick wait while none follows."""
        self._carry_out(LogWriter.settle)

    def close(self) -> None:
        """End it."""
        self._carry_out(LogWriter.close)

    def fail(self, error: LogError) -> None:
        """Take nothing more. It is not closed: so a reader sees that something went wrong."""
        say(error)
        _answer(str(error).encode())
        self.keeps = False
        if self._writer is not None:
            with contextlib.suppress(LogError):
                self._writer.flush()

    def _carry_out(self, act: Callable[[LogWriter], None]) -> None:
        if self._writer is not None and self.keeps:
            try:
                act(self._writer)
            except LogError as error:
                self.fail(error)


def _answer(data: bytes) -> None:
    """Tell the loop; if it is gone, the ticks tell it."""
    with contextlib.suppress(OSError):
        os.write(_STDOUT, data)


def main() -> int:
    """Keep and show ticks until they end; 0 if all of them are kept.

    With the word `required` after the log's path it ends with the log, and shows nothing more. With
    `page=NUMBER` it sends them on to the file of that number, with `every` each of them.
    """
    for number in (*STOPS, signal.SIGTTOU):  # the other end decides when it is over
        signal.signal(number, signal.SIG_IGN)
    display = Display()
    required = REQUIRED in sys.argv[2:]
    log = _Log(Path(sys.argv[1]), required)
    files = [int(word.removeprefix(PAGE)) for word in sys.argv[2:] if word.startswith(PAGE)]
    every = EVERY in sys.argv[2:]
    page = _Page(files[0], Path(sys.argv[1]).parent, every) if files else None
    stream = messages(sys.stdin.buffer.raw, log.settle)  # type: ignore[attr-defined]
    try:
        first = next(stream, None)
        if first is not None:
            log.begin(first)
        if page is not None and first is not None:
            page.begin(first)
        for message in stream:
            tick = Tick.unpack(message.content)
            log.write(tick)
            display.show(tick, message.dropped + log.unkept)
            if page is not None:
                page.show(message)
            if required and not log.keeps:
                break
        log.close()
    except LogError as error:  # the loop was killed
        log.fail(error)
    display.status.close()
    return int(not log.keeps)


def say(error: AntennateError) -> None:
    """Show an error of the log on stderr, below the status line."""
    write_below_status(f"antennate drive: {one_line(str(error))}")


def warn(text: str) -> None:
    """Show on stderr what to do before torque goes off, below the status line."""
    write_below_status(f"antennate drive: torque goes off now; {text}")


MEASURES = (
    Column("pace.ticks", "ticks", form="d"),
    Column("pace.missed_cycles", "missed ticks", form="d"),
    Column("pace.missed_share", "missed", "%", scale=100.0),
    Column("walking.missed_share", "missed since the walk began", "%", scale=100.0),
    Column("pace.worst_lateness_s", "worst lateness", "ms", form=".1f", scale=1e3),
    Column("pace.worst_tick_s", "worst tick", "ms", form=".1f", scale=1e3),
    Column("frames", "frames", form="d"),
    Column("crc_errors", "crc errors", form="d"),
    Column("lost_samples", "lost samples", form="d"),
    Column("resets", "resets", form="d"),
    Column("missed_answers", "missed answers", form="d"),
    Column("stale_answers", "stale answers", form="d"),
    Column("unlogged", "unlogged ticks", form="d"),
    Column("commands_sent", "commands sent", form="d"),
    Column("commands_refused", "commands refused", form="d"),
    Column("priority", "priority"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The table of a drive."""
    name = result["controller"]
    return (Table.of("Drive", {short_names([name])[name]: result}, MEASURES, _note(result)),)


def sentences(result: Mapping[str, Any]) -> str:
    """What came out, how late the loop was, and the cure of what went wrong."""
    held = result["worst_state"] == State.HOLD.name and result.get("worst_s", 0.0) >= _LONG
    causes = f"{result['refusal']}; {result['why']}" if held or failed(result) else ""
    held = result.get("held")  # results of older versions have none
    last = [f"Before torque went off: {held}."] if held else []
    if goals := result.get("goals"):
        last.append(f"Goals of joints: {goals['taken']} taken, {goals['refused']} refused.")
    void = void_sentence({f"`{result['controller']}`": result.get("void_decisions", 0)})
    told = _recorded(result)
    lines = [_sentence(result), told, void, *late_sentence(result), *what_to_do(causes), *last]
    return "\n".join(filter(None, lines))


def _recorded(result: Mapping[str, Any]) -> str:
    """How far a protocol has come; empty of another drive."""
    told = result.get("protocol")
    count = told and f"{len(told['recorded'])} of {told['steps']}"
    return f"Steps of the protocol that are recorded: {count}." if count else ""


_LONG = 1.0
"""Time in HOLD from which on somebody should look at its cause [s] (assumed)."""


def failed(result: Mapping[str, Any]) -> bool:
    """Whether a drive ends with exit code 2, its log apart."""
    fault = result["worst_state"] in (State.FAULT.name, State.OFF.name)
    cut = result["armed"] and result.get("interrupted", False)
    return cut or fault or result["torque_off"] is False or bool(result["refusal"]) or _idle(result)


def _idle(result: Mapping[str, Any]) -> bool:
    """Whether the robot was to walk and never did."""
    return result["armed"] and not result["commands_sent"]


def _note(result: Mapping[str, Any]) -> str:
    lines: list[str] = []
    if result["priority"] == Priority.ORDINARY.value:
        lines.append("Real-time priority was not allowed; a busy machine will make it miss ticks.")
    if result.get("echoes"):  # results of older versions have none
        lines.append(
            "The adapter of the servo bus sends back what it gets (an echo); that was dropped."
        )
    if not result["log_complete"] and result["logs"]:
        files = f"Its files: {', '.join(result['logs'])}."
        lines.append(f"The log is not complete: {log_failure(result)}. {files}")
    return "\n".join(lines)


def log_failure(result: Mapping[str, Any]) -> str:
    """Why the log is not complete; results of older versions do not say."""
    return result.get("log_failure") or "nothing is known of the reason"


def _sentence(result: Mapping[str, Any]) -> str:
    """What came out, in one sentence."""
    state = result["worst_state"]
    causes = [cause.removeprefix(f"{state} ") for cause in result["why"].split("; ")]
    why = f" ({'; '.join(causes)})" if result["why"] else ""
    lasted = result.get("worst_s")  # results of older versions have none
    worst = f"worst state {state}{f' for {lasted:.1f} s' if lasted else ''}{why}"
    torque, ended = _torque(result), f"ended by {result['ended']}"
    refusal = result["refusal"]
    if refusal and result["armed"]:
        more = f"; {worst}" if result["why"] and result["why"] not in refusal else ""
        return f"The robot was not armed: {refusal}{more}; {torque}."
    if not result["armed"]:
        dry = "A dry run: nothing was written to the servos"
        arm = f"--arm is refused: {refusal}" if refusal else "--arm lets the robot walk"
        return f"{dry}, {worst}; {ended}; {arm}."
    if _idle(result):
        return f"The robot never walked, no command was sent; {worst}; {ended}; {torque}."
    sent = f"{result['commands_sent']} commands of `{result['controller']}` were sent"
    shares = ", ".join(f"{name} {100 * s:.0f} %" for name, s in result["shares"].items() if s)
    walked = f"The robot walked for {result['walked_s']:.1f} s ({shares}): {sent}"
    return f"{walked}, {worst}; {ended}; {torque}."


def _torque(result: Mapping[str, Any]) -> str:
    if result["torque_off"] is None:
        return "torque never came on"
    if not result["servos_on"]:
        return "torque is off, verified"
    names = ", ".join(map(str, result["servos_on"]))
    return f"torque is NOT confirmed off: servos {names}; switch their supply off"


if __name__ == "__main__":
    sys.exit(main())
