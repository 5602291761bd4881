"""Decides in every tick whether the robot may walk, must hold, or is switched off.

The most severe cause in force decides. A loss of data ends after fresh samples. FAULT and OFF
end only with an arm event, once their causes are gone. Nothing here reads a clock.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping

from antennate.hardware.safety.causes import (
    CURED_BY_ARMING,
    DATA,
    OF_CONTROLLER,
    OF_FINDING,
    Active,
    Cause,
    Inputs,
    Outputs,
    State,
)
from antennate.hardware.safety.rate import RateMeter
from antennate.params.safety import SupervisorParams
from antennate.types import Contact, Maneuver

_ACTIONS = frozenset(Maneuver)
_CONTACTS = frozenset({Contact.FREE, Contact.CONTACT})
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
        """Causes in data, servos and supply, each with its detail."""
        params = self._params
        found: dict[Cause, str] = {}
        if not 0.0 <= inputs.age <= params.stale_age:
            found[Cause.STALE] = inputs.board_error or f"age {inputs.age:.3g} s"
        for side, finding, noise in zip(
            ("left", "right"), inputs.findings, inputs.noise, strict=True
        ):
            if (cause := OF_FINDING.get(finding)) is not None:
                text = f"{side} {noise}" if noise else side
                found[cause] = f"{found[cause]}, {text}" if cause in found else text
        self._boots(now, inputs, found)
        self.meter.step(now, inputs.valid)
        if self.meter.wrong:
            found[Cause.RATE] = f"{self.meter.rate:.0f} Hz"
        longest = params.longest_arming if self._arming else params.longest_pause
        if not now - self._last < longest and self._last > -math.inf:
            found[Cause.PAUSE] = f"{now - self._last:.3g} s"
        elif not now > self._last:
            found[Cause.PAUSE] = "time did not advance"
        self._servos(inputs, found)
        self._supply(inputs.supply, found)
        if inputs.objections:
            found[Cause.NOT_READY] = "; ".join(inputs.objections)
        if inputs.drift:
            found[Cause.DRIFT] = inputs.drift
        found |= {Cause.NO_RECORD: ""} if inputs.unrecorded else {}
        found |= {Cause.STOPPED: ""} if inputs.stop else {}
        found |= {Cause.RELEASED: ""} if inputs.released else {}
        return found

    def _boots(self, now: float, inputs: Inputs, found: dict[Cause, str]) -> None:
        if self._resets is not None and inputs.resets != self._resets:
            found[Cause.REBOOT] = inputs.reset_reason
            if self._reboots.add(now):
                found[Cause.REBOOT_LOOP] = inputs.reset_reason
        self._resets = inputs.resets

    def _servos(self, inputs: Inputs, found: dict[Cause, str]) -> None:
        params = self._params
        silent = [i for i, missed in inputs.missed.items() if missed >= params.silent_answers]
        late = [i for i, missed in inputs.missed.items() if missed >= params.late_answers]
        late = [i for i in late if i not in silent]
        _name(found, Cause.LATE_ANSWERS, late)
        _name(found, Cause.SILENT_SERVO, silent)
        _name(found, Cause.WATCHDOG, inputs.watchdogs)
        _name(found, Cause.DISARMED, inputs.disarmed)
        for cause, words in (
            (Cause.SERVO_ERROR, inputs.servo_errors),
            (Cause.NOT_FOLLOWING, inputs.behind),
            (Cause.OUT_OF_LIMITS, inputs.outside),
            (Cause.IMPOSSIBLE_SPEED, inputs.leaps),
            (Cause.WRONG_MODE, inputs.modes),
        ):
            if words:
                found[cause] = "; ".join(f"servo {i}: {text}" for i, text in sorted(words.items()))
        if inputs.bus_error:
            found[Cause.BUS_ERROR] = inputs.bus_error

    def _supply(self, supply: float, found: dict[Cause, str]) -> None:
        params = self._params
        if math.isfinite(supply):
            levels = (params.supply_warn, params.supply_hold, params.supply_off)
            for cause, level in zip(_SUPPLY, levels, strict=True):
                bound = level + params.supply_rise if cause in self._low else level
                (self._low.add if supply < bound else self._low.discard)(cause)
        else:
            found[Cause.SUPPLY_UNKNOWN] = ""
        found |= dict.fromkeys(self._low, f"{supply:.1f} V")

    def _controller(self, now: float, inputs: Inputs, decided: bool) -> dict[Cause, str]:
        """Causes in the controller, each with its detail."""
        found: dict[Cause, str] = {}
        if inputs.failure:
            found[Cause.FAILED] = inputs.failure
        elif not decided:
            found[Cause.UNDECIDED] = ""
        elif inputs.maneuver not in _ACTIONS:
            found[Cause.BAD_ACTION] = f"maneuver {inputs.maneuver}"
        elif inputs.bad_command:
            found[Cause.BAD_COMMAND] = inputs.bad_command
        elif not _CONTACTS.issuperset(inputs.contact):
            found[Cause.UNKNOWN_CONTACT] = ""
        failed = _FAILURES & found.keys()
        if failed and self._failures.add(now):
            found[Cause.REPEATED_FAILURES] = inputs.failure or inputs.bad_command
        return found

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


def _name(found: dict[Cause, str], cause: Cause, ids: Iterable[int]) -> None:
    """Note a cause with the servos it is about, if there are any."""
    listed = ", ".join(str(i) for i in sorted(ids))
    if listed:
        found[cause] = f"servo {listed}"
