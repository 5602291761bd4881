"""The contract of a policy: what it was made for, as one JSON value in its file.

A policy runs only where all of it holds: the same robot, rate and gait, the same observation and
action. What a robot's wiring alone differs in, ids, directions and zeros, may differ. A parameter
of the robot that the file does not name is newer than the file, and had its default.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from typing import Any, Literal

from pydantic import ValidationError, field_validator

from antennate.control.policy.interface import (
    VERSION,
    PolicyInterface,
    Quantity,
    actions,
    observations,
)
from antennate.control.readers import HARDWARE_ALONE
from antennate.errors import ConfigError
from antennate.messages import shown
from antennate.params.base import Strict
from antennate.params.control import ControlParams
from antennate.params.faults import describe
from antennate.params.gaits import GaitParams
from antennate.robots.spec import RobotSpec

KEY = "antennate"
"""Name of the metadata of a file that holds the contract."""
LARGEST_STATE = 1_000_000
"""Numbers that one recurrent state may have."""


class Entry(Strict):
    """One number of an observation or an answer, as of `Quantity`; None is no bound."""

    name: str
    unit: str
    scale: float
    low: float | None
    high: float | None


class State(Strict):
    """One recurrent state: zeros at first, and what was put out at the decision before.

    Attributes:
        input: Name of the input.
        output: Name of the output that it is taken from.
        shape: Its shape for one robot.
    """

    input: str
    output: str
    shape: tuple[int, ...]

    @field_validator("shape")
    @classmethod
    def _of_some_numbers(cls, shape: tuple[int, ...]) -> tuple[int, ...]:
        if min(shape, default=1) < 1 or math.prod(shape) > LARGEST_STATE:
            raise ValueError(
                f"expected a shape of 1 to {LARGEST_STATE} numbers, found {list(shape)}"
            )
        return shape


class Contract(Strict):
    """What a policy was made for.

    Attributes:
        version: Of the tables of observations and actions.
        interface: What it is given and what its answer means.
        rate: Control ticks a second [Hz].
        averaging_time: Length of the running mean of the readings [s].
        gait: The gait that its answers move.
        joints: Names of the joints that it moves, in order.
        robot: The robot's parameters, but those of its wiring.
        robot_hash: SHA-256 of these.
        observations, actions: Every number with unit, scale and clip, in order.
        states: Recurrent states.
        normaliser: Where observations are normalised: always in the graph.
        about: How it was trained, for who reads it.
    """

    version: Literal[1] = VERSION
    interface: PolicyInterface
    rate: float
    averaging_time: float
    gait: GaitParams
    joints: tuple[str, ...]
    robot: dict[str, Any]
    robot_hash: str
    observations: tuple[Entry, ...]
    actions: tuple[Entry, ...]
    states: tuple[State, ...] = ()
    normaliser: Literal["graph"] = "graph"
    about: str = ""


def contract_of(
    interface: PolicyInterface,
    control: ControlParams,
    robot: RobotSpec,
    states: tuple[State, ...] = (),
    about: str = "",
) -> Contract:
    """The contract of a policy that is trained so."""
    table = _robot_table(robot)
    return Contract(
        interface=interface,
        rate=control.rate,
        averaging_time=control.conditioning.averaging_time,
        gait=control.gait,
        joints=robot.joint_names,
        robot=table,
        robot_hash=_hash(table),
        observations=tuple(map(_entry, observations(interface, control, robot))),
        actions=tuple(map(_entry, actions(interface, robot))),
        states=states,
        about=about,
    )


def read_contract(text: str, where: str) -> Contract:
    """The contract of a JSON text."""
    try:
        version = json.loads(text).get("version")
    except (ValueError, AttributeError, RecursionError):
        raise ConfigError(f"{where}: expected a contract in JSON, found {shown(text)}") from None
    if version != VERSION:
        raise ConfigError(f"{where}: expected a contract of version {VERSION}, found {version!r}")
    try:
        return Contract.model_validate_json(text)
    except ValidationError as error:
        raise ConfigError(f"{where}: {describe(error, Contract)}") from None


def require_match(contract: Contract, control: ControlParams, robot: RobotSpec, where: str) -> None:
    """Check that a policy was made for this robot and control."""
    own = contract_of(contract.interface, control, robot)
    if contract.robot_hash != _hash(contract.robot):
        raise ConfigError(
            f"{where}: expected the robot's parameters with the hash {contract.robot_hash[:12]}, "
            f"found {_hash(contract.robot)[:12]}; the file was changed"
        )
    for name in ("rate", "averaging_time", "gait", "joints", "robot", "observations", "actions"):
        theirs, ours = (_plain(getattr(side, name)) for side in (contract, own))
        if name == "robot":
            theirs = _completed(theirs, _robot_table(RobotSpec()))
        what = "robot" if name in ("joints", "robot") else "setting"
        for path, expected, found in _differences(theirs, ours, name):
            raise ConfigError(
                f"{where}: made for another {what}: expected {path} {shown(expected)}, "
                f"found {shown(found)}"
            )


def _entry(quantity: Quantity) -> Entry:
    low, high = (x if math.isfinite(x) else None for x in (quantity.low, quantity.high))
    return Entry(name=quantity.name, unit=quantity.unit, scale=quantity.scale, low=low, high=high)


def _robot_table(robot: RobotSpec) -> dict[str, Any]:
    """All parameters of a robot but those that belong to its wiring."""
    table = robot.model_dump(mode="json", exclude={"imu", "meshes"})  # no policy observes them
    for path in (*HARDWARE_ALONE, "robot.legs.fastest"):
        *groups, name = path.split(".")[1:]
        group = table
        for part in groups:
            group = group[part]
        group.pop(name, None)
    return table


def _hash(table: Mapping[str, Any]) -> str:
    text = json.dumps(table, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    """Nested dictionaries and lists."""
    if isinstance(value, Strict):
        return value.model_dump(mode="json")
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value


def _completed(table: Mapping[str, Any], default: Mapping[str, Any]) -> dict[str, Any]:
    """Nested parameters, and the default of each one that their groups lack."""
    full = {**{key: v for key, v in default.items() if not isinstance(v, dict)}, **table}
    for key, value in full.items():
        if isinstance(value, dict) and isinstance(default.get(key), dict):
            full[key] = _completed(value, default[key])
    return full


def _differences(old: Any, new: Any, path: str) -> Iterator[tuple[str, Any, Any]]:
    """Where two nested values differ, and how."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys([*old, *new]):
            yield from _differences(old.get(key), new.get(key), f"{path}.{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) != len(new):
        yield f"number of {path}", len(old), len(new)
    elif isinstance(old, list) and isinstance(new, list):
        for i, pair in enumerate(zip(old, new, strict=True)):
            yield from _differences(*pair, f"{path}[{i}]")
    elif old != new:
        yield path, old, new
