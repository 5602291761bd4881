"""Every physical number of the system: its value, its unit, and where it comes from.

Each class groups the numbers of one part as a frozen model: unknown keys, non-finite numbers and
values out of bounds are refused. A source begins with one of `paper` (arXiv:2603.07795),
`datasheet`, `measured`, `fitted` (by which command) or `assumed` (why; the paper does not
say). Derived numbers are properties, computed here and never typed.
"""

from antennate.params.base import Params, number
from antennate.params.bench import BenchVariationParams, WallParams
from antennate.params.control import (
    ConditioningParams,
    ControlParams,
    CurveParams,
    EscapeParams,
    GaitParams,
    RepetitionParams,
    RuleParams,
)
from antennate.params.doctor import DoctorParams
from antennate.params.endurance import DriftParams
from antennate.params.network import NetworkParams
from antennate.params.record import RecordParams
from antennate.params.safety import SupervisorParams, TouchCheckParams
from antennate.params.scene import (
    BenchPhysicsParams,
    CylinderParams,
    PhysicsParams,
    TunnelParams,
    VariationParams,
)
from antennate.params.spring import SpringParams, TaperParams
from antennate.params.sweep import EstimateParams, ShapeParams, SweepParams
from antennate.params.touch import (
    BouldersWallParams,
    CornerWallParams,
    FlatWallParams,
    GapWallParams,
    SinusoidalWallParams,
    StepWallParams,
    TouchWallsParams,
)
from antennate.params.twin import BatteryParams

__all__ = [
    "BatteryParams",
    "BenchPhysicsParams",
    "BenchVariationParams",
    "BouldersWallParams",
    "ConditioningParams",
    "ControlParams",
    "CornerWallParams",
    "CurveParams",
    "CylinderParams",
    "DoctorParams",
    "DriftParams",
    "EscapeParams",
    "EstimateParams",
    "FlatWallParams",
    "GaitParams",
    "GapWallParams",
    "NetworkParams",
    "Params",
    "PhysicsParams",
    "RecordParams",
    "RepetitionParams",
    "RuleParams",
    "ShapeParams",
    "SinusoidalWallParams",
    "SpringParams",
    "StepWallParams",
    "SupervisorParams",
    "SweepParams",
    "TaperParams",
    "TouchCheckParams",
    "TouchWallsParams",
    "TunnelParams",
    "VariationParams",
    "WallParams",
    "number",
]
