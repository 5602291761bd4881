"""Every physical number of the system: its value, its unit, and where it comes from.

Each class groups the numbers of one part as a frozen model: unknown keys, non-finite numbers and
values out of bounds are refused. A source begins with one of `paper` (arXiv:2603.07795),
`datasheet`, `measured`, `fitted` (by which command) or `assumed` (why; the paper does not
say). Derived numbers are properties, computed here and never typed.

A group is imported when it is first used: a command builds the models that it has, and no others.
"""

from importlib import import_module
from typing import Any

_PLACES = {
    "antennate.params.base": (
        "Params",
        "number",
    ),
    "antennate.params.bench": (
        "BenchVariationParams",
        "WallParams",
    ),
    "antennate.params.control": (
        "ConditioningParams",
        "ControlParams",
        "CurveParams",
        "EscapeParams",
        "GaitParams",
        "RepetitionParams",
        "RuleParams",
    ),
    "antennate.params.doctor": ("DoctorParams",),
    "antennate.params.endurance": ("DriftParams",),
    "antennate.params.network": ("NetworkParams",),
    "antennate.params.record": ("RecordParams",),
    "antennate.params.safety": (
        "SupervisorParams",
        "TouchCheckParams",
    ),
    "antennate.params.scene": (
        "BenchPhysicsParams",
        "CylinderParams",
        "PhysicsParams",
        "TunnelParams",
        "VariationParams",
    ),
    "antennate.params.spring": (
        "SpringParams",
        "TaperParams",
    ),
    "antennate.params.sweep": (
        "EstimateParams",
        "ShapeParams",
        "SweepParams",
    ),
    "antennate.params.touch": (
        "BouldersWallParams",
        "CornerWallParams",
        "FlatWallParams",
        "GapWallParams",
        "SinusoidalWallParams",
        "StepWallParams",
        "TouchWallsParams",
    ),
    "antennate.params.twin": ("BatteryParams",),
}
"""Which module holds which groups; `__init__.pyi` says the same to type checkers."""

__all__ = sorted(name for names in _PLACES.values() for name in names)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import a group when it is first asked for."""
    for place, names in _PLACES.items():
        if name in names:
            value = globals()[name] = getattr(import_module(place), name)
            return value
    raise AttributeError(f"module 'antennate.params' has no attribute {name!r}")


def __dir__() -> list[str]:
    """The groups, for completion."""
    return __all__
