"""Environments of Gymnasium: a robot that walks by touch, for learned policies.

Importing this registers them; see docs/envs.md.
"""

from __future__ import annotations

import warnings

from antennate.errors import MissingPackageError

try:
    from gymnasium.envs import registration
except ModuleNotFoundError as error:
    if error.name != "gymnasium":
        raise
    from antennate.messages import extra

    raise MissingPackageError(
        "antennate.envs: expected the package gymnasium, found none; install it with "
        f"{extra('gym')}"
    ) from None

from antennate.envs.config import EnvConfig, Randomisation
from antennate.envs.single import AntennaEnv
from antennate.envs.vector import AntennaVectorEnv
from antennate.sim.scenes.registry import SCENES

__all__ = ["AntennaEnv", "AntennaVectorEnv", "EnvConfig", "Randomisation", "ids", "register"]

NAMESPACE = "antennate"
VERSION = 1
"""Version of all environments: it rises when a scene, an observation or a reward changes."""
_ENTRY_POINT = "antennate.envs.single:AntennaEnv"
_NAMES = {"uturn": "UTurn", "corner": "Corner120", "deadend": "DeadEnd"}
"""Scenes whose name in an id is not their own with a capital letter."""


def ids() -> dict[str, str]:
    """The scene of each environment, by its id.

    A scene whose name makes no id, or the same one as another, has none, and a warning says so.
    """
    scenes: dict[str, str] = {}
    for scene in SCENES.names:
        own = "".join(part[:1].upper() + part[1:] for part in scene.replace("_", "-").split("-"))
        full = f"{NAMESPACE}/{_NAMES.get(scene, own)}-v{VERSION}"
        if not registration.ENV_ID_RE.fullmatch(full):
            _warn(f"{scene}: expected letters, digits, _ or - in a scene's name, so it has no id")
        elif (other := scenes.setdefault(full, scene)) != scene:
            _warn(f"{full}: expected one scene of that id, found {other} and {scene}")
    return scenes


def register() -> tuple[str, ...]:
    """Register an environment for every scene that has a name; the ids.

    Importing this module does so; call it again after a scene was added. Each has a second id
    without the namespace, for `gymnasium.make("antennate:Tunnel-v1")`; if another package has taken
    that, it stays, and a warning says so.
    """
    known = ids()
    for full, scene in known.items():
        for name in (full, full.partition("/")[2]):
            if (taken := registration.registry.get(name)) is None:
                registration.register(
                    name,
                    entry_point=_ENTRY_POINT,
                    vector_entry_point="antennate.envs.vector:AntennaVectorEnv",
                    kwargs={"scene": scene},
                )
            elif taken.entry_point != _ENTRY_POINT:
                _warn(f"{name}: expected a free id, found that of {taken.entry_point}; take {full}")
    return tuple(known)


def _warn(text: str) -> None:
    warnings.warn(text, stacklevel=3)


register()
