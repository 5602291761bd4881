"""Simulate, calibrate, drive and study a pair of tactile antennae on a many-legged robot.

Every name of `__all__` is imported when it is first used, so that `import antennate` costs nothing.
"""

import sys
from contextlib import suppress
from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PLACES = {
    "antennate.antenna.calibration": ("Calibration",),
    "antennate.antenna.fitting": ("fit_calibration",),
    "antennate.antenna.springs": ("spring_stiffness",),
    "antennate.antenna.statics": ("Chain", "equilibrium"),
    "antennate.control.registry": ("make_controller",),
    "antennate.errors": ("AntennateError", "BadInputError"),
    "antennate.experiments.running": ("Result", "list_experiments", "run", "study"),
    "antennate.hardware.esp32.recording": ("Esp32Recording", "read_esp32"),
    "antennate.robots.antenna": ("AntennaSpec",),
    "antennate.robots.spec": ("RobotSpec",),
    "antennate.sim.attach": ("AntennaReader", "attach_antenna"),
    "antennate.studies.run_directory": ("RunDirectory",),
    "antennate.studies.simulate": ("simulate",),
    "antennate.telemetry.time_series": ("TimeSeries",),
    "antennate.types": (
        "AntennaFrame",
        "Contact",
        "Controller",
        "JointCommand",
        "Maneuver",
        "Robot",
    ),
}
"""Which module holds which public names; `__init__.pyi` says the same to type checkers."""

__all__ = sorted(name for names in _PLACES.values() for name in names)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    for place, names in _PLACES.items():
        if name in names:
            value = globals()[name] = getattr(import_module(place), name)
            return value
    raise AttributeError(f"module 'antennate' has no attribute {name!r}")


def __dir__() -> list[str]:
    """The public names, for completion."""
    return [*__all__, "__version__"]


if "gymnasium" in sys.modules:  # `gymnasium.make("antennate:Tunnel-v1")` imports this package
    with suppress(ImportError):  # an older one
        import_module("antennate.envs")
