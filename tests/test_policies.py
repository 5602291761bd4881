"""Policy files as controllers: what they are given, where they run, and what is refused."""

from __future__ import annotations

import csv
import hashlib
import json
import math
import resource
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from pages import blocks
from policy_files import FORWARD, constant, contract, counting, drawn, failing
from recorded import recorded
from twin_rig import Driven

from antennate.cli import main, viewer
from antennate.control.policy.actors import make_actor
from antennate.control.policy.contract import Contract, contract_of, require_match
from antennate.control.policy.controller import Policy
from antennate.control.policy.interface import PolicyInterface, Quantity, actions, observations
from antennate.control.policy.writer import add_contract, write_policy
from antennate.control.readers import UNREAD_BY_POLICIES
from antennate.control.registry import make_controller
from antennate.errors import BadInputError, ConfigError, OutputError
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.params.control import ControlParams
from antennate.params.gaits import GaitParams
from antennate.robots.spec import RobotSpec
from antennate.testing import check_controller
from antennate.types import AntennaFrame, Maneuver, State
from antennate_lab.compete.episodes import Draw, run_episodes
from antennate_lab.compete.page import sentence
from antennate_lab.compete.standings import standing

MODES = ("maneuver", "gait", "joints")


def trials_of(path: Path, batch: int = 3, **config: Any) -> list[TrialResult]:
    """Rows of short trials in order."""
    values = {"time_limit": 2.0, "seed": 3, **config}
    rows: list[TrialResult] = []
    made = TunnelConfig.model_validate({"controllers": [str(path)], **values})
    run_trials(made, str(path), range(3), lambda result: rows.append(result[0]), batch)
    return sorted(rows, key=lambda row: row.trial)


def actions_of(mode: str) -> tuple[Quantity, ...]:
    return actions(PolicyInterface.model_validate({"action": mode}), RobotSpec())


def frame(t: float, counts: float, batch: int = 1) -> AntennaFrame:
    return AntennaFrame(np.full(batch, t), np.full((batch, 2), counts))


# the network


@pytest.mark.parametrize("mode", MODES)
def test_a_file_answers_as_its_layers_do(tmp_path: Path, mode: str) -> None:
    path, parts = drawn(tmp_path / "p.onnx", contract(action=mode))
    policy = Policy(path)
    x = np.random.default_rng(1).normal(0.0, 3.0, (20, len(parts["mean"])))
    (w, b), (v, c) = parts["layers"]
    hidden = np.tanh(np.clip((x - parts["mean"]) / parts["scale"], -10.0, 10.0) @ w.T + b)
    answers = [policy.answer(row[None].astype(np.float32), {})[0][0] for row in x]
    assert np.abs(np.array(answers) - (hidden @ v.T + c)).max() < 1e-4


def test_a_file_with_a_memory_answers_as_its_equations_do(tmp_path: Path) -> None:
    """Those of the gated recurrent unit, over 30 decisions: h decides what is told."""
    rng, made, h = np.random.default_rng(3), contract(), 5
    size = len(made.observations)
    shapes = (3 * h, size), (3 * h, h), 3 * h, 3 * h
    w, u, b, c = memory = [rng.normal(0.0, 0.3, shape) for shape in shapes]
    layers = [(rng.normal(size=(4, h)), rng.normal(size=4))]
    parts = {"mean": np.zeros(size), "scale": np.ones(size), "clip": 10.0, "memory": memory}
    policy = Policy(write_policy(tmp_path / "p.onnx", made, layers, **parts))
    states, now = policy.start(), np.zeros(h)
    for x in rng.normal(0.0, 0.3, (30, size)):
        given, kept = np.split(w @ x + b, 3), np.split(u @ now + c, 3)
        reset, update = (1.0 / (1.0 + np.exp(-given[i] - kept[i])) for i in range(2))
        now = (1.0 - update) * np.tanh(given[2] + reset * kept[2]) + update * now
        answer, states = policy.answer(x[None].astype(np.float32), states)
        assert np.abs(answer[0] - (layers[0][0] @ now + layers[0][1])).max() < 1e-5
    alone = policy.answer(x[None].astype(np.float32), policy.start())[0]
    assert np.abs(alone - answer).max() > 0.01  # what was before matters


