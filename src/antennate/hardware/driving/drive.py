"""A drive: dry run, walk, torque off."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from functools import partial

from antennate.control.loop import run_loop
from antennate.hardware.driving.config import DriveConfig
from antennate.hardware.driving.dead_man import DeadMan
from antennate.hardware.driving.dry_run import DryRun
from antennate.hardware.driving.operator import Operator
from antennate.hardware.driving.report import Report
from antennate.hardware.driving.session import Session
from antennate.hardware.driving.signals import StopOnce
from antennate.hardware.safety.causes import State
from antennate.types import AntennaFrame, JointCommand

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
        on_tick: Called after every tick with the session and the time [s].
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
        except KeyboardInterrupt as error:  # of a signal, or of a controller that asks to end
            report.ended = _SIGNAL if stop.received else str(error) or "its controller"
        finally:
            stop.closed = True
            report.on = _off(session, config.stand)
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
        self._on_tick(session, session.clock.now())
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


def _off(session: Session, stand: float) -> list[int] | None:
    """Stand for a moment, then torque off: ids that did not confirm it, None if it never was on."""
    if not session.touched:
        return None
    try:
        session.stand(stand)
    finally:
        left = session.release()
    return left
