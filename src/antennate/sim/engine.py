"""The engine, MuJoCo: the only place that imports it, and only where its numbers can be right.

Two distributions write the same files, `mujoco` and `mujoco-core`. With two versions installed,
parts of both run together. Where a command is only described, they may.

Raises:
    ConfigError: Two versions are installed over one another, or the engine is an untested one, or
        it cannot be loaded.
"""

from __future__ import annotations

import re
from importlib import metadata

from antennate.errors import ConfigError, in_one_line
from antennate.sim.describing import is_described

_OLDEST, _TOO_NEW = (4, 0, 1), (5,)
"""As in pyproject.toml. 4.0.0 factors the sparse Newton system wrongly (engine issue 3767)."""


def _refused(found: str) -> ConfigError:
    return ConfigError(
        f"expected the engine mujoco-core 4.0.1 or later, below 5, found {found}; uninstall mujoco "
        'and mujoco-core, then install "mujoco-core>=4.0.1,<5" (docs/install.md)'
    )


def _installed() -> dict[str, str]:
    """Versions of the distributions that write the engine's files, by name."""
    found = {}
    for name in ("mujoco", "mujoco-core"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


_versions = _installed()
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
if not _OLDEST <= tuple(int(part) for part in re.findall(r"\d+", _loaded)) < _TOO_NEW:
    _found = _found or _loaded
if _found and not (is_described() and hasattr(mujoco, "MjSpec")):
    raise _refused(_found)