def test_the_contract_is_one_json_value_at_full_precision(tmp_path: Path) -> None:
    robot = RobotSpec(mass=2.0 + 1e-15, link_pitch=0.1 + 0.2 / 7)
    made = contract_of(PolicyInterface(memory_time=1 / 3), ControlParams(), robot, about="x")
    path = constant(tmp_path / "p.onnx", FORWARD, made)
    read = Policy(path).contract
    assert read == made
    assert read.robot["link_pitch"] == robot.link_pitch
    table = json.loads(made.model_dump_json())
    assert {"version", "rate", "robot_hash", "joints", "observations"} <= set(table)
    assert [q["name"] for q in table["observations"][:2]] == ["flex_l 0 s", "flex_l -0.1 s"]


@pytest.mark.parametrize("mode", MODES)
def test_names_are_different_and_have_units(mode: str) -> None:
    interface, robot = PolicyInterface(action=mode), RobotSpec()
    for table in (observations(interface, ControlParams(), robot), actions(interface, robot)):
        assert len({q.name for q in table}) == len(table)
        assert all(q.unit and q.scale > 0 and q.low < q.high for q in table)


# control


def test_a_policy_that_chooses_gives_the_answer_with_the_largest_score(tmp_path: Path) -> None:
    rng, made = np.random.default_rng(4), contract(action="gait")
    size, table = len(made.observations), np.arange(20.0).reshape(5, 4)
    layers = [(rng.normal(size=(5, size)), np.zeros(5))]
    parts = {"mean": np.zeros(size), "scale": np.ones(size), "clip": 10.0, "choices": table}
    policy = Policy(write_policy(tmp_path / "p.onnx", made, layers, **parts))
    x = rng.normal(size=(20, size)).astype(np.float32)
    answers = np.concatenate([policy.answer(row[None], {})[0] for row in x])
    best = np.argmax(x @ layers[0][0].T, axis=1)
    assert len(set(best.tolist())) > 2
    assert (answers == table[best]).all()


def test_a_policy_of_the_gait_sweeps_the_antenna_bases_and_holds_them() -> None:
    """A sin(2 pi f t) of the gait, while the robot moves; rows that hold keep theirs."""
    control = ControlParams(gait=GaitParams(antenna_amplitude=0.3, antenna_frequency=0.5))
    actor = make_actor(PolicyInterface(action="gait"), control, RobotSpec(), 2)
    actor.reset(np.array([0, 1]))
    actor.decide(np.zeros((2, 4)), np.array([True, True]))
    for hold in [False] * 50 + [True] * 25:
        command = actor.step(np.array([hold, False]))
    found = command.antenna - control.gait.antenna_mean
    assert np.abs(found[0] - 0.3 * math.sin(math.pi * 0.50)).max() < 1e-9
    assert np.abs(found[1] - 0.3 * math.sin(math.pi * 0.75)).max() < 1e-9


@pytest.mark.parametrize("mode", MODES)
def test_it_keeps_the_protocol_of_controllers(tmp_path: Path, mode: str) -> None:
    made = contract(action=mode, servos=mode == "gait")
    path, _ = drawn(tmp_path / "p.onnx", made)
    check_controller(lambda c, r, b: make_controller(str(path), c, r, b))


def test_it_walks_as_open_does_where_it_always_says_forward(tmp_path: Path) -> None:
    path = constant(tmp_path / "p.onnx", FORWARD)
    rows: list[TrialResult] = []
    config = TunnelConfig(time_limit=2.0, seed=3)
    run_trials(config, "open", range(3), lambda result: rows.append(result[0]))
    want = {(r.trial, r.progress_m, r.time_s, r.force_mean_n) for r in rows}
    assert {(r.trial, r.progress_m, r.time_s, r.force_mean_n) for r in trials_of(path)} == want


