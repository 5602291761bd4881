"""Every attribute of `<compiler>`, `<option>` and `<size>` that the engine knows: obeyed alike in a
scene, in its export and by the engine alone, or refused by its name; none changes an antenna."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from antennate import AntennaSpec, attach_antenna
from antennate.cli import main
from antennate.errors import ConfigError, SceneError
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.export.folder import export_mjcf
from antennate.sim.scenes.mjcf import MjcfScene
from antennate.sim.world import compile_world

OBEYED = {
    "alignfree": "true",
    "angle": "radian",
    "assetdir": ".",
    "autolimits": "true",
    "coordinate": "local",
    "discardvisual": "true",
    "eulerseq": "zyx",
    "fusestatic": "true",
    "inertiafromgeom": "true",
    "inertiagrouprange": "0 2",
    "meshdir": ".",
    "texturedir": ".",
    "usethread": "false",
}
"""Of `<compiler>`, with a value that is not the default where there is one."""
REFUSED = {
    "balanceinertia": "true",
    "boundinertia": "0.01",
    "boundmass": "0.2",
    "conflict": "merge",
    "fitaabb": "true",
    "passthrough": "x",
    "savecanonical": "true",
    "savecompiled": "true",
    "saveinertial": "true",
    "settotalmass": "3",
    "strippath": "true",
}
WORLD = """<mujoco>{before}<worldbody>
  <site name="start"/><site name="exit" pos="2 0 0"/>
  <geom type="box" size="1 .02 .1" pos="1 .6 .1"/>
  <body name="a" pos="1 0 .1" euler=".2 .3 .4"><freejoint/>
    <geom type="box" size=".05 .07 .09" pos=".1 0 0" mass=".5"/>
    <geom type="sphere" size=".03" contype="0" conaffinity="0" mass=".05" group="4"/>
    <body name="b" pos="0 0 .2"><joint name="j" axis="0 1 0" range="-.3 .3"/>
      <inertial pos=".01 0 0" mass="2e-4" diaginertia="1e-6 1e-6 1e-6"/>
      <geom size=".02" mass="1e-4"/></body>
    <body name="c" pos="0 .2 0"><geom size=".02" mass=".01"/></body>
  </body>
</worldbody></mujoco>"""


def schema() -> dict[str, set[str]]:
    """Attributes of each element that the engine knows, the first of each name."""
    found: dict[str, set[str]] = {}
    names: set[str] = set()
    for line in mujoco.mj_printSchema(False, False).splitlines():
        name = re.match(r" *(\w+) \(.\) *", line)
        if name:
            element, line = name[1], line[name.end() :]
            names = found.setdefault(element, set()) if element not in found else set()
        names.update(line.split())
    return found


SCHEMA = schema()


def scene(folder: Path, before: str = "") -> Path:
    path = folder / "scene.xml"
    path.write_text(WORLD.format(before=before))
    return path


def facts(model: mujoco.MjModel, prefix: str = "") -> dict[str, Any]:
    """Mass, inertia, place and turn of the bodies of the scene; range of its joint."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found: dict[str, Any] = {}
    for name in "abc":
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, prefix + name)
        if body < 0:  # fused with the body that carries it
            continue
        place = [data.xpos[body], data.ximat[body], data.xipos[body]]
        found[name] = [model.body_mass[body], *model.body_inertia[body], *np.concatenate(place)]
        found[f"geoms of {name}"] = [model.body_geomnum[body]]
    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, prefix + "j")
    found["j"] = [model.jnt_limited[joint], *model.jnt_range[joint]]
    return found


def in_simulation(path: Path) -> dict[str, Any]:
    drawn = MjcfScene(path).draw(RobotSpec(), np.random.default_rng(0))
    return facts(compile_world(PhysicsParams(), RobotSpec(), drawn), "scene/")


def agree(one: dict[str, Any], other: dict[str, Any]) -> bool:
    same = (np.allclose(one[k], other[k], rtol=1e-9, atol=1e-12) for k in one if k in other)
    return one.keys() == other.keys() and all(same)


def test_the_tables_hold_all_that_the_engine_knows() -> None:
    assert OBEYED.keys() | REFUSED.keys() == SCHEMA["compiler"]
    assert not OBEYED.keys() & REFUSED.keys()
    assert {"timestep", "gravity", "integrator"} <= SCHEMA["option"]
    assert {"spring", "contact"} <= SCHEMA["flag"]
    assert {"memory", "nkey"} <= SCHEMA["size"]


@pytest.mark.parametrize("name", sorted(OBEYED))
def test_a_scene_obeys_it_as_the_engine_alone_does(name: str, tmp_path: Path) -> None:
    path = scene(tmp_path, f'<compiler {name}="{OBEYED[name]}"/>')
    alone = mujoco.MjModel.from_xml_path(str(path))
    assert agree(facts(alone), in_simulation(path))


