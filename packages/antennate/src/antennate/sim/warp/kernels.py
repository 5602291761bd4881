"""What runs on the device beside the engine. Imported late: it needs warp."""

# pyright: reportInvalidTypeForm=false
# Warp reads the types of arguments as expressions.
from __future__ import annotations

from importlib import import_module

wp = import_module("warp")  # `import warp` is this folder to type checkers


@wp.kernel
def load_friction(
    torque: wp.array2d[float],
    speed: wp.array2d[float],
    drive: wp.array[int],
    dof: wp.array[int],
    share: wp.array[float],
    dry: wp.array[float],
    damping: wp.array[float],
    friction: wp.array2d[float],
):
    """Friction of gears under load, as `antennate.sim.places` has it; one thread a joint."""
    world, i = wp.tid()
    motor = torque[world, drive[i]] - damping[i] * speed[world, dof[i]]
    friction[world, dof[i]] = dry[i] + share[i] * wp.abs(motor)


@wp.kernel
def obstacle_forces(
    count: wp.array[int],
    owner: wp.array[int],
    geoms: wp.array[wp.vec2i],
    address: wp.array2d[int],
    force: wp.array2d[float],
    obstacle: wp.array[int],
    own: wp.array[int],
    total: wp.array[float],
):
    """Normal forces between robot and obstacles, summed by world; one thread a contact."""
    contact = wp.tid()
    if contact >= count[0]:
        return
    world, row = owner[contact], address[contact, 0]
    first, second = geoms[contact][0], geoms[contact][1]
    if row < 0 or row >= force.shape[1] or obstacle[first] == obstacle[second]:
        return
    if own[first] + own[second] > 0:
        wp.atomic_add(total, world, force[world, row])