@pytest.mark.parametrize("mode", MODES)
def test_rows_do_not_influence_one_another(tmp_path: Path, mode: str) -> None:
    path, _ = drawn(tmp_path / "p.onnx", contract(action=mode, ticks=7, servos=True))
    assert trials_of(path, batch=3) == trials_of(path, batch=1)


def test_an_answer_that_is_no_number_is_hold(tmp_path: Path) -> None:
    control, ticks = make_controller(str(failing(tmp_path / "p.onnx"))), PolicyInterface().ticks
    control.reset(np.array([0]), 1.0)
    yaw = []
    for tick in range(3 * ticks + 2):
        yaw.append(control.step(frame(0.01 * tick, 1800.0)).yaw)
        held = tick >= 3 * ticks
        assert control.maneuver.tolist() == [Maneuver.HOLD if held else Maneuver.FORWARD]
    assert np.array_equal(yaw[-1], yaw[-2])
    assert not np.array_equal(yaw[0], yaw[1])


@pytest.mark.ci
def test_tunnel_says_in_how_many_decisions_the_answer_was_no_number(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Decisions fall at 0, 0.1, ... 2 s: 21 in a trial of 2 s, of which three are FORWARD."""
    monkeypatch.chdir(tmp_path)
    failing(Path("p.onnx"))
    words = ["--trials", "2", "--time-limit", "2", "--workers", "1", "--out", "run"]
    assert main(["tunnel", "--controllers", "open", "p.onnx", *words]) == 0
    said = capsys.readouterr().out
    assert "Decisions whose answer was no number, so that the robot held: p.onnx 36." in said
    result = json.loads(Path("run/result.json").read_text())["controllers"]
    assert {name: row["void_decisions"] for name, row in result.items()} == {
        "open": 0,
        "p.onnx": 36,
    }
    rows = [*csv.DictReader(Path("run/trials.csv").read_text().splitlines())]
    assert [row["void_decisions"] for row in rows] == ["0", "0", "18", "18"]


@pytest.mark.ci
def test_compete_says_in_how_many_decisions_the_answer_was_no_number(tmp_path: Path) -> None:
    """Of 100 s, in which the robot leaves nothing and reaches nothing, 1001 less three."""
    path = str(failing(tmp_path / "p.onnx"))
    rows: list[Any] = []
    run_episodes([(Draw(path, "flat", 5, 0, 1.0),)], lambda place, row: rows.append(row))
    assert [(row.outcome, row.void_decisions) for row in rows] == [("timeout", 998)]
    said = sentence(standing(rows, 0.0))
    assert said.endswith(
        "Decisions whose answer was no number, so that the robot held: p.onnx 998."
    )


def test_drive_says_in_how_many_decisions_the_answer_was_no_number(tmp_path: Path) -> None:
    path = str(failing(tmp_path / "p.onnx"))
    driven = Driven(path, 4.0)
    result = driven.report.result(driven.session)
    held = [maneuver == Maneuver.HOLD for maneuver in driven.maneuvers]
    last = held[::-1].index(False)  # ticks since it walked, ten to a decision
    assert result["void_decisions"] == math.ceil(last / 10) > 5
    head = {"controller": path, "armed": True}
    said = viewer.sentences(head | result).splitlines()
    told = f"Decisions whose answer was no number, so that the robot held: `{path}` "
    assert f"{told}{result['void_decisions']}." in said


def test_a_reading_that_cannot_be_used_is_hold(tmp_path: Path) -> None:
    control = make_controller(str(constant(tmp_path / "p.onnx", FORWARD)))
    control.reset(np.array([0]), 0.0)
    control.step(frame(0.0, 1800.0))
    assert control.maneuver.tolist() == [Maneuver.FORWARD]
    control.step(frame(0.01, np.nan))
    assert control.maneuver.tolist() == [Maneuver.HOLD]


def test_a_recurrent_state_is_kept_and_forgotten_at_a_reset(tmp_path: Path) -> None:
    """The scores are (2.5, n, 0, 0) with n the decisions so far: TURN_L from n = 3 on."""
    control = make_controller(str(counting(tmp_path / "p.onnx")), batch=2)
    control.reset(np.arange(2), 0.0)
    ticks = PolicyInterface().ticks
    said = []
    for tick in range(6 * ticks):
        if tick == 4 * ticks:
            control.reset(np.array([1]), 0.0)
        control.step(frame(0.01 * tick, 1800.0, batch=2))
        if tick % ticks == 0:
            said.append(control.maneuver.tolist())
    ahead, left = int(Maneuver.FORWARD), int(Maneuver.TURN_L)
    assert said == [[ahead] * 2] * 3 + [[left] * 2] + [[left, ahead]] * 2


def test_nothing_begins_before_the_first_reading_that_can_be_used(tmp_path: Path) -> None:
    """A dry run without readings is no past of a policy: its decisions are counted from then on."""
    control, ticks = make_controller(str(counting(tmp_path / "p.onnx"))), PolicyInterface().ticks
    control.reset(np.array([0]), 0.0)
    said, blind = [], 5 * ticks + 3
    for tick in range(blind + 7 * ticks):
        control.step(frame(0.01 * tick, np.nan if tick < blind else 1800.0))
        said.append(int(control.maneuver[0]))
    assert set(said[:blind]) == {Maneuver.HOLD}
    walked = [maneuver for maneuver in said if maneuver != Maneuver.HOLD]
    assert walked[: 3 * ticks] == [Maneuver.FORWARD] * 3 * ticks
    assert set(walked[3 * ticks :]) == {Maneuver.TURN_L}


def test_it_drives_the_twin_behind_the_supervisor(tmp_path: Path) -> None:
    path = constant(tmp_path / "p.onnx", (0.0, 0.0, 5.0, 0.0), contract(servos=True))
    driven = Driven(str(path))
    report, maneuvers = driven.report, driven.maneuvers
    assert report.worst < State.HOLD, report.why
    assert set(maneuvers[-200:]) == {Maneuver.TURN_R}


@pytest.mark.ci
def test_its_log_replays_bit_for_bit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    drawn(Path("p.onnx"), contract(action="gait", servos=True))
    words = ["--trials", "1", "--time-limit", "2", "--workers", "1", "--log", "--out", "run"]
    assert main(["tunnel", "--controllers", "p.onnx", *words]) == 0
    capsys.readouterr()
    log = "run/logs/p.onnx-0.mcap"
    assert main(["log", "replay", log, "--controller", "p.onnx", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["ticks"] > 150
    assert (said["different"], said["different_commands"]) == (0, 0)


# what is refused


def wrong(path: Path, **changes: Any) -> Path:
    made = contract().model_copy(update=changes)
    return constant(path, FORWARD, made)


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--robot.link-pitch", "0.13"], ("robot.link_pitch 0.12", "found 0.13")),
        (["--control.rate", "50"], ("rate 100.0", "found 50.0")),
        (["--control.gait.frequency", "0.5"], ("gait.frequency 0.6", "found 0.5")),
    ],
)
def test_what_it_was_not_made_for_is_refused_before_the_first_trial(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], flags: list[str], words: tuple[str, ...]
) -> None:
    path = constant(tmp_path / "p.onnx", FORWARD)
    assert main(["tunnel", "--controllers", str(path), *flags, "--out", str(tmp_path / "r")]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert all(word in line for word in words), line
    assert not (tmp_path / "r").exists()


@pytest.mark.parametrize("mode", MODES)
def test_a_policy_reads_none_of_what_it_is_said_not_to_read(tmp_path: Path, mode: str) -> None:
    path = constant(tmp_path / "p.onnx", (0.5,) * len(actions_of(mode)), contract(action=mode))
    control = ControlParams()
    with recorded(control) as read:
        controller = make_controller(str(path), control)
        for tick in range(30):
            controller.step(frame(0.01 * tick, 2000.0))
    assert "rule.threshold" in read
    assert not read & set(UNREAD_BY_POLICIES)


@pytest.mark.parametrize("name", ["search.patience", "rule.strong", "timed.walk_time"])
def test_a_parameter_that_no_policy_reads_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    path = constant(tmp_path / "p.onnx", FORWARD)
    flag = f"--control.{name.replace('_', '-')}"
    assert main(["tunnel", "--controllers", str(path), flag, "0.9"]) == 2
    said = capsys.readouterr().err
    assert f"{flag}: expected a parameter that is read" in said
    assert f"but {path} does not read it" in said


def test_other_ids_and_directions_are_no_other_robot(tmp_path: Path) -> None:
    robot = RobotSpec()
    ids = tuple(range(101, 101 + robot.yaw_count))
    other = robot.model_copy(update={"yaw": robot.yaw.model_copy(update={"ids": ids})})
    require_match(contract(), ControlParams(), other, "p.onnx")


def with_robot(made: Contract, table: dict[str, Any]) -> Contract:
    """The contract of a file that names these parameters of its robot."""
    text = json.dumps(table, sort_keys=True, separators=(",", ":"))
    new = {"robot": table, "robot_hash": hashlib.sha256(text.encode()).hexdigest()}
    return made.model_copy(update=new)


def test_a_parameter_that_is_newer_than_the_file_had_its_default() -> None:
    made = contract()
    table = made.model_dump()["robot"]
    del table["antenna"]["sensor"]["outlier_share"]
    made = with_robot(made, table)
    require_match(made, ControlParams(), RobotSpec(), "p.onnx")
    other = RobotSpec.model_validate({"antenna": {"sensor": {"outlier_share": 0.25}}})
    with pytest.raises(ConfigError, match=r"sensor.outlier_share 0\.\d+, found 0.25"):
        require_match(made, ControlParams(), other, "p.onnx")


def test_a_parameter_that_is_no_longer_there_is_refused() -> None:
    made = contract()
    made = with_robot(made, made.model_dump()["robot"] | {"tail": 1})
    with pytest.raises(ConfigError, match=r"robot.tail 1, found None"):
        require_match(made, ControlParams(), RobotSpec(), "p.onnx")


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"observations": contract(history=31).observations}, "observations"),
        ({"actions": contract(action="gait").actions}, "actions"),
        ({"robot_hash": "0" * 64}, "hash"),
    ],
)
def test_a_contract_that_contradicts_itself_is_refused(change: Any, word: str) -> None:
    made: Contract = contract().model_copy(update=change)
    with pytest.raises(ConfigError, match=word):
        require_match(made, ControlParams(), RobotSpec(), "p.onnx")


def test_files_that_are_no_policy_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = constant(tmp_path / "good.onnx", FORWARD)
    model = onnx.load(str(path))
    del model.metadata_props[:]
    (tmp_path / "bare.onnx").write_bytes(model.SerializeToString())
    (tmp_path / "text.onnx").write_text("no model")
    short = onnx.load(str(path))
    for tensor in short.graph.initializer:
        if tensor.name in ("w0", "b0"):
            three = onnx.numpy_helper.to_array(tensor)[:3]
            tensor.CopyFrom(onnx.numpy_helper.from_array(three, tensor.name))
    short.graph.output[0].type.tensor_type.shape.dim[1].dim_value = 3
    (tmp_path / "size.onnx").write_bytes(short.SerializeToString())
    old = json.loads(contract().model_dump_json()) | {"version": 2}
    model.metadata_props.add(key="antennate", value=json.dumps(old))
    (tmp_path / "new.onnx").write_bytes(model.SerializeToString())
    for name, shape in {
        "less": [-1, 1],
        "much": [10**6, 2],
        "other": [1, 2],
        "real": [1, 1],
    }.items():
        model = onnx.load(str(counting(tmp_path / "state.onnx")))
        found = json.loads(model.metadata_props[0].value)
        found["states"][0]["shape"] = shape
        model.metadata_props[0].value = json.dumps(found)
        model.graph.input[1].type.tensor_type.shape.dim[1].dim_param = "any"
        model.graph.output[1].type.tensor_type.shape.dim[1].dim_param = "some"
        if name == "other":  # a sum that has one column whatever it is given
            axes = onnx.numpy_helper.from_array(np.array([1], np.int64), "axes")
            model.graph.initializer.append(axes)
            total = onnx.helper.make_node("ReduceSum", ["n", "axes"], ["sum"], keepdims=1)
            model.graph.node.insert(0, total)
            for node in model.graph.node[1:]:
                node.input[:] = ["sum" if each == "n" else each for each in node.input]
        if name == "real":  # a state that comes back as other numbers than it is given
            (last,) = (node for node in model.graph.node if "m" in node.output)
            last.output[:] = ["single" if each == "m" else each for each in last.output]
            double = onnx.TensorProto.DOUBLE
            model.graph.node.append(onnx.helper.make_node("Cast", ["single"], ["m"], to=double))
            model.graph.output[1].type.tensor_type.elem_type = double
        (tmp_path / f"{name}.onnx").write_bytes(model.SerializeToString())
    for name, words in {
        "real": "expected m as float32 of shape (1, 1), found float64 of shape (1, 1)",
        "less": "states[0].shape: expected a shape of 1 to 1000000 numbers, found [-1, 1]",
        "much": "states[0].shape: expected a shape of 1 to 1000000 numbers, found [1000000, 2]",
        "other": "expected m as float32 of shape (1, 2), found float32 of shape (1, 1)",
        "bare": "expected a policy with a contract",
        "text": "expected an ONNX model",
        "size": "expected action of shape (1, 4), found (1, 3)",
        "new": "expected a contract of version 1, found 2",
        "none": "found no file",
    }.items():
        argv = ["--controllers", str(tmp_path / f"{name}.onnx"), "--out", str(tmp_path / "run")]
        assert main(["tunnel", *argv]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert words in line


BROKEN = {
    "scale[3]": (0.0, -1.0, math.nan, math.inf, 1e-300),
    "mean[3]": (math.nan, -math.inf, 1e300),
    "layers[0][0][0]": (math.nan, 1e300),
    "layers[1][1][0]": (math.inf, math.nan),
    "choices[0]": (math.nan, math.inf),
    "memory[1][0]": (math.nan, -1e39),
    "clip": (0.0, -1.0, math.nan, math.inf, 1e39),
}
"""Numbers that no network may hold, by where they are put; float32 ends at 3.4e38."""


def parts_of_policy(**sizes: int) -> dict[str, Any]:
    """All that `write_policy` is given for a memory of three and two layers of two, of ones."""
    n, h, k = len(contract().observations), 3, sizes.get("k", 4)
    memory = [np.ones(shape) for shape in ((3 * h, n), (3 * h, h), (3 * h,), (3 * h,))]
    layers = [[np.ones((2, h)), np.ones(2)], [np.ones((2, 2)), np.ones(2)]]
    parts = {"layers": layers, "mean": np.ones(n), "scale": np.ones(n), "clip": 5.0}
    return {**parts, "choices": np.ones((2, k)), "memory": memory}


@pytest.mark.parametrize(("where", "value"), [(w, v) for w, vs in BROKEN.items() for v in vs])
def test_a_number_that_breaks_a_policy_is_refused_by_the_name_of_its_input(
    tmp_path: Path, where: str, value: float
) -> None:
    parts = parts_of_policy()
    Policy(write_policy(tmp_path / "sound.onnx", contract(), **parts))
    name, *places = where.replace("]", "").split("[")
    if not places:
        parts[name] = value
    else:
        array = parts[name]
        for place in places[:-1]:
            array = array[int(place)]
        array[int(places[-1])] = value
    with pytest.raises(BadInputError) as found:
        write_policy(tmp_path / "p.onnx", contract(), **parts)
    named = "".join([name, *(f"[{place}]" for place in places[:-1])])
    assert str(found.value).startswith(f"{named}: expected ")
    assert "\n" not in str(found.value)
    assert not (tmp_path / "p.onnx").exists()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"mean": np.ones(3)}, "mean: expected 200 finite numbers, found shape (3,)"),
        ({"scale": np.ones((200, 1))}, "scale: expected 200 finite numbers"),
        ({"layers": []}, "number of layers: expected a whole number of at least 1, found 0"),
        ({"layers": [[np.ones((2, 4)), np.ones(2)]]}, "layers[0][0]: expected finite numbers of"),
        ({"choices": np.ones((2, 3))}, "choices: expected finite numbers of shape (2, 4)"),
        ({"choices": None}, "layers[1][0]: expected finite numbers of shape (4, 2)"),
        ({"memory": [np.ones(3)] * 3}, "number of arrays in memory: expected a whole number of 4"),
        ({"memory": [np.ones((9, 200)), np.ones((9, 2)), *[np.ones(9)] * 2]}, "memory[1]: "),
        ({"mean": "words"}, "mean: expected 200 finite numbers, found 'words'"),
    ],
)
def test_an_array_of_another_shape_is_refused_by_its_name(
    tmp_path: Path, change: dict[str, Any], told: str
) -> None:
    with pytest.raises(BadInputError) as found:
        write_policy(tmp_path / "p.onnx", contract(), **(parts_of_policy() | change))
    assert told in str(found.value)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("w0", math.nan, "w0: expected finite numbers"),
        ("b0", math.inf, "b0: expected finite numbers"),
        ("mean", -math.inf, "mean: expected finite numbers"),
        ("scale", 0.0, "scale: expected finite numbers, and none of 0 that divides, found 0"),
        ("high", math.inf, ""),  # a bound
    ],
)
def test_a_broken_constant_of_another_exporter_is_refused_by_its_name(
    tmp_path: Path, name: str, value: float, told: str
) -> None:
    path, _ = drawn(tmp_path / "p.onnx", contract())
    model = onnx.load(str(path))
    for tensor in model.graph.initializer:
        if tensor.name == name:
            numbers = np.array(onnx.numpy_helper.to_array(tensor))
            numbers.flat[0] = value
            tensor.CopyFrom(onnx.numpy_helper.from_array(numbers, name))
    path.write_bytes(model.SerializeToString())
    if not told:
        add_contract(path, contract())
        return
    with pytest.raises(BadInputError) as found:
        add_contract(path, contract())
    assert f"{path}: {told}" in str(found.value)


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("answer", "expected finite numbers as action for 200 zeros, found nan"),
        ("chance", "expected finite numbers as action for an observation of chance, found inf"),
        ("state", "expected finite numbers as m for an observation of chance, found inf"),
    ],
)
def test_a_file_whose_answer_is_no_number_is_refused_before_the_first_trial(
    tmp_path: Path, refused: Any, kind: str, told: str
) -> None:
    """Files as they may have been written before that was checked."""
    path = (
        counting(tmp_path / "p.onnx") if kind == "state" else constant(tmp_path / "p.onnx", FORWARD)
    )
    model = onnx.load(str(path))
    changes = {"answer": ("b0", 0, math.nan), "chance": ("w0", 0, 3e38), "state": ("one", 0, 2e38)}
    name, place, value = changes[kind]
    for tensor in model.graph.initializer:
        if tensor.name == name:
            numbers = np.array(onnx.numpy_helper.to_array(tensor))
            numbers[...] = value if kind != "answer" else numbers
            numbers.flat[place] = value
            tensor.CopyFrom(onnx.numpy_helper.from_array(numbers, name))
    path.write_bytes(model.SerializeToString())
    assert told in refused("tunnel", "--controllers", str(path), "--out", str(tmp_path / "run"))
    assert not (tmp_path / "run").exists()


def test_a_contract_is_put_into_sound_files_alone(tmp_path: Path) -> None:
    path = constant(tmp_path / "good.onnx", FORWARD)
    model = onnx.load(str(path))
    real = onnx.TensorProto.FLOAT
    model.graph.output.append(onnx.helper.make_tensor_value_info("value", real, [1, 4]))
    (tmp_path / "two.onnx").write_bytes(model.SerializeToString())
    (tmp_path / "text.onnx").write_text("no model")
    for name, words in {
        "two": "expected the outputs action, found action, value",
        "text": "expected an ONNX model",
        "none": "found no file|No such file",
    }.items():
        with pytest.raises(BadInputError, match=words):
            add_contract(tmp_path / f"{name}.onnx", contract())
    before = path.read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:  # a disk that is full
        resource.setrlimit(resource.RLIMIT_FSIZE, (200, hard))
        with pytest.raises(OutputError):
            add_contract(path, contract())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
    assert path.read_bytes() == before


def test_weights_in_another_file_are_joined_by_the_contract(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As newer exporters of PyTorch write them."""
    path, _ = drawn(tmp_path / "whole.onnx", contract())
    apart = tmp_path / "apart.onnx"
    how = {"save_as_external_data": True, "location": "apart.data", "size_threshold": 0}
    onnx.save_model(onnx.load(str(path)), str(apart), **how)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    with pytest.raises(ConfigError, match="weights that lie in another file are joined by add_con"):
        Policy(apart)
    joined = Policy(add_contract(apart, contract()))
    zeros = np.zeros((1, len(contract().observations)), np.float32)
    assert joined.answer(zeros, {})[0] == pytest.approx(Policy(path).answer(zeros, {})[0])


def test_a_contract_makes_no_file_that_is_too_large_to_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = constant(tmp_path / "p.onnx", FORWARD)
    before = path.read_bytes()
    monkeypatch.setattr("antennate.control.policy.writer.LARGEST", len(before))
    with pytest.raises(BadInputError, match=f"expected at most {len(before)} bytes in all, found"):
        add_contract(path, contract().model_copy(update={"about": 200 * "a"}))
    assert path.read_bytes() == before


def test_a_policy_that_answers_with_words_is_refused_by_that(tmp_path: Path) -> None:
    """Also exporters of classifiers give other things than numbers by default."""
    path = constant(tmp_path / "p.onnx", FORWARD)
    model = onnx.load(str(path))
    word = onnx.helper.make_tensor("word", onnx.TensorProto.STRING, [1, 1], [b"left"])
    del model.graph.node[:], model.graph.output[:]
    model.graph.node.append(onnx.helper.make_node("Constant", [], ["action"], value=word))
    text = onnx.TensorProto.STRING
    model.graph.output.append(onnx.helper.make_tensor_value_info("action", text, [1, 1]))
    path.write_bytes(model.SerializeToString())
    with pytest.raises(ConfigError, match=r"expected an answer to .* could not convert string"):
        Policy(path)


def test_a_policy_of_other_numbers_is_refused_by_what_it_takes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = constant(tmp_path / "good.onnx", FORWARD)
    model = onnx.load(str(path))
    model.graph.input[0].type.tensor_type.elem_type = onnx.TensorProto.DOUBLE
    cast = onnx.helper.make_node("Cast", ["observation"], ["real"], to=onnx.TensorProto.FLOAT)
    for node in model.graph.node:
        for i, name in enumerate(node.input):
            if name == "observation":
                node.input[i] = "real"
    model.graph.node.insert(0, cast)
    path.write_bytes(model.SerializeToString())
    argv = ["--controllers", str(path), "--out", str(tmp_path / "run")]
    assert main(["tunnel", *argv]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert f"{path}: expected an answer to {len(contract().observations)} zeros" in line
    assert "it takes observation as tensor(double) [1, " in line
    assert line.count("good.onnx") == 1


def test_the_code_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second block trains, which a slow test does; here its end stands behind a given file."""
    gym = pytest.importorskip("gymnasium")
    monkeypatch.chdir(tmp_path)
    first, trains, writes = (b.text for b in blocks("envs.md") if b.kind == "python")
    known: dict[str, Any] = {}
    exec(first, known)
    known["env"] = gym.make("antennate/UTurn-v1")
    constant(Path("mine.onnx"), FORWARD)
    imports = [line for line in trains.splitlines() if line.startswith("from antennate")]
    exec("\n".join([*imports, trains[trains.index("config = ") :]]), known)
    assert Policy(Path("mine.onnx")).contract.about == "my PPO, seed 3"
    exec(writes, known)
    assert len(Policy(Path("chance.onnx")).contract.observations) > 1


def test_without_onnxruntime_the_way_to_get_it_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = constant(tmp_path / "p.onnx", FORWARD)
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    assert main(["tunnel", "--controllers", str(path), "--out", str(tmp_path / "run")]) != 0
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "expected the package onnxruntime" in line
    assert "--extra onnx" in line
