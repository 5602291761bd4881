"""Packages of the same engine in one environment with this one: all import, each does a small job.

Run by `.ci/run` in an environment with mink, gymnasium[mujoco], dm_control and mujoco-warp.
"""

import gymnasium
import mink
import mujoco
import mujoco_warp
import numpy as np
import warp
from dm_control import suite

import antennate

ARM = """
<mujoco><worldbody>
<body><joint axis="0 0 1"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/>
<body pos=".3 0 0"><joint axis="0 0 1"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/>
<site name="tip" pos=".3 0 0"/></body></body>
</worldbody></mujoco>
"""


def tunnel() -> str:
    """One trial of the default tunnel."""
    series = antennate.simulate("closed", trial=0, time_limit=30.0)
    return f"antennate: {len(series.t)} ticks of a trial, engine {mujoco.__version__}"


def reach() -> str:
    """Inverse kinematics: an arm of two links reaches a point."""
    arm = mink.Configuration(mujoco.MjModel.from_xml_string(ARM), np.array([0.2, 0.4]))
    task = mink.FrameTask("tip", "site", position_cost=1.0, orientation_cost=0.0)
    task.set_target(mink.SE3.from_translation(np.array([0.3, 0.3, 0.0])))
    for _ in range(200):
        arm.integrate_inplace(mink.solve_ik(arm, [task], 0.01, "daqp"), 0.01)
    left = float(np.linalg.norm(task.compute_error(arm)[:3]))
    assert left < 0.01, left
    return f"mink: {1e3 * left:.2f} mm from its target"


def ant() -> str:
    """Gymnasium's ant takes some steps."""
    env = gymnasium.make("Ant-v5")
    env.reset(seed=0)
    rewards = [float(env.step(env.action_space.sample())[1]) for _ in range(10)]
    assert np.isfinite(rewards).all()
    return f"gymnasium: Ant-v5, {len(rewards)} steps"


def cartpole() -> str:
    """dm_control's cart takes some steps."""
    env = suite.load("cartpole", "swingup")
    env.reset()
    for _ in range(10):
        assert np.isfinite(env.step(np.zeros(1)).reward)
    return "dm_control: cartpole, 10 steps"


def falling() -> str:
    """Warp steps what it is given as the engine does; on the CPU, compiled at the first use."""
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    data.qvel[:] = 1.0, -2.0
    with warp.ScopedDevice("cpu"):
        batch, state = mujoco_warp.put_model(model), mujoco_warp.put_data(model, data, nworld=2)
        for _ in range(20):
            mujoco_warp.step(batch, state)
            mujoco.mj_step(model, data)
        apart = float(np.abs(state.qpos.numpy() - data.qpos).max())
    assert apart < 1e-4, apart
    return f"mujoco-warp: {apart:.1g} rad from the engine after 20 steps"


if __name__ == "__main__":
    warp.config.log_level = warp.LOG_WARNING
    for job in (tunnel, reach, ant, cartpole, falling):
        print(job())
