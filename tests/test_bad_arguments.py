"""Nonsense given to public names: one line of one error tree, which names what is wrong."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import antennate
from antennate import AntennaSpec, AntennateError, Calibration, RobotSpec, RunDirectory, TimeSeries

NAN, INF = math.nan, math.inf
SPRING = {"modulus": 193e9, "wire": 0.5e-3, "coil": 3.77e-3, "coils": 3}
LEVEL = np.tile(np.linspace(0.02, 0.98, 50), 6)
COUNTS = np.rint(1650 - 60 * np.log(LEVEL / (1 - LEVEL)))
NO_PATHS: tuple[Any, ...] = (3, b"name", ["name"], "", "a\0b")
Case = tuple[Callable[..., Any], dict[str, Any], str]


def spring(**changed: Any) -> float:
    return antennate.spring_stiffness(**{**SPRING, **changed})


def bent(
    lengths: Any = (0.02,) * 3, stiffness: Any = (0.01,) * 3, place: Any = (0.01,), force: Any = 0.1
) -> antennate.Chain:
    chain = antennate.Chain(lengths, stiffness)
    loads: Any = [[0.0, force]] if np.ndim(force) == 0 else force
    antennate.equilibrium(chain, place, loads)
    return chain


def fitted(**changed: Any) -> Calibration:
    return antennate.fit_calibration(**{"counts": COUNTS, "level": LEVEL, **changed})


FITTED = fitted(trial=np.repeat(np.arange(6), 50))


def calibration(**changed: Any) -> Calibration:
    return Calibration(**{**FITTED.model_dump(), **changed})


def own_robot() -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.worldbody.add_body(name="head").add_geom(size=[0.02, 0, 0])
    return spec


def attached(**changed: Any) -> str:
    given = {"spec": own_robot(), "body": "head", "antenna": AntennaSpec(), **changed}
    return antennate.attach_antenna(**given)


def reader(**changed: Any) -> antennate.AntennaReader:
    spec = own_robot()
    name = antennate.attach_antenna(spec, "head", AntennaSpec())
    given = {"names": [name], "antenna": AntennaSpec(), "period": 0.01, **changed}
    return antennate.AntennaReader(**{"model": spec.compile(), **given})


def controller(**changed: Any) -> antennate.Controller:
    return antennate.make_controller(**{"name": "closed", **changed})


def trial(**changed: Any) -> TimeSeries:
    return antennate.simulate(**{"controller": "open", "time_limit": 0.01, **changed})


def tunnel(**changed: Any) -> antennate.Result:
    few = {"trials": 1, "time_limit": 0.01, "controllers": ("open",)}
    return antennate.run("tunnel", **{**few, **changed})


def kept(what: str, *values: Any) -> None:
    with RunDirectory.create("mine", "runs/mine", overwrite=True) as directory:
        getattr(directory, what)(*values)


BAD_NUMBERS: list[Case] = [
    (spring, {name: value}, f"{name}: expected a finite number above 0")
    for name in SPRING
    for value in (-0.5e-3, 0, NAN, INF, "1", None, b"1", True, 1j, 10**400)
]

BAD_PATHS: list[Case] = [
    (function, {name: value}, f"{name}: expected a path, found ")
    for value in NO_PATHS
    for function, name in (
        (Calibration.load, "path"),
        (FITTED.save, "path"),
        (RunDirectory.open, "path"),
        (trial, "log"),
        (tunnel, "out"),
    )
]

CASES: list[Case] = [
    *BAD_NUMBERS,
    *BAD_PATHS,
    (spring, {"wire": 1e100}, r"stiffness of these: expected .* above 0 \[N·m/rad\], found inf"),
    (spring, {"wire": 1e-100}, "stiffness of these: expected .* found 0"),
    (spring, {"coil": 5e-324}, "stiffness of these: expected .* found inf"),
    (spring, {"coils": 5e-324}, "stiffness of these: expected .* found inf"),
    (spring, {"coils": [3, 0, 9]}, "coils: expected finite numbers above 0, found 0"),
    (spring, {"wire": [5e-4, NAN]}, r"wire: expected finite numbers \[m\], found 1 that are not"),
    (spring, {"wire": [[5e-4], [5e-4, 4e-4]]}, "wire: expected finite numbers"),
    (spring, {"wire": np.full(2, 4e-4), "coils": np.ones(3)}, r"broadcast, found .*\(2,\).*\(3,\)"),
    (spring, {"wire": [1e-100, 5e-4]}, "stiffness of these: expected finite numbers above 0"),
    (bent, {"lengths": (-0.02,) * 3}, "lengths: expected numbers above 0, found -0.02"),
    (bent, {"lengths": (0.02, NAN, 0.02)}, "lengths: expected finite numbers"),
    (bent, {"lengths": (), "stiffness": ()}, "lengths: expected numbers above 0, found none"),
    (bent, {"lengths": np.ones((2, 2))}, r"lengths: .* of shape \(n,\), found shape \(2, 2\)"),
    (bent, {"lengths": "abc"}, "lengths: expected finite numbers .* found 'abc'"),
    (bent, {"lengths": [[1], [2, 3]]}, "lengths: expected finite numbers"),
    (bent, {"stiffness": (-0.01,) * 3}, "stiffness: expected numbers above 0, found -0.01"),
    (bent, {"stiffness": (0.0,) * 3}, "stiffness: expected numbers above 0, found 0"),
    (bent, {"stiffness": (0.01,) * 2}, r"stiffness: expected 3 finite .* found shape \(2,\)"),
    (bent, {"stiffness": None}, "stiffness: expected 3 finite numbers .* found None"),
    (bent, {"place": (0.07,)}, "place: expected places above 0 and up to 0.06 m, found 0.07"),
    (bent, {"place": (NAN,)}, "place: expected places above 0"),
    (bent, {"place": "x"}, "place: expected numbers"),
    (bent, {"place": np.ma.array([0.01], mask=[True])}, "place: .* found a masked array"),
    (fitted, {"counts": np.ma.masked_less(COUNTS, 1500)}, "counts: .* found a masked array"),
    (fitted, {"level": [np.ma.masked, *LEVEL[1:]]}, "level: .* found a masked array"),
    (bent, {"force": NAN}, r"force: expected finite numbers \[N\] of shape \(1, 2\)"),
    (bent, {"force": INF}, "force: expected finite numbers"),
    (bent, {"force": [0.0, 1.0]}, r"force: .* found shape \(2,\)"),
    (
        antennate.equilibrium,
        {"chain": 3, "place": [0.1], "force": [[0, 1]]},
        "chain: expected a Chain, found 3",
    ),
    (antennate.Chain.of, {"antenna": 3}, "antenna: expected an AntennaSpec, found 3"),
    (RobotSpec, {"links": 0}, "^links: expected a number of at least 1, found 0$"),
    (RobotSpec, {"links": "many"}, "links: expected a whole number, found 'many'"),
    (RobotSpec, {"mass": NAN}, "mass: expected a finite number, found nan"),
    (RobotSpec, {"mass": 0.31}, "mass must leave more than 10 g a link"),
    (RobotSpec, {"lenghts": 3}, "lenghts: expected a known key"),
    (RobotSpec, {"antenna": 3}, "antenna: expected a table, found 3"),
    (RobotSpec, {"antenna": {"length": -1}}, "antenna.length: expected a number above 0.02"),
    (RobotSpec.named, {"text": 3}, "robot: expected a path, found 3"),
    (RobotSpec().places, {"name": "wings"}, "name: expected yaw, legs, .* found 'wings'"),
    (AntennaSpec, {"active_coils": ()}, "active_coils: expected at least 1 value, found "),
    (AntennaSpec, {"active_coils": (1,) * 200}, "active_coils: expected at most 100 values"),
    (AntennaSpec, {"length": INF}, "length: expected a finite number, found inf"),
    (AntennaSpec().base, {"servo": 3}, "servo: expected a ServoParams, found 3"),
    (attached, {"spec": 3}, "spec: expected a MjSpec, found 3"),
    (attached, {"body": b"head"}, "body: expected text"),
    (attached, {"body": "tail"}, "body: expected the name of a body, world, head, found tail"),
    (attached, {"antenna": None}, "antenna: expected an AntennaSpec, found None"),
    (attached, {"side": 3}, "side: expected left or right, found 3"),
    (attached, {"position": ("a", "b", "c")}, "position: expected 3 finite numbers"),
    (attached, {"position": (1, 2)}, r"position: .* found shape \(2,\)"),
    (attached, {"angle": "wide"}, r"angle: expected a finite number \[rad\], found 'wide'"),
    (attached, {"angle": [1]}, "angle: expected a finite number"),
    (attached, {"name": ""}, "name: expected text"),
    (attached, {"name": 3}, "name: expected text"),
    (attached, {"contype": -1}, "contype: expected a whole number of 0 to 2147483647, found -1"),
    (attached, {"contype": 1.5}, "contype: expected a whole number"),
    (attached, {"conaffinity": 2**40}, "conaffinity: expected a whole number"),
    (reader, {"model": 3}, "model: expected a MjModel, found 3"),
    (reader, {"names": "antenna_left"}, "names: expected a list of names, found 'antenna_left'"),
    (reader, {"names": []}, "names: expected a list of names"),
    (reader, {"names": [3]}, "names: expected text"),
    (reader, {"antenna": 3}, "antenna: expected an AntennaSpec, found 3"),
    (reader, {"period": 0}, r"period: expected a finite number above 0 \[s\], found 0"),
    (reader, {"period": NAN}, "period: expected a finite number above 0"),
    (reader, {"seed": -1}, "seed: expected a whole number of at least 0, found -1"),
    (reader, {"seed": 1.5}, "seed: expected a whole number"),
    (fitted, {"counts": "x"}, r"counts: expected finite numbers of shape \(n,\), found 'x'"),
    (fitted, {"counts": COUNTS + 1j}, "counts: expected finite numbers"),
    (fitted, {"level": LEVEL[:5]}, "level: expected 300 finite numbers, found shape"),
    (fitted, {"level": LEVEL * NAN}, "level: expected 300 finite numbers, found 300"),
    (fitted, {"trial": np.full(300, 0.5)}, "trial: expected whole numbers, found 0.5"),
    (fitted, {"trial": np.full(300, 1e300)}, r"trial: expected whole numbers, found 1e\+300"),
    (fitted, {"trial": np.full(300, 2.0**63)}, "trial: expected whole numbers"),
    (fitted, {"level": LEVEL * 1e300}, r"level: expected 0 straight and 1 full, found 2e\+298"),
    (fitted, {"trial": np.full(300, NAN)}, "trial: expected 300 finite numbers"),
    (fitted, {"speed": np.full(300, -1.0)}, "speed: expected finite speeds of at least 0"),
    (fitted, {"speed": np.full(300, INF)}, "speed: expected finite speeds of at least 0"),
    (fitted, {"sensor_id": "a b"}, "sensor_id: expected text that matches .* found 'a b'"),
    (fitted, {"sensor_id": None}, "sensor_id: expected text, found None"),
    (fitted, {"threshold": 2}, "threshold: expected a number below 1, found 2"),
    (fitted, {"threshold": "0.5"}, "threshold: expected a finite number, found '0.5'"),
    (fitted, {"threshold": b"0.5"}, "threshold: expected a finite number, found b'0.5'"),
    (fitted, {"threshold": NAN}, "threshold: expected a finite number"),
    (Calibration, {}, r"made_by: expected a value, found none \(and 19 more\)"),
    (calibration, {"slope": -1}, "slope: expected a number above 0, found -1"),
    (calibration, {"counts_low": 3, "counts_high": 3}, "counts_high: expected 20 counts more"),
    (calibration, {"valid_counts": (3, 2)}, "valid_counts: expected the lower end first"),
    (FITTED.level, {"counts": "x"}, "counts: expected numbers"),
    (FITTED.conditioning, {"averaging_time": -1}, "averaging_time: expected a number above 0"),
    (antennate.read_esp32, {"source": 3}, "source: expected a path, found 3"),
    (controller, {"name": 3}, "expected a controller .* found 3"),
    (controller, {"batch": 0}, "batch: expected a whole number of at least 1, found 0"),
    (controller, {"batch": 1.5}, "batch: expected a whole number"),
    (controller, {"control": 3}, "control: expected a ControlParams, found 3"),
    (controller, {"robot": "scuttle"}, "robot: expected a RobotSpec, found 'scuttle'"),
    (trial, {"trial": True}, "trial: expected a whole number of at least 0, found True"),
    (trial, {"control": {}}, r"control: expected a ControlParams, found \{\}"),
    (tunnel, {"workers": 1.0}, "workers: expected a whole number of at least 1, found 1.0"),
    (tunnel, {"on_step": 3}, "on_step: expected a function, found 3"),
    (tunnel, {"controllers": 3}, "controllers: expected a list, found 3"),
    (tunnel, {"controllers": (3,)}, "controllers: expected a function, found 3"),
    (tunnel, {"video": "first", "out": "runs/film"}, "video: expected a whole number"),
    (RunDirectory.create, {"command": "../up"}, "command: expected a name without a slash"),
    (RunDirectory.create, {"command": b"mine"}, "command: expected text"),
    (RunDirectory.create, {"command": "mine", "path": 3}, "path: expected a path, found 3"),
]


def _label(case: Case) -> str:
    function, given, _ = case
    return f"{getattr(function, '__qualname__', function)} {str(given)[:50]}"


@pytest.mark.parametrize(("function", "given", "said"), CASES, ids=map(_label, CASES))
def test_nonsense_is_refused_in_one_line(
    function: Callable[..., Any],
    given: dict[str, Any],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AntennateError) as refusal:
        function(**given)
    text = str(refusal.value)
    assert re.search(said, text), text
    assert len(text.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("what", "values", "said"),
    [
        ("append", (3,), "row: expected a dictionary or a dataclass, found 3"),
        ("append", (dict,), "row: expected a dictionary or a dataclass"),
        ("finish", (None,), "result: expected a dictionary, found None"),
        ("finish", ({}, 3), "rows: expected an? Iterable, found 3"),
        ("finish", ({}, [3]), "row: expected a dictionary or a dataclass, found 3"),
        ("finish", ({}, [{"a": 1}, {"b": 1}]), "row 1: expected the columns a, found b"),
        ("describe", (3,), "config: expected a Params, found 3"),
        ("write", ("../up.txt", "x"), "name: expected one within the run, found ../up.txt"),
        ("write", (3, "x"), "name: expected text"),
        ("write", ("mine.txt", 3), "content: expected text, bytes or pieces, found 3"),
        ("text", (b"x",), "name: expected text"),
        ("write_figures", (3,), "figures: expected a dictionary, found 3"),
        ("write_figures", ({"a": 3},), "figure: expected a Figure, found 3"),
    ],
)
def test_a_run_directory_refuses_nonsense_and_goes_away(
    what: str, values: tuple[Any, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AntennateError) as refusal:
        kept(what, *values)
    text = str(refusal.value)
    assert re.search(said, text), text
    assert len(text.splitlines()) == 1
    assert not Path("runs").exists()


def test_a_refused_antenna_leaves_the_model_as_it_was() -> None:
    spec = own_robot()
    before = spec.to_xml()
    with pytest.raises(AntennateError, match="conaffinity"):
        attached(spec=spec, conaffinity=-1)
    assert spec.to_xml() == before


def test_lists_are_as_good_as_arrays() -> None:
    """One hinge bent by F at its link's end: k q = F L cos q (closed form, small by symmetry)."""
    chain = antennate.Chain([0.1], [0.01])  # pyright: ignore[reportArgumentType]
    rest = antennate.equilibrium(chain, [0.1], [[0.0, 0.05]])  # pyright: ignore[reportArgumentType]
    q = float(rest.angles[0, 0])
    assert 0.01 * q == pytest.approx(0.05 * 0.1 * math.cos(q), rel=1e-9)
