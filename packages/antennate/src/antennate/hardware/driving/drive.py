"""A drive: dry run, walk, torque off."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from antennate.control.loop import run_loop
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.report import Report, raised_links
from antennate.hardware.driving.stopping import DeadMan
from antennate.hardware.safety.causes import OF_CONTROLLER, Cause
from antennate.hardware.safety.session import Session
from antennate.hardware.safety.signal_quality import SignalQuality
from antennate.hardware.safety.supervisor import Outputs
from antennate.host import StopOnce
from antennate.types import AntennaFrame, JointCommand, State


@dataclass(frozen=True)
class Operator:
    """Who may stop a drive.

    Attributes:
        stop: Receives signals; by default while the drive runs.
        pressed: Whether a character of the key that has to be held came since the last call; None
            if no key has to be held.
        arrived: Whether the robot is where it was to go.
        watches: Whether somebody sees what the robot does; torque waits for that.
        warn: Tells what to hold before torque goes off.
    """

    stop: StopOnce | None = None
    pressed: Callable[[], bool] | None = None
    arrived: Callable[[], bool] = field(default=lambda: False)
    watches: Callable[[], bool] = field(default=lambda: True)
    warn: Callable[[str], None] = field(default=lambda text: None)


_SKIP = "; --no-touch-check arms without the check"
_EXPECTED = OF_CONTROLLER | {Cause.NOT_ARMED, Cause.NOT_READY, Cause.RELEASED}
"""Causes that stand before the check is over on a robot that is well."""


class DryRun:
    """Lasts `length`, and longer until antennae are checked and the supervisor allows torque.

    Args:
        quality: With the check of the antennae.
        length: Shortest duration [s].
        patience: Longest extension for the check, and again for the supervisor [s].
        arm: Whether torque is wanted afterwards.
        duration: Time from torque on to off [s].

    Attributes:
        over: When torque was last asked for [s], inf while it may not come on.
        end: When all is over [s], inf if not known yet.
        asks: Whether torque is asked for; the supervisor reacts to the change to True only.
        refusal: Why torque has not come on although it was wanted.
    """

    def __init__(
        self, quality: SignalQuality, length: float, patience: float, arm: bool, duration: float
    ) -> None:
        self._quality, self._length, self._patience = quality, length, patience
        self._waits, self._duration = arm, duration
        self._first = math.inf
        self.over = math.inf
        self.end = math.inf if arm else length
        self.asks = False
        self.refusal = ""

    def step(self, t: float, out: Outputs | None) -> None:
        """Look at antennae and supervisor, at a time since the beginning [s], once a tick."""
        if not self._waits:
            return
        if latched := latched_causes(out):
            self._give_up(t, latched)
        elif self.asks:
            self._follow(t, out)
        elif self._first < math.inf:
            self._ask(t)
        elif self._quality.refused or (
            t >= self._length + self._patience and self._quality.objections
        ):
            wire = self._quality.broken
            ill = [] if wire or self._quality.refused else _ill(out)
            skip = "" if ill or wire else _SKIP  # these forbid torque anyway
            self._give_up(t, "; ".join(ill or self._quality.objections) + skip)
        elif t >= self._length and not self._quality.objections:
            self._first = t
            self._ask(t)

    def _ask(self, t: float) -> None:
        self.asks, self.over, self.end = True, t, t + self._duration

    def _follow(self, t: float, out: Outputs | None) -> None:
        """Torque comes on in this tick, or is asked for again in the next but one."""
        if out is None or out.arming:
            self._waits, self.refusal = False, ""
            return
        self.asks = False
        self.refusal = "; ".join(a.text for a in out.causes if a.cause in out.refusal)
        if t >= self._first + self._patience:
            self._give_up(t, self.refusal)

    def _give_up(self, t: float, why: str) -> None:
        self._waits, self.refusal, self.end = False, why, t


def latched_causes(out: Outputs | None) -> str:
    """A hardware error, which keeps torque off until a reboot; empty if there is none."""
    causes = () if out is None or out.torque else out.causes
    return "; ".join(a.text for a in causes if a.present and a.cause is Cause.SERVO_ERROR)


def _ill(out: Outputs | None) -> list[str]:
    """What is wrong with the robot itself, as a board that fell silent during the check."""
    causes = () if out is None else (a for a in out.causes if a.present)
    return [a.text for a in causes if a.cause.severity >= State.HOLD and a.cause not in _EXPECTED]


_NOBODY = Operator()
_SIGNAL = "a signal"


def drive(
    session: Session,
    config: DriveConfig,
    arm: bool,
    on_tick: Callable[[Session, float], None] = lambda session, t: None,
    operator: Operator = _NOBODY,
) -> Report:
    """A dry run, then, if `arm`, a walk; torque is off at the end whatever happens.

    After a FAULT it stands for `fault_time`, then ends; longer if the bus is gone and may return.

    Args:
        session: As from `connect`.
        config: For how long.
        arm: Whether torque may come on.
        on_tick: Called once after every tick with the session and the time [s]. A signal does not
            interrupt it: it ends the drive afterwards.
        operator: Who may stop it. Its signals are ignored afterwards.
    """
    going = _Going(session, config, arm, on_tick, operator)
    report = going.report
    with contextlib.nullcontext(operator.stop) if operator.stop else StopOnce() as stop:
        stop.insists, stop.within = True, run_loop
        try:
            try:
                stop.closed = False
                run_loop(session, session.control, session.period, partial(going.step, stop))
            finally:
                stop.closed = True
                going.tell()
        except KeyboardInterrupt as error:  # of a signal, or of a controller that asks to end
            report.ended = _SIGNAL if stop.received else str(error) or "its controller"
        finally:
            stop.closed = True
            report.on = _off(session, config.stand, report, operator.warn)
            report.close(session)
    return report


class _Going:
    """A drive while it goes on: what is asked of the session in each tick, and when it ends.

    Args are those of `drive`.

    Attributes:
        report: What came of it.
    """

    def __init__(
        self,
        session: Session,
        config: DriveConfig,
        arm: bool,
        on_tick: Callable[[Session, float], None],
        operator: Operator,
    ) -> None:
        self._session, self._config, self._on_tick = session, config, on_tick
        self._operator = operator
        self.report = Report()
        self._start = session.clock.now()
        patience, longest = config.touch.patience, config.duration or math.inf
        self._dry = DryRun(session.quality, config.dry_run, patience, arm, longest)
        self._failed_at = math.inf
        self._told = 0
        pressed = operator.pressed
        self._key = None if pressed is None else DeadMan(config.dead_man, pressed)
        session.orders.released = self._key is not None

    def step(self, stop: StopOnce, frame: AntennaFrame, command: JointCommand) -> bool:
        """After a tick: whether there is a next one, unless a signal or something else ends it."""
        session, dry, key = self._session, self._dry, self._key
        t = session.clock.now() - self._start
        if self._operator.watches():
            dry.step(t, session.outputs)
        session.orders.arm = dry.asks
        if key is not None:
            key.step(t, session.actuators.enabled)
            session.orders.released = key.released
        self.report.refusal = dry.refusal
        self.report.watch(session)
        stop.closed = True  # what was done is logged once, whole
        self.tell()
        stop.closed = False
        over = self._failed(t)
        at_end = "a fault" if self._failed_at < math.inf else "the end of its time"
        reasons = (
            (stop.received, _SIGNAL),
            (key is not None and key.over, "a key that was let go"),
            (self._operator.arrived(), "arrival"),
            (t >= dry.end, "a refusal of torque" if dry.refusal else at_end),
            (over, "a fault"),
        )
        self.report.ended = next((text for true, text in reasons if true), "")
        return not self.report.ended

    def tell(self) -> None:
        """Tell the last tick to `on_tick`, unless that is done: a signal may come between both."""
        timing = self._session.timing
        if timing is not None and timing.ticks > self._told:
            self._told = timing.ticks
            self._on_tick(self._session, self._session.clock.now())

    def _failed(self, t: float) -> bool:
        """Whether the time to look at a fault is over, and torque can be taken off now or never."""
        outputs, config = self._session.outputs, self._config
        state = State.OK if outputs is None else outputs.state
        if t > self._dry.over + config.limits.longest_arming and state >= State.FAULT:
            self._failed_at = min(self._failed_at, t)
        if state is State.OFF and t > self._failed_at:
            return True
        wait = max(config.fault_time, config.bus_return if self._session.mute else 0.0)
        return t >= self._failed_at + wait


def _off(
    session: Session, stand: float, report: Report, warn: Callable[[str], None]
) -> list[int] | None:
    """Stand for a moment, then torque off: ids that did not confirm it, None if it never was on.

    Links in the air are told first, so that somebody can hold them while the robot stands.
    """
    if not session.touched:
        return None
    try:
        if session.actuators.enabled:
            pitch = session.control.command.pitch.ravel().tolist()
            report.held = raised_links(pitch, session.actuators.robot.link_pitch)
        if report.held:
            warn(report.held)
        session.stand(stand)
    finally:
        left = session.release()
    return left