@pytest.mark.ci
def test_an_export_obeys_them_all_together(tmp_path: Path) -> None:
    said = " ".join(f'{name}="{value}"' for name, value in OBEYED.items())
    path = scene(tmp_path, f"<compiler {said}/>")
    plain = facts(mujoco.MjModel.from_xml_path(str(scene(tmp_path))))
    path = scene(tmp_path, f"<compiler {said}/>")
    assert not agree(plain, in_simulation(path))  # they do change it
    files = export_mjcf(RobotSpec(), str(path)).files
    model = mujoco.MjModel.from_xml_string(str(files["scene.xml"]))
    assert agree(in_simulation(path), facts(model, "scene_"))


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_a_scene_refuses_it_by_name(name: str, tmp_path: Path) -> None:
    path = scene(tmp_path, f'<compiler angle="degree" {name}="{REFUSED[name]}"/>')
    with pytest.raises(SceneError, match=f"expected no {name} of <compiler>") as refused:
        MjcfScene(path)
    assert f"{name}='{REFUSED[name]}'" in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("element", "name"),
    [(e, name) for e in ("option", "flag", "size", "lengthrange") for name in sorted(SCHEMA[e])],
)
def test_a_scene_refuses_numerics_and_sizes(element: str, name: str, tmp_path: Path) -> None:
    around = {"flag": "option", "lengthrange": "compiler"}.get(element)
    text = f'<{element} {name}="1"/>'
    path = scene(tmp_path, f"<{around}>{text}</{around}>" if around else text)
    with pytest.raises(SceneError, match=f"expected no <{element}>"):
        MjcfScene(path)


@pytest.mark.ci
@pytest.mark.parametrize("words", [["tunnel", "--trials", "1"], ["robot", "--export", "mjcf"]])
def test_commands_refuse_a_total_mass_in_one_line(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scene(tmp_path, '<compiler settotalmass="3"/>')
    assert main([*words, "--scene", str(path), "--out", str(tmp_path / "run")]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1, err
    assert "settotalmass" in err
    assert not (tmp_path / "run").exists()


def own(compiler: str = "", option: str = "") -> mujoco.MjSpec:
    return mujoco.MjSpec.from_string(
        f"<mujoco><compiler {compiler}/>{option}"
        '<worldbody><body name="head"><geom size=".02"/></body></worldbody></mujoco>'
    )


def of_antenna(spec: mujoco.MjSpec, name: str) -> list[float]:
    model = spec.compile()
    bodies = [i for i in range(model.nbody) if model.body(i).name.startswith(f"{name}/")]
    joints = [i for i in range(model.njnt) if model.joint(i).name.startswith(f"{name}/")]
    hinges = [i for i in joints if "/hinge" in model.joint(i).name]
    return [
        model.body_mass[bodies].sum(),
        *model.body_inertia[bodies].ravel(),
        *model.jnt_stiffness[hinges].ravel(),
        *model.jnt_range[joints].ravel(),
        *model.body_pos[bodies].ravel(),
    ]


@pytest.mark.parametrize("name", sorted(SCHEMA["compiler"] - {"passthrough"}))
def test_no_flag_of_ones_own_model_changes_the_antenna(name: str) -> None:
    antenna, value = AntennaSpec(), {**OBEYED, **REFUSED}[name]
    spec, plain = own(f'{name}="{value}"'), own()
    expected = of_antenna(plain, attach_antenna(plain, "head", antenna))
    if name == "settotalmass":
        with pytest.raises(ConfigError, match=r"without settotalmass.*found 3"):
            attach_antenna(spec, "head", antenna)
        assert [body.name for body in spec.bodies] == ["world", "head"]  # as it was
        return
    assert of_antenna(spec, attach_antenna(spec, "head", antenna)) == expected
    stiffness = expected[1 + 3 * (antenna.hinges + 1) :][: antenna.hinges]
    assert stiffness == pytest.approx(antenna.hinge_stiffness())


@pytest.mark.parametrize("name", ["spring", "damper", "constraint", "limit", "actuation", "sensor"])
def test_a_model_without_what_an_antenna_is_made_of_is_refused(name: str) -> None:
    spec = own(option=f'<option><flag {name}="disable"/></option>')
    with pytest.raises(ConfigError, match=f"found {name} disabled"):
        attach_antenna(spec, "head", AntennaSpec())
    spec = own(option='<option actuatorgroupdisable="0"/>')
    with pytest.raises(ConfigError, match="actuatorgroupdisable=0"):
        attach_antenna(spec, "head", AntennaSpec())
