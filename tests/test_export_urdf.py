"""The exported URDF, read by MuJoCo's own reader: it weighs and bends as the MJCF does."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from test_export_mjcf import joints_of, robot_of

from antennate.cli import main
from antennate.robots.spec import ROBOTS, RobotSpec
from antennate.sim.export.folder import export_mjcf, export_urdf
from antennate.types import Floats

CLOSE = 1e-9


WALKING = [name for name in ROBOTS if name != "bench"]
"""The others have a MJCF beside it."""


def models(robot: RobotSpec) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    text = str(export_urdf(robot).files["robot.urdf"])
    urdf = mujoco.MjModel.from_xml_string(text)
    return urdf, mujoco.MjModel.from_xml_string(str(export_mjcf(robot).files["robot.xml"]))


def inertia(model: mujoco.MjModel, data: mujoco.MjData, body: str) -> Floats:
    turn = data.body(body).ximat.reshape(3, 3)
    return turn @ np.diag(model.body(body).inertia) @ turn.T


@pytest.mark.parametrize("name", [*WALKING, "own"])
def test_it_weighs_and_bends_as_the_mjcf_does(name: str, tmp_path: Path) -> None:
    robot = RobotSpec.named(robot_of(name, tmp_path))
    urdf, ours = models(robot)
    locked = set() if robot.pitch_count else set(robot.pitch_names)
    joints = joints_of(urdf)
    assert set(joints) == set(joints_of(ours)) - locked
    bodies = [ours.body(i).name for i in range(1, ours.nbody)]
    between = {f"link{i}_yaw{i}" for i in range(1, robot.links)} if robot.pitch_count else set()
    assert {urdf.body(i).name for i in range(1, urdf.nbody)} == {*bodies, *between}
    for model in (urdf, ours):
        assert model.body_mass.sum() == pytest.approx(robot.mass, abs=CLOSE)
    here, there = mujoco.MjData(ours), mujoco.MjData(urdf)
    rng = np.random.default_rng(2)
    for _ in range(5):
        here.qpos[:3] = 0.0
        for joint in joints:
            angle = rng.uniform(-3.0, 3.0)
            here.joint(joint).qpos[0] = there.joint(joint).qpos[0] = angle
        mujoco.mj_forward(ours, here)
        mujoco.mj_forward(urdf, there)
        for body in bodies:
            parts = [part for part in between if part.startswith(f"{body}_")]
            weight = sum(urdf.body(part).mass.item() for part in [body, *parts])
            assert weight == pytest.approx(ours.body(body).mass.item(), abs=CLOSE)
            for part in ("xipos", "xmat"):  # centre of mass, axes
                values = (getattr(data.body(body), part) for data in (here, there))
                assert next(values) == pytest.approx(next(values), abs=CLOSE)
            moments = inertia(ours, here, body), inertia(urdf, there, body)
            light = sum(np.diag(urdf.body(part).inertia) for part in parts)
            assert moments[0] == pytest.approx(moments[1] + light, abs=1e-12)
        for joint in joints:
            for part in ("xanchor", "xaxis"):
                values = (getattr(data.joint(joint), part) for data in (here, there))
                assert next(values) == pytest.approx(next(values), abs=CLOSE)


def test_shapes_reach_as_far_as_those_of_the_simulator() -> None:
    """Each geom of ours has a shape at its place in the URDF, and the floor lies as deep."""
    urdf, ours = models(RobotSpec())
    there, here = mujoco.MjData(urdf), mujoco.MjData(ours)
    here.qpos[:3] = 0.0
    mujoco.mj_forward(urdf, there)
    mujoco.mj_forward(ours, here)
    for geom in range(ours.ngeom):
        apart = np.linalg.norm(there.geom_xpos - here.geom_xpos[geom], axis=1)
        assert apart.min() < CLOSE
    legs = [i for i in range(urdf.ngeom) if "leg" in urdf.body(urdf.geom_bodyid[i]).name]
    low = there.geom_xpos[legs, 2] - urdf.geom_size[legs, 0]
    assert low.min() == pytest.approx(-RobotSpec().leg_radius - RobotSpec().leg_eccentricity)
    assert {int(kind) for kind in urdf.geom_type[legs]} == {int(mujoco.mjtGeom.mjGEOM_CYLINDER)}
    assert abs(there.geom_xmat[legs, 5] ** 2 - 1.0).max() < CLOSE  # its axis lies along y


@pytest.mark.parametrize("name", WALKING)
def test_limits_are_those_of_data_sheet_and_description(name: str, tmp_path: Path) -> None:
    """XC430-W240-T at 11.1 V: 1.7 N·m (e-Manual); XL330-M288-T at 5 V: 0.52 N·m.

    Rolling legs turn at 0.837 Hz, 5.26 rad/s, as docs/science/pace.md says.
    """
    folder, robot = tmp_path / "export", RobotSpec.named(name)
    assert main(["robot", name, "--export", "urdf", "--out", str(folder)]) == 0
    root = ElementTree.parse(folder / "robot.urdf").getroot()
    joints = {str(joint.get("name")): joint for joint in root.iter("joint")}
    limits = {name: _numbers(joint, "limit") for name, joint in joints.items()}
    for joint, angle in zip(robot.joint_names, robot.limits, strict=True):
        rolls = angle == float("inf")
        assert joints[joint].get("type") == ("continuous" if rolls else "revolute")
        ends = {} if rolls else {"lower": -angle, "upper": angle}
        assert {k: limits[joint][k] for k in limits[joint].keys() & {"lower", "upper"}} == ends
        assert limits[joint]["velocity"] == (5.26 if rolls else 4.5)
    if robot.antenna_count:
        assert limits["yaw1"]["effort"] == limits["leg_r3"]["effort"] == 1.7
        assert limits["antenna_r_base"]["effort"] == 0.52
        hinge = limits["antenna_l_hinge3"]
        assert (hinge["effort"], hinge["upper"]) == (0.0, robot.antenna.range)
    else:
        assert limits["leg_l0"]["upper"] == pytest.approx(np.pi / 2)


def _numbers(joint: ElementTree.Element, tag: str) -> dict[str, float]:
    element = joint.find(tag)
    assert element is not None
    return {name: float(value) for name, value in element.attrib.items()}


def test_both_texts_say_what_urdf_cannot_hold() -> None:
    files = export_urdf(RobotSpec()).files
    comment = str(files["robot.urdf"]).partition("<robot")[0]
    for text in (comment, str(files["README.txt"])):
        for word in ("springs", "gain", "friction that grows", "contact", "sensors"):
            assert word in text


@pytest.mark.slow
def test_yourdfpy_reads_it(tmp_path: Path) -> None:
    module = pytest.importorskip("yourdfpy", reason="yourdfpy is not installed")
    robot = RobotSpec()
    (tmp_path / "robot.urdf").write_text(str(export_urdf(robot).files["robot.urdf"]))
    urdf = module.URDF.load(str(tmp_path / "robot.urdf"), load_meshes=False)
    assert set(robot.joint_names) <= set(urdf.actuated_joint_names)
    model, _ = models(robot)
    data = mujoco.MjData(model)
    angles = {name: 0.3 * (i % 3 - 1) for i, name in enumerate(urdf.actuated_joint_names)}
    for name, angle in angles.items():
        data.joint(name).qpos[0] = angle
    mujoco.mj_forward(model, data)
    urdf.update_cfg(angles)
    for link in ("link5", "leg_r4", "antenna_l_hinge5", "antenna_r_hinge5"):
        pose = urdf.get_transform(link, "link0")
        assert pose[:3, 3] == pytest.approx(data.body(link).xpos, abs=CLOSE)
        assert pose[:3, :3].ravel() == pytest.approx(data.body(link).xmat, abs=CLOSE)


@pytest.mark.parametrize(("name", "mass"), [("scuttle", 2.0), ("scuttle3d", 2.4), ("hexapod", 1.0)])
def test_what_is_exported_weighs_what_its_page_says(name: str, mass: float, tmp_path: Path) -> None:
    """2.0 and 2.4 kg of docs/robots.md, 1.0 kg of the hexapod's file; README.txt says so, too."""
    for form, file in (("urdf", "robot.urdf"), ("mjcf", "robot.xml")):
        folder = tmp_path / form
        assert main(["robot", name, "--export", form, "--out", str(folder)]) == 0
        model = mujoco.MjModel.from_xml_string((folder / file).read_text())
        assert model.body_mass.sum() == pytest.approx(mass, abs=1e-12)
        assert model.body_mass[1:].min() > 0.0
    assert f"all links weigh {mass:g} kg" in (tmp_path / "urdf" / "README.txt").read_text()
