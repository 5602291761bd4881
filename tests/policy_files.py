"""Small policies as files, for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import helper as h

from antennate.control.policy.contract import Contract, State, contract_of
from antennate.control.policy.interface import PolicyInterface
from antennate.control.policy.writer import add_contract, write_policy
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec

FORWARD = (5.0, 0.0, 0.0, 0.0)


def contract(**interface: Any) -> Contract:
    """The contract of a policy for the default robot."""
    return contract_of(PolicyInterface(**interface), ControlParams(), RobotSpec())


def constant(path: Path, answer: tuple[float, ...], made: Contract | None = None) -> Path:
    """A policy that always answers the same."""
    made = made or contract()
    size = len(made.observations)
    layers = [(np.zeros((len(answer), size)), np.array(answer))]
    return write_policy(path, made, layers, np.zeros(size), np.ones(size), clip=10.0)


def drawn(path: Path, made: Contract, seed: int = 0) -> tuple[Path, dict[str, Any]]:
    """A policy of two layers with numbers drawn at random, and these numbers."""
    rng, size, k = np.random.default_rng(seed), len(made.observations), len(made.actions)
    layers = [
        (rng.normal(0.0, 0.4, (16, size)), rng.normal(size=16)),
        (rng.normal(size=(k, 16)), rng.normal(size=k)),
    ]
    parts = {"layers": layers, "mean": rng.normal(size=size), "scale": rng.uniform(0.2, 3.0, size)}
    return write_policy(path, made, clip=10.0, **parts), parts


def counting(path: Path) -> Path:
    """A policy with a state: FORWARD three times, then TURN_L as often as it is asked."""
    nodes = [
        h.make_node("Mul", ["n", "go"], ["turn"]),
        h.make_node("Add", ["turn", "stay"], ["action"]),
    ]
    return _with_state(path, {"stay": [[2.5, 0, 0, 0]], "go": [[0, 1.0, 0, 0]]}, nodes)


def failing(path: Path) -> Path:
    """A policy that says FORWARD three times, and from then on the root of a negative number."""
    nodes = [
        h.make_node("Sub", ["most", "n"], ["left"]),
        h.make_node("Sqrt", ["left"], ["action"]),
    ]
    return _with_state(path, {"most": [[2.5, 2.4, 2.4, 2.4]]}, nodes)


def _with_state(path: Path, more: dict[str, Any], ends: list[Any]) -> Path:
    """A policy that counts its decisions in n, with constants and nodes for its answer."""
    made = contract()
    made = made.model_copy(update={"states": (State(input="n", output="m", shape=(1, 1)),)})
    real = onnx.TensorProto.FLOAT
    constants = {"one": [[1.0]], **more}
    tensors = [
        onnx.numpy_helper.from_array(np.array(value, np.float32), name)
        for name, value in constants.items()
    ]
    nodes = [h.make_node("Add", ["n", "one"], ["m"]), *ends]
    info = h.make_tensor_value_info
    given = [info("observation", real, [1, len(made.observations)]), info("n", real, [1, 1])]
    put = [info("action", real, [1, 4]), info("m", real, [1, 1])]
    graph = h.make_graph(nodes, "counting", given, put, tensors)
    model = h.make_model(graph, opset_imports=[h.make_opsetid("", 17)], ir_version=8)
    path.write_bytes(model.SerializeToString())
    return add_contract(path, made)
