"""A drive: dry run, walk, torque off."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable

from antennate.control.loop import run_loop
from antennate.hardware.driving.config import DriveConfig
from antennate.hardware.driving.dead_man import DeadMan
from antennate.hardware.driving.dry_run import DryRun
from antennate.hardware.driving.operator import Operator
from antennate.hardware.driving.report import Report
from antennate.hardware.driving.session import Session
from antennate.hardware.driving.signals import StopOnce
from antennate.hardware.ports.port import PortError
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
    report, clock = Report(), session.clock
    start = clock.now()
    dry = DryRun(
        session.quality, config.dry_run, config.touch.patience, arm, config.duration or math.inf
    )
    failed_at = math.inf
    key = None if operator.pressed is None else DeadMan(config.dead_man, operator.pressed)
    session.orders.released = key is not None

    def failed(t: float) -> bool:
        """Whether the time to look at a fault is over, and torque can be taken off now or never."""
        nonlocal failed_at
        state = State.OK if session.outputs is None else session.outputs.state
        if t > dry.over + config.limits.longest_arming and state >= State.FAULT:
            failed_at = min(failed_at, t)
        if state is State.OFF and t > failed_at:
            return True
        wait = max(config.fault_time, config.bus_return if session.mute else 0.0)
        return t >= failed_at + wait

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        t = clock.now() - start
        if operator.watches():
            dry.step(t, session.outputs)
        session.orders.arm = dry.asks
        if key is not None:
            key.step(t, session.actuators.enabled)
            session.orders.released = key.released
        report.refusal = dry.refusal
        report.watch(session)
        on_tick(session, clock.now())
        over = failed(t)
        at_end = "a fault" if failed_at < math.inf else "the end of its time"
        reasons = (
            (stop.received, _SIGNAL),
            (key is not None and key.over, "a key that was let go"),
            (operator.arrived(), "arrival"),
            (t >= dry.end, "a refusal of torque" if dry.refusal else at_end),
            (over, "a fault"),
        )
        report.ended = next((text for true, text in reasons if true), "")
        return not report.ended

    with contextlib.nullcontext(operator.stop) if operator.stop else StopOnce() as stop:
        stop.insists, stop.within = True, run_loop
        try:
            try:
                stop.closed = False
                run_loop(session, session.control, session.period, go_on)
            finally:
                stop.closed = True
        except KeyboardInterrupt as error:  # of a signal, or of a controller that asks to end
            report.ended = _SIGNAL if stop.received else str(error) or "its controller"
        finally:
            stop.closed = True
            report.on = _off(session, config.stand)
            report.close(session)
    return report


def _off(session: Session, stand: float) -> list[int] | None:
    """Stand for a moment, then torque off: ids that did not confirm it, None if it never was on."""
    if not session.touched:
        return None
    try:
        with contextlib.suppress(PortError):
            session.stand(stand)
    finally:
        left = session.release()
    return left
