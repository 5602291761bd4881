"""A policy file as a controller: FILE.onnx wherever a controller is named."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from antennate.control.conditioning import ContactState, curves, level_and_fraction
from antennate.control.policy.actors import make_actor
from antennate.control.policy.contract import KEY, Contract, read_contract, require_match
from antennate.control.policy.interface import actions
from antennate.control.policy.observer import Observer, Vector
from antennate.errors import ConfigError, ControllerError, MissingPackageError, in_one_line
from antennate.files import read_limited
from antennate.messages import extra, shown
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec, require_antennae
from antennate.types import AntennaFrame, Bools, Contact, Floats, Ints, JointCommand, Maneuver

LARGEST = 50_000_000
"""Most bytes of a policy file."""
OBSERVATION, ACTION = "observation", "action"
"""Names of the input and the output of a policy."""


def require_names(
    place: str, contract: Contract, inputs: Sequence[str], outputs: Sequence[str]
) -> None:
    """Check what a network takes and answers."""
    states = contract.states
    for kind, wanted, names in (
        ("inputs", [OBSERVATION, *(s.input for s in states)], inputs),
        ("outputs", [ACTION, *(s.output for s in states)], outputs),
    ):
        if sorted(names) != sorted(wanted):
            actual = ", ".join(names) or "none"
            raise ConfigError(f"{place}: expected the {kind} {', '.join(wanted)}, found {actual}")


def _trials(contract: Contract) -> dict[str, Vector]:
    """Observations that a policy is tried with, shape (1, n), by what they are."""
    ends = [(e.low or 0.0, e.high or 0.0) for e in contract.observations]
    chance = np.random.default_rng(0).random(len(ends))
    drawn = [[low + part * (high - low) for (low, high), part in zip(ends, chance, strict=True)]]
    with np.errstate(over="ignore"):
        return {
            f"{len(ends)} zeros": np.zeros((1, len(ends)), np.float32),
            "an observation of chance": np.array(drawn, np.float32),
        }


class Policy:
    """A policy file: its contract, and its network for one robot at a time.

    Rows of a batch are asked one by one, so that none changes the last bits of another.

    Args:
        path: The file.

    Attributes:
        contract: What it was made for.
    """

    def __init__(self, path: Path) -> None:
        try:
            import onnxruntime as ort  # large, and only policies need it
        except ImportError:
            raise MissingPackageError(
                f"controller: expected the package onnxruntime for {path}, found none; install it "
                f"with {extra('onnx')}"
            ) from None
        data = read_limited(path, LARGEST, ConfigError)
        options: Any = ort.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4
        try:
            self._session: Any = ort.InferenceSession(data, options, ["CPUExecutionProvider"])
        except Exception as error:
            reason = in_one_line(error)
            apart = "external data" in reason.lower() or "model_path" in reason
            hint = "; weights that lie in another file are joined by add_contract" if apart else ""
            raise ConfigError(f"{path}: expected an ONNX model, found {reason}{hint}") from error
        text = self._session.get_modelmeta().custom_metadata_map.get(KEY)
        if text is None:
            raise ConfigError(
                f"{path}: expected a policy with a contract in its metadata {KEY!r}, found none"
            )
        self.contract: Contract = read_contract(text, str(path))
        inputs, outputs = self._session.get_inputs(), self._session.get_outputs()
        require_names(
            str(path), self.contract, [node.name for node in inputs], [n.name for n in outputs]
        )
        takes = ", ".join(f"{node.name} as {node.type} {node.shape}" for node in inputs)
        self._try(path, takes)

    def _try(self, path: Path, takes: str) -> None:
        """Ask for the answers to zeros, then to an observation of chance within its bounds."""
        size, states = len(self.contract.observations), self.start()
        for what, observation in _trials(self.contract).items():
            try:
                answer, states = self.answer(observation, states)
            except ControllerError as error:
                raise ConfigError(
                    f"{path}: expected an answer to {what}, as float32 of shape (1, {size}), "
                    f"found {error}; it takes {takes}"
                ) from None
            self._require_sound(path, what, answer, states)

    def _require_sound(
        self, path: Path, what: str, answer: Floats, states: dict[str, Vector]
    ) -> None:
        """Check an answer and the states after it."""
        if answer.shape != (1, len(self.contract.actions)):
            raise ConfigError(
                f"{path}: expected {ACTION} of shape (1, {len(self.contract.actions)}), found "
                f"{answer.shape}"
            )
        for state in self.contract.states:
            after = states[state.input]
            if (after.dtype, after.shape) != (np.float32, state.shape):
                raise ConfigError(
                    f"{path}: expected {state.output} as float32 of shape {state.shape}, found "
                    f"{after.dtype} of shape {after.shape}"
                )
        names = {s.output: states[s.input] for s in self.contract.states}
        for name, numbers in {ACTION: answer, **names}.items():
            if (bad := numbers[~np.isfinite(numbers)]).size:
                raise ConfigError(
                    f"{path}: expected finite numbers as {name} for {what}, found {bad[0]}; its "
                    "weights or its normaliser are broken"
                )

    def start(self) -> dict[str, Vector]:
        """The recurrent states of a robot that begins, by input."""
        return {s.input: np.zeros(s.shape, np.float32) for s in self.contract.states}

    def answer(
        self, observation: Vector, states: dict[str, Vector]
    ) -> tuple[Floats, dict[str, Vector]]:
        """The answer for one robot, shape (1, k), and its states from then on."""
        outputs = [ACTION, *(s.output for s in self.contract.states)]
        try:
            answer, *after = self._session.run(outputs, {OBSERVATION: observation, **states})
            answer = np.asarray(answer, float)  # others than tensors come out, too
        except Exception as error:
            raise ControllerError(f"the policy failed: {in_one_line(error)}") from error
        names = [s.input for s in self.contract.states]
        return answer, dict(zip(names, after, strict=True))


class PolicyController:
    """Control of B robots by a policy.

    Args:
        policy: Decides.
        control: All numbers of the control.
        robot: The robot.
        batch: Number of robots B.
        where: The file, for messages.

    Attributes:
        level: Bending levels b of the last step, shape (B, 2).
        contact: `Contact` of the last step, shape (B, 2).
        maneuver: The `Maneuver` nearest to what was done, shape (B,); HOLD of an answer that is no
            number, and where a reading is UNKNOWN.
        fastest_gait: Fastest gait by which it may walk [Hz]; 0 where its answers move the joints
            themselves, and legs no faster than their `fastest`.
        void_decisions: Decisions since the reset whose answer was no number, shape (B,).
    """

    def __init__(
        self, policy: Policy, control: ControlParams, robot: RobotSpec, batch: int, where: str
    ) -> None:
        require_antennae(robot, "this controller")
        require_match(policy.contract, control, robot, where)
        interface = policy.contract.interface
        self._policy, self._ticks = policy, interface.ticks
        self.fastest_gait = interface.fastest_gait(control.gait.frequency)
        self._curves = curves(control)
        self._observer = Observer(interface, control, robot, batch)
        self._actor = make_actor(interface, control, robot, batch)
        self._contacts = ContactState(control.rule, batch)
        self._answers: Floats = np.zeros((batch, len(actions(interface, robot))))
        self._states = [policy.start() for _ in range(batch)]
        self._count: Ints = np.zeros(batch, np.int64)
        self._begun: Bools = np.zeros(batch, dtype=bool)
        self.void_decisions: Ints = np.zeros(batch, np.int64)
        self.level: Floats = np.zeros((batch, 2))
        self.contact: Ints = np.full((batch, 2), int(Contact.FREE))
        self.maneuver: Ints = np.full(batch, int(Maneuver.FORWARD))
        self.reset(np.arange(batch))

    @property
    def phase(self) -> Floats:
        """Gait phase [rad], shape (B,)."""
        return self._actor.phase

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Forget everything about some rows and start their gait at `phase` [rad]."""
        self._observer.reset(rows)
        self._actor.reset(rows, phase)
        self._contacts.reset(rows)
        self._count[rows], self._begun[rows], self.void_decisions[rows] = 0, False, 0
        for row in np.arange(len(self._count))[rows].tolist():
            self._states[row] = self._policy.start()

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the command for this frame, both with B rows.

        A row holds, and nothing of its policy begins, until its first reading that can be used.
        """
        self._observer.feel(frame)
        self.level, _ = level_and_fraction(self._curves, self._observer.mean)
        self.contact = self._contacts.step(self.level)
        self._begun |= ~self._observer.unknown
        due = self._begun & (self._count % self._ticks == 0)
        if due.any():
            self._decide(due)
        self._count += self._begun
        command = self._actor.step(self._observer.unknown)
        self._observer.told(command)
        self.maneuver = self._actor.maneuver.astype(np.int64)
        return command

    def _decide(self, rows: Bools) -> None:
        """Ask the policy for some rows."""
        observations = self._observer.look(self._actor, rows)
        for row in np.flatnonzero(rows).tolist():
            answer, self._states[row] = self._policy.answer(
                observations[row : row + 1], self._states[row]
            )
            self._answers[row] = answer[0]
        self._actor.decide(self._answers, rows)
        self.void_decisions += rows & ~np.isfinite(self._answers).all(axis=1)


def policy_factory(name: str) -> Callable[[ControlParams, RobotSpec, int], PolicyController]:
    """What makes controllers of a policy file."""
    path = Path(name)
    if not path.is_file():
        raise ConfigError(f"expected a policy file, found no file {shown(name)}")

    def make(control: ControlParams, robot: RobotSpec, batch: int) -> PolicyController:
        return PolicyController(Policy(path), control, robot, batch, name)

    return make
