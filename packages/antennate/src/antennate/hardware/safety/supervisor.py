"""Decides in every tick whether the robot may walk, must hold, or is switched off.

The most severe cause in force decides. A loss of data ends after fresh samples. FAULT and OFF
end only with an arm event, once their causes are gone. Nothing here reads a clock.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from antennate.hardware.safety.causes import (
    CURED_BY_ARMING,
    DATA,
    OF_CONTROLLER,
    OF_FINDING,
    Active,
    Cause,
)
from antennate.hardware.safety.channel import Finding
from antennate.params.safety import SupervisorParams
from antennate.types import Contact, Maneuver, State


class RateMeter:
    """Measures a rate over a sliding window.

    Args:
        expected: Rate agreed [Hz].
        error: Relative error allowed.
        window: Window [s]; also the time for which the rate must be wrong.

    Attributes:
        rate: Samples per second over the window [Hz], NaN while it fills.
    """

    def __init__(self, expected: float, error: float, window: float) -> None:
        self._low = expected * (1.0 - error)
        self._high = expected * (1.0 + error)
        self._window = window
        self._ticks: deque[tuple[float, int]] = deque()
        self._sum = 0
        self._start = self._right = self.rate = math.nan
        self.wrong = False

    def step(self, now: float, samples: int) -> None:
        """Count the samples that arrived since the tick before, at time now [s]."""
        if math.isnan(self._start):
            self._start = self._right = now
            return
        self._ticks.append((now, samples))
        self._sum += samples
        while self._ticks and self._ticks[0][0] <= now - self._window:
            self._sum -= self._ticks.popleft()[1]
        if now - self._start < self._window:
            self._right = now
            return
        self.rate = self._sum / self._window
        if self._low <= self.rate <= self._high:
            self._right = now
        self.wrong = now - self._right >= self._window


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """Inputs of the supervisor in one tick, after the controller's step.

    None has a default: one that is forgotten is an error in the first tick, not health.

    Attributes:
        age: Age of the newest valid sample [s]; inf if there is none.
        valid: Valid samples that arrived since the tick before, without those that were too old.
        refused: Samples since then that were not valid.
        findings: Of the left and the right channel.
        noise: Size and frequency of the noise of a channel that is NOISE, left and right.
        decided_at: Time at which the controller finished its newest decision [s].
        maneuver: That decision.
        contact: The contact that it was decided on, left and right.
        bad_command: Why its command must not be sent, empty if it may.
        failure: Text of an exception of the controller in this tick, empty if none.
        resets: Restarts of the antenna board so far.
        reset_reason: Why it last restarted, as far as known.
        board_error: What is wrong with its port, empty if nothing is.
        missed: Answers missed in a row, by servo id; ids without any may be left out.
        servo_errors: Hardware errors in words, by servo id.
        bus_error: What is wrong with the bus as a whole, empty if nothing is.
        watchdogs: Ids of servos stopped by their watchdog.
        disarmed: Ids of servos that have lost their torque or their watchdog while armed.
        supply: Voltage of the supply [V], NaN if unknown.
        behind: Joints that do not follow their goals, in words by servo id.
        outside: Joints beyond their limits, likewise.
        leaps: Joints that have moved faster than they can, likewise.
        modes: Servos in a wrong operating mode, likewise.
        drift: How far resting readings have drifted, empty if not far.
        imu: What is wrong with the inertial sensor, empty if nothing is or there is none.
        objections: Reasons not to arm, such as a failed touch check or unknown firmware.
        unrecorded: Whether a record that is required is not kept.
        stop: Whether the operator wants the torque off.
        released: Whether the key that lets the robot walk is not held.
        arm: Whether the operator wants it on; only the change to True in FAULT or OFF counts.
    """

    age: float
    valid: int
    refused: int
    findings: tuple[Finding, Finding]
    noise: tuple[str, str]
    decided_at: float
    maneuver: int
    contact: tuple[int, int]
    bad_command: str
    failure: str
    resets: int
    reset_reason: str
    board_error: str
    missed: Mapping[int, int]
    servo_errors: Mapping[int, str]
    bus_error: str
    watchdogs: tuple[int, ...]
    disarmed: tuple[int, ...]
    supply: float
    behind: Mapping[int, str]
    outside: Mapping[int, str]
    leaps: Mapping[int, str]
    modes: Mapping[int, str]
    drift: str
    imu: str
    objections: tuple[str, ...]
    unrecorded: bool
    stop: bool
    released: bool
    arm: bool


@dataclass(frozen=True, slots=True)
class Outputs:
    """What the tick may do.

    Attributes:
        move: Whether the command just decided may be sent; if not, the last one sent stays.
        arming: True in the one tick of an accepted arm event: clear the watchdogs, set all goals to
            the present positions, then switch the torque on.
        feed_watchdog: Whether the watchdogs of the servos may be fed: only upon a decision taken in
            this very tick.
        clear: Whether data and actuators are well and the torque on. While it is False the
            controller gets NaN for counts in the next tick, so that its gait stands still.
        causes: All causes in force, the most severe first. Of equal ones those that explain first:
            losses of data, those still there before those that only wait for fresh samples; then
            others; then those of the controller; the oldest of each first.
        refusal: Why an arm event of this tick was not accepted, empty if it was or none came.
    """

    state: State
    move: bool
    torque: bool
    arming: bool
    feed_watchdog: bool
    clear: bool
    causes: tuple[Active, ...]
    refusal: tuple[Cause, ...]


_FAILURES = frozenset({Cause.FAILED, Cause.BAD_ACTION, Cause.BAD_COMMAND})
_SUPPLY = (Cause.SUPPLY_WARN, Cause.SUPPLY_HOLD, Cause.SUPPLY_OFF)


class _Repeats:
    """Counts events within a time; full when there are too many."""

    def __init__(self, limit: int, within: float) -> None:
        self._times: deque[float] = deque(maxlen=limit)
        self._within = within

    def add(self, now: float) -> bool:
        """Count an event; True if it is one too many."""
        self._times.append(now)
        return len(self._times) == self._times.maxlen and now - self._times[0] <= self._within

    def clear(self) -> None:
        self._times.clear()


class Supervisor:
    """Begins OFF and without data; torque comes on by an arm event only.

    Attributes:
        meter: Measures the rate of samples.
    """

    def __init__(self, params: SupervisorParams) -> None:
        self._params = params
        self.state = State.OFF
        self.meter = RateMeter(params.rate, params.rate_error, params.rate_time)
        self._active: dict[Cause, Active] = {}
        self._latched: set[Cause] = {Cause.NOT_ARMED}
        self._waiting: set[Cause] = {Cause.STALE}
        self._streak = 0
        self._last = -math.inf
        self._arming = False
        self._resets: int | None = None
        self._asked = False
        self._low: set[Cause] = set()
        self._holds = _Repeats(params.repeats, params.repeat_time)
        self._failures = _Repeats(params.repeats, params.repeat_time)
        self._reboots = _Repeats(params.repeats, params.repeat_time)

    def step(self, now: float, inputs: Inputs) -> Outputs:
        """Decide on one tick at a time [s], from a clock that never steps."""
        decided = self._last < inputs.decided_at <= now
        present = self._world(now, inputs) | self._controller(now, inputs, decided)
        self._recover(inputs, present)
        self._latch(present)
        asks = inputs.arm and not self._asked and self.state >= State.FAULT
        refusal = self._objections(present) if asks else ()
        arming = asks and not refusal
        self._asked = inputs.arm
        if arming:
            self._rearm(present)
        self._list(now, present)
        state = self._settle(now)
        self._last, self._arming = now, arming
        return self._outputs(state, decided and not inputs.failure, arming, refusal)

    def _outputs(
        self, state: State, decided: bool, arming: bool, refusal: tuple[Cause, ...]
    ) -> Outputs:
        torque = state < State.OFF
        order = sorted(self._active.values(), key=_rank)
        waits = {a.cause for a in order if a.cause.severity >= State.HOLD}
        return Outputs(
            state=state,
            move=decided and not arming and state <= State.DEGRADED,
            torque=torque,
            arming=arming,
            feed_watchdog=torque and decided,
            clear=torque and not waits - OF_CONTROLLER,
            causes=tuple(order),
            refusal=refusal,
        )

    def _world(self, now: float, inputs: Inputs) -> dict[Cause, str]:
        """Causes in data, time, servos, supply and operator, each with its detail."""
        causes = self._data(now, inputs)
        longest = self._params.longest_arming if self._arming else self._params.longest_pause
        if not now - self._last < longest and self._last > -math.inf:
            causes[Cause.PAUSE] = f"{now - self._last:.3g} s"
        elif not now > self._last:
            causes[Cause.PAUSE] = "time did not advance"
        self._servos(inputs, causes)
        self._supply(inputs.supply, causes)
        if inputs.objections:
            causes[Cause.NOT_READY] = "; ".join(inputs.objections)
        for cause, there in (
            (Cause.NO_RECORD, inputs.unrecorded),
            (Cause.STOPPED, inputs.stop),
            (Cause.RELEASED, inputs.released),
        ):
            if there:
                causes[cause] = ""
        return causes

    def _data(self, now: float, inputs: Inputs) -> dict[Cause, str]:
        """Causes in the board and its readings."""
        params, causes = self._params, dict[Cause, str]()
        if not 0.0 <= inputs.age <= params.stale_age:
            causes[Cause.STALE] = inputs.board_error or f"age {inputs.age:.3g} s"
        for side, finding, noise in zip(
            ("left", "right"), inputs.findings, inputs.noise, strict=True
        ):
            if (cause := OF_FINDING.get(finding)) is not None:
                text = f"{side} {noise}" if noise else side
                causes[cause] = f"{causes[cause]}, {text}" if cause in causes else text
        if self._resets is not None and inputs.resets != self._resets:
            causes[Cause.REBOOT] = inputs.reset_reason
            if self._reboots.add(now):
                causes[Cause.REBOOT_LOOP] = inputs.reset_reason
        self._resets = inputs.resets
        self.meter.step(now, inputs.valid)
        if self.meter.wrong:
            causes[Cause.RATE] = f"{self.meter.rate:.0f} Hz"
        if inputs.drift:
            causes[Cause.DRIFT] = inputs.drift
        if inputs.imu:
            causes[Cause.IMU] = inputs.imu
        return causes

    def _servos(self, inputs: Inputs, causes: dict[Cause, str]) -> None:
        params, missed = self._params, inputs.missed.items()
        silent = {servo for servo, count in missed if count >= params.silent_answers}
        late = {servo for servo, count in missed if count >= params.late_answers}
        for cause, ids in (
            (Cause.LATE_ANSWERS, late - silent),
            (Cause.SILENT_SERVO, silent),
            (Cause.WATCHDOG, inputs.watchdogs),
            (Cause.DISARMED, inputs.disarmed),
        ):
            if ids:
                causes[cause] = f"servo {', '.join(map(str, sorted(ids)))}"
        for cause, words in (
            (Cause.SERVO_ERROR, inputs.servo_errors),
            (Cause.NOT_FOLLOWING, inputs.behind),
            (Cause.OUT_OF_LIMITS, inputs.outside),
            (Cause.IMPOSSIBLE_SPEED, inputs.leaps),
            (Cause.WRONG_MODE, inputs.modes),
        ):
            if words:
                causes[cause] = "; ".join(f"servo {i}: {text}" for i, text in sorted(words.items()))
        if inputs.bus_error:
            causes[Cause.BUS_ERROR] = inputs.bus_error

    def _supply(self, supply: float, causes: dict[Cause, str]) -> None:
        """Each level holds until the supply has risen above it by some more."""
        params = self._params
        if math.isfinite(supply):
            levels = (params.supply_warn, params.supply_hold, params.supply_off)
            for cause, level in zip(_SUPPLY, levels, strict=True):
                bound = level + params.supply_rise if cause in self._low else level
                (self._low.add if supply < bound else self._low.discard)(cause)
        else:
            causes[Cause.SUPPLY_UNKNOWN] = ""
        causes |= dict.fromkeys(self._low, f"{supply:.1f} V")

    def _controller(self, now: float, inputs: Inputs, decided: bool) -> dict[Cause, str]:
        """The cause in the controller, with its detail, and whether it failed too often."""
        causes: dict[Cause, str] = {}
        if inputs.failure:
            causes[Cause.FAILED] = inputs.failure
        elif not decided:
            causes[Cause.UNDECIDED] = ""
        elif inputs.maneuver not in set(Maneuver):
            causes[Cause.BAD_ACTION] = f"maneuver {inputs.maneuver}"
        elif inputs.bad_command:
            causes[Cause.BAD_COMMAND] = inputs.bad_command
        elif not {Contact.FREE, Contact.CONTACT}.issuperset(inputs.contact):
            causes[Cause.UNKNOWN_CONTACT] = ""
        if _FAILURES & causes.keys() and self._failures.add(now):
            causes[Cause.REPEATED_FAILURES] = inputs.failure or inputs.bad_command
        return causes

    def _recover(self, inputs: Inputs, present: Mapping[Cause, str]) -> None:
        """Losses of data stay until enough fresh valid samples came in a row."""
        lost = DATA & present.keys()
        self._waiting |= lost
        self._streak = 0 if lost or inputs.refused else self._streak + inputs.valid
        if self._streak >= self._params.recovery:
            self._waiting.clear()

    def _latch(self, present: Iterable[Cause]) -> None:
        """With the torque on, severe causes stay until an arm event; without it, OFF does."""
        for cause in present:
            if cause.severity is State.OFF or (
                cause.severity is State.FAULT and self.state is not State.OFF
            ):
                self._latched.add(cause)

    def _objections(self, present: Mapping[Cause, str]) -> tuple[Cause, ...]:
        against = {c for c in present if c.severity >= State.HOLD} | self._waiting
        return tuple(sorted(against - CURED_BY_ARMING, key=lambda c: (-c.severity, c.name)))

    def _rearm(self, present: dict[Cause, str]) -> None:
        for cured in CURED_BY_ARMING - {Cause.UNKNOWN_CONTACT}:
            present.pop(cured, None)
        self._latched.clear()
        for repeats in (self._holds, self._failures, self._reboots):
            repeats.clear()

    def _list(self, now: float, present: Mapping[Cause, str]) -> None:
        """Bring the list of causes up to date; each keeps the time at which it began."""
        before = self._active
        self._active = {}
        for cause in present.keys() | self._waiting | self._latched:
            old = before.get(cause)
            since = now if old is None else old.since
            detail = present.get(cause, "" if old is None else old.detail)
            self._active[cause] = Active(cause, since, detail, cause in present)

    def _settle(self, now: float) -> State:
        """The state that the most severe cause asks for; counts holds on the way."""
        state = max((c.severity for c in self._active), default=State.OK)
        begins = self.state <= State.DEGRADED and state is State.HOLD
        if begins and Cause.RELEASED not in self._active and self._holds.add(now):
            cause = Cause.REPEATED_HOLDS
            self._latched.add(cause)
            self._active[cause] = Active(cause, now, "", present=False)
            state = State.FAULT
        self.state = state
        return state


def _rank(active: Active) -> tuple[int, bool, bool, bool, float, str]:
    """The order in which causes are listed."""
    cause = active.cause
    over = cause in DATA and not active.present
    return (
        -cause.severity,
        cause in OF_CONTROLLER,
        cause not in DATA,
        over,
        active.since,
        cause.name,
    )
