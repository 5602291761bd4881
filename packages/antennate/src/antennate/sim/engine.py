"""The engine, MuJoCo: the only place that imports it, and only where its numbers can be right.

Two distributions write the same files: `mujoco` and, from 4.0 on, `mujoco-core`. With both in two
versions installed, parts of both run together. Where a command is only described, they may.

Raises:
    ConfigError: Two versions are installed over one another, or the engine is one that is known to
        be wrong or not tested, or it cannot be loaded.
"""

from __future__ import annotations

import re

from antennate.errors import ConfigError, in_one_line
from antennate.sim.engine_setup import engines, is_described

_OLDEST, _WRONG, _TOO_NEW = (3, 17), (4, 0, 0), (5,)
"""As in pyproject.toml. 4.0.0 factors the sparse Newton system wrongly (engine issue 3767)."""


def _refused(found: str) -> ConfigError:
    return ConfigError(
        f"expected the engine mujoco from 3.17 to below 5, but not 4.0.0, found {found}; uninstall "
        'mujoco and mujoco-core, then install "mujoco>=3.17,!=4.0.0,<5" (docs/install.md)'
    )


_versions = engines()
_found = ""
if len(set(_versions.values())) > 1:
    _found = " and ".join(f"{name} {version}" for name, version in _versions.items())
if _found and not is_described():
    raise _refused(_found)
try:
    import mujoco
except (ImportError, OSError) as _error:
    if isinstance(_error, ImportError) and not (_error.name or "").startswith("mujoco"):
        raise  # what MUJOCO_GL names lacks a package
    raise _refused(_found or in_one_line(_error)) from None
_loaded = str(getattr(mujoco, "__version__", "a folder without an engine"))
_parts = tuple(int(part) for part in re.findall(r"\d+", _loaded))
if _parts[:3] == _WRONG or not _OLDEST <= _parts < _TOO_NEW:
    _found = _found or _loaded
if _found and not (is_described() and hasattr(mujoco, "MjSpec")):
    raise _refused(_found)
