"""Policy files: a network of dense layers, with or without a memory, and the contract of any."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from antennate import checks
from antennate.control.policy.contract import KEY, Contract, State
from antennate.control.policy.controller import ACTION, LARGEST, OBSERVATION, require_names
from antennate.errors import BadInputError, MissingPackageError, in_one_line
from antennate.files import read_limited, write_whole
from antennate.messages import extra

OPSET = 17
Weights = NDArray[np.floating[Any]]
_SINGLE = np.finfo(np.float32)
_MAY_BE_INFINITE = frozenset(("Add", "Clip", "Max", "Min", "Where"))
"""Operators that masks and bounds are constants of."""


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
        BadInputError: An array has another shape than the contract and the other ones say, holds
            NaN or what float32 does not hold, or `scale` or `clip` is not above 0.
        MissingPackageError: The package onnx is not installed.
    """
    onnx = _onnx()
    single = _checked(contract, layers, mean, scale, clip, choices, memory)
    helper, numpy_helper, kind = onnx.helper, onnx.numpy_helper, onnx.TensorProto.FLOAT
    (limit,) = single["clip"]
    constants = {"mean": single["mean"], "scale": single["scale"], "low": -limit, "high": limit}
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
        constants |= _memory([single[f"memory[{i}]"] for i in range(4)])
        nodes += _remembering(helper, state)
    for i in range(len(layers)):
        constants |= {f"w{i}": single[f"layers[{i}][0]"], f"b{i}": single[f"layers[{i}][1]"]}
        last = i == len(layers) - 1
        out = f"y{i}" if not last else ACTION if choices is None else "scores"
        nodes.append(helper.make_node("Gemm", [f"x{i}", f"w{i}", f"b{i}"], [out], transB=1))
        if not last:
            nodes.append(helper.make_node("Tanh", [out], [f"x{i + 1}"]))
    if choices is not None:
        constants["choices"] = single["choices"]
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
        numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()
    ]
    graph = helper.make_graph(nodes, "policy", given, answers, tensors)
    imports = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(graph, opset_imports=imports, ir_version=8)
    return _save(model, contract, Path(path))


def _checked(
    contract: Contract,
    layers: Sequence[tuple[Weights, Weights]],
    mean: Weights,
    scale: Weights,
    clip: float,
    choices: Weights | None,
    memory: Sequence[Weights] | None,
) -> dict[str, Weights]:
    """What `write_policy` is given, by name, as float32, in which the network is run."""
    width, answers = len(contract.observations), len(contract.actions)
    given: dict[str, tuple[Any, tuple[int, ...]]] = {
        "mean": (mean, (width,)),
        "scale": (scale, (width,)),
        "clip": ([clip], (1,)),
    }
    if memory is not None:
        checks.whole("number of arrays in memory", len(memory), 4, 4)
        rows, inputs, width = np.size(memory[3]), width, np.size(memory[3]) // 3
        shapes = (3 * width, inputs), (rows, width), (rows,), (3 * width,)
        given |= {f"memory[{i}]": (memory[i], shape) for i, shape in enumerate(shapes)}
    checks.whole("number of layers", len(layers), 1)
    for i, (weight, bias) in enumerate(layers):
        last = i == len(layers) - 1 and choices is None
        inputs, width = width, answers if last else np.size(bias)
        given |= {f"layers[{i}][0]": (weight, (width, inputs)), f"layers[{i}][1]": (bias, (width,))}
    if choices is not None:
        given["choices"] = choices, (width, answers)
    return {name: _single(name, *each) for name, each in given.items()}


def _single(name: str, value: Any, shape: tuple[int, ...]) -> Weights:
    """An array as float32, above 0 if it divides or bounds."""
    numbers = checks.array(name, value, shape, error=BadInputError)
    with np.errstate(over="ignore"):
        single = numbers.astype(np.float32)
    bad, wanted = ~np.isfinite(single), f"numbers up to {_SINGLE.max:.1e} either way"
    if name in ("scale", "clip"):
        bad, wanted = bad | (single < _SINGLE.tiny), f"{_SINGLE.tiny:.1e} to {_SINGLE.max:.1e}"
    if bad.any():
        place = np.argwhere(bad)[0].tolist()
        raise BadInputError(
            f"{name}: expected {wanted}, as float32 has them, found {numbers[bad][0]:g} at {place}"
        )
    return single


def _memory(memory: Sequence[Weights]) -> dict[str, Weights]:
    """Parameters of the memory by the names of their inputs, in the order of ONNX: z before r."""
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
        BadInputError: It cannot be read, is no ONNX model, has other inputs or outputs, a constant
            that holds NaN, is infinite or divides by 0, or is too large with its weights.
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
    _require_numbers(model, path)
    return _save(model, contract, path)


def _require_numbers(model: Any, path: Path) -> None:
    """Check the constants that a network is made of."""
    users = {
        (name, f"{node.op_type} {place}" if node.op_type == "Div" else node.op_type)
        for node in model.graph.node
        for place, name in enumerate(node.input)
    }
    for tensor in model.graph.initializer:
        values = _onnx().numpy_helper.to_array(tensor)
        bad = np.zeros(values.shape, bool)
        if values.dtype.kind == "f":
            of = [user for name, user in users if name == tensor.name]
            bad = np.isnan(values) | (np.isinf(values) & (not _MAY_BE_INFINITE.issuperset(of)))
            bad |= (values == 0.0) & ("Div 1" in of)
        if bad.any():
            raise BadInputError(
                f"{path}: {tensor.name}: expected finite numbers, and none of 0 that divides, "
                f"found {values[bad][0]:g}"
            )


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
