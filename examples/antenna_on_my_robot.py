"""Our antennae on any MuJoCo model: a cart drives until one of its two antennae touches a wall."""

import mujoco

from antennate import AntennaReader, AntennaSpec, attach_antenna

CART = """
<mujoco>
  <option timestep="0.001"/>
  <worldbody>
    <geom name="floor" type="plane" size="3 3 0.1"/>
    <geom name="wall" type="box" pos="0.7 0 0.1" size="0.02 1 0.1"/>
    <body name="cart" pos="0 0 0.05">
      <freejoint/>
      <geom type="box" size="0.08 0.05 0.02" mass="1"/>
      <geom type="sphere" pos="-0.06 0 -0.03" size="0.02" friction="0.01"/>
      <body pos="0.03 0.07 -0.01">
        <joint name="left" axis="0 1 0" damping="0.01"/>
        <geom type="cylinder" size="0.04 0.01" euler="90 0 0" mass="0.1"/>
      </body>
      <body pos="0.03 -0.07 -0.01">
        <joint name="right" axis="0 1 0" damping="0.01"/>
        <geom type="cylinder" size="0.04 0.01" euler="90 0 0" mass="0.1"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <velocity name="left" joint="left" kv="0.1"/>
    <velocity name="right" joint="right" kv="0.1"/>
  </actuator>
</mujoco>
"""
PERIOD = 0.01  # time between two readings [s]
THRESHOLD = 60.0  # change of a reading that counts as contact [counts]

spec = mujoco.MjSpec.from_string(CART)
antenna = AntennaSpec(active_coils=(3, 6, 9, 9))  # four hinges, stiff base to soft tip
names = [
    attach_antenna(spec, "cart", antenna, "left", position=(0.08, 0.02, 0.0)),
    attach_antenna(spec, "cart", antenna, "right", position=(0.08, -0.02, 0.0)),
]
model = spec.compile()
data = mujoco.MjData(model)
reader = AntennaReader(model, names, antenna, PERIOD, seed=0)
straight = reader.read(data).counts

for _ in range(1000):
    touched = abs(reader.read(data).counts - straight) > THRESHOLD
    speed = 0.0 if touched.any() else 5.0  # of the wheels [rad/s]
    data.actuator("left").ctrl = data.actuator("right").ctrl = speed
    mujoco.mj_step(model, data, round(PERIOD / model.opt.timestep))

gap = 0.68 - 0.08 - data.body("cart").xpos[0]
print(f"the cart stands {gap:.3f} m before the wall")
print(f"flex [rad]: {reader.flex(data)}, force [N]: {reader.touch(data).sum():.3f}")
