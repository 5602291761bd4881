"""Policy files: a network of dense layers, with or without a memory, and the contract of any."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from antennate.control.policy.contract import KEY, Contract, State
from antennate.control.policy.controller import ACTION, LARGEST, OBSERVATION, require_names
from antennate.errors import BadInputError, MissingPackageError, in_one_line
from antennate.files import read_limited, write_whole
from antennate.messages import extra

OPSET = 17
Weights = NDArray[np.floating[Any]]


def write_policy(
    path: Path | str,
    contract: Contract,
    layers: Sequence[tuple[Weights, Weights]],
    mean: Weights,
    scale: Weights,
    clip: float,
    choices: Weights | None = None,
    memory: Sequence[Weights] | None = None,
) -> Path:
    """Write a network of dense layers with tanh between them, its normaliser in the graph.

    A memory in front of the layers is a gated recurrent unit (Cho et al. 2014, arXiv:1406.1078),
    with its parameters as PyTorch has them: h' = (1 - z) tanh(W_n x + b_n + r (U_n h + c_n)) + z h
    with the gates r, z = sigmoid(W x + b + U h + c).

    Args:
        path: The file.
        contract: What it was made for.
        layers: Weights, shape (outputs, inputs), and biases, shape (outputs,), of each layer.
        mean: Subtracted from an observation, shape (n,).
        scale: What it is divided by then, shape (n,).
        clip: Largest normalised number either way.
        choices: Answers to choose from, shape (outputs, k): the one with the largest score is
            given, the first of equal ones. Without them the scores are the answer.
        memory: W, U, b and c, of shapes (3 h, n), (3 h, h), (3 h,) and (3 h,), each with the rows
            of r, z and n in this order; the first layer is given h' then, and the contract names
            the state `memory`.

    Returns:
        The path.

    Raises:
        MissingPackageError: The package onnx is not installed.
    """
    onnx = _onnx()
    helper, numpy_helper, kind = onnx.helper, onnx.numpy_helper, onnx.TensorProto.FLOAT
    constants = {"mean": mean, "scale": scale, "low": np.array(-clip), "high": np.array(clip)}
    nodes = [
        helper.make_node("Sub", [OBSERVATION, "mean"], ["centred"]),
        helper.make_node("Div", ["centred", "scale"], ["scaled"]),
        helper.make_node("Clip", ["scaled", "low", "high"], ["x0" if memory is None else "seen"]),
    ]
    inputs: dict[str, tuple[int, ...]] = {OBSERVATION: (1, len(mean))}
    outputs: dict[str, tuple[int, ...]] = {ACTION: (1, len(layers[-1][1]))}
    if memory is not None:
        state = State(input="memory", output="memory_next", shape=(1, 1, memory[1].shape[1]))
        contract = contract.model_copy(update={"states": (state,)})
        inputs[state.input] = outputs[state.output] = state.shape
        constants |= _memory(memory)
        nodes += _remembering(helper, state)
    for i, (weight, bias) in enumerate(layers):
        constants |= {f"w{i}": weight, f"b{i}": bias}
        last = i == len(layers) - 1
        out = f"y{i}" if not last else ACTION if choices is None else "scores"
        nodes.append(helper.make_node("Gemm", [f"x{i}", f"w{i}", f"b{i}"], [out], transB=1))
        if not last:
            nodes.append(helper.make_node("Tanh", [out], [f"x{i + 1}"]))
    if choices is not None:
        constants["choices"] = choices
        nodes += [
            helper.make_node("ArgMax", ["scores"], ["best"], axis=1, keepdims=0),
            helper.make_node("Gather", ["choices", "best"], [ACTION], axis=0),
        ]
        outputs[ACTION] = (1, choices.shape[1])
    given, answers = (
        [helper.make_tensor_value_info(name, kind, size) for name, size in ends.items()]
        for ends in (inputs, outputs)
    )
    tensors = [
        numpy_helper.from_array(np.asarray(value, np.float32), name)
        for name, value in constants.items()
    ]
    graph = helper.make_graph(nodes, "policy", given, answers, tensors)
    imports = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(graph, opset_imports=imports, ir_version=8)
    return _save(model, contract, Path(path))


def _memory(memory: Sequence[Weights]) -> dict[str, Weights]:
    """Its parameters in the order of ONNX, which has z before r, by the names of their inputs."""
    weight, recurrent, bias, recurrent_bias = (_swapped(np.asarray(each)) for each in memory)
    biases = np.concatenate([bias, recurrent_bias])[None]
    return {"W": weight[None], "U": recurrent[None], "b and c": biases}


def _swapped(rows: Weights) -> Weights:
    """Rows of r, z and n in the order z, r and n."""
    reset, update, new = np.split(rows, 3)
    return np.concatenate([update, reset, new])


def _remembering(helper: Any, state: State) -> list[Any]:
    """From "seen", shape (1, n), and the memory to "x0", shape (1, h), and the memory after it."""
    hidden, given = state.shape[-1], ["steps", "W", "U", "b and c", "", state.input]
    shape = helper.make_node("Constant", [], ["flat"], value_ints=[1, hidden])
    axis = helper.make_node("Constant", [], ["axis"], value_ints=[0])
    steps = helper.make_node("Unsqueeze", ["seen", "axis"], ["steps"])
    unit = helper.make_node(
        "GRU", given, ["", state.output], hidden_size=hidden, linear_before_reset=1
    )
    return [shape, axis, steps, unit, helper.make_node("Reshape", [state.output, "flat"], ["x0"])]


def add_contract(path: Path | str, contract: Contract) -> Path:
    """Put a contract into an ONNX file that another exporter wrote; the path.

    Its inputs must be `observation` and those of the contract's states, its outputs `action` and
    those of the states. Weights that lie in files beside it are joined with it.

    Raises:
        BadInputError: It cannot be read, is no ONNX model, has other inputs or outputs, or is too
            large with its weights.
        MissingPackageError: The package onnx is not installed.
        OutputError: It cannot be written; the file is as it was.
    """
    onnx, path = _onnx(), Path(path)
    read_limited(path, LARGEST)
    try:
        model = onnx.load(str(path))
    except Exception as error:  # of protobuf, which the package onnx brings
        raise BadInputError(
            f"{path}: expected an ONNX model, found {in_one_line(error)}"
        ) from error
    weights = {tensor.name for tensor in model.graph.initializer}
    require_names(
        str(path),
        contract,
        [node.name for node in model.graph.input if node.name not in weights],
        [node.name for node in model.graph.output],
    )
    return _save(model, contract, path)


def _save(model: Any, contract: Contract, path: Path) -> Path:
    onnx = _onnx()
    for prop in [p for p in model.metadata_props if p.key == KEY]:
        model.metadata_props.remove(prop)
    prop = model.metadata_props.add()
    prop.key, prop.value = KEY, contract.model_dump_json()
    try:
        onnx.checker.check_model(model)
    except onnx.checker.ValidationError as error:
        raise BadInputError(
            f"{path}: expected a sound ONNX model, found {in_one_line(error)}"
        ) from error
    data = model.SerializeToString()
    if len(data) > LARGEST:
        raise BadInputError(f"{path}: expected at most {LARGEST} bytes in all, found {len(data)}")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, data, overwrite=True)
    return path


def _onnx() -> Any:
    try:
        import onnx  # large, and only for who writes policies
        import onnx.checker
        import onnx.helper
        import onnx.numpy_helper
    except ImportError:
        raise MissingPackageError(
            f"policy: expected the package onnx, found none; install it with {extra('onnx')}"
        ) from None
    return onnx
