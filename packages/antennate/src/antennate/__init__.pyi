"""The public names for type checkers, which do not run `__getattr__`."""

from antennate.antenna.calibration import Calibration as Calibration
from antennate.antenna.fitting import fit_calibration as fit_calibration
from antennate.antenna.springs import spring_stiffness as spring_stiffness
from antennate.antenna.statics import Chain as Chain
from antennate.antenna.statics import equilibrium as equilibrium
from antennate.control.registry import make_controller as make_controller
from antennate.errors import AntennateError as AntennateError
from antennate.errors import BadInputError as BadInputError
from antennate.experiments.running import Result as Result
from antennate.experiments.running import list_experiments as list_experiments
from antennate.experiments.running import run as run
from antennate.experiments.running import study as study
from antennate.hardware.esp32.recording import Esp32Recording as Esp32Recording
from antennate.hardware.esp32.recording import read_esp32 as read_esp32
from antennate.robots.antenna import AntennaSpec as AntennaSpec
from antennate.robots.spec import RobotSpec as RobotSpec
from antennate.sim.attach import AntennaReader as AntennaReader
from antennate.sim.attach import attach_antenna as attach_antenna
from antennate.studies.run_directory import RunDirectory as RunDirectory
from antennate.studies.simulate import simulate as simulate
from antennate.telemetry.time_series import TimeSeries as TimeSeries
from antennate.types import AntennaFrame as AntennaFrame
from antennate.types import Contact as Contact
from antennate.types import Controller as Controller
from antennate.types import JointCommand as JointCommand
from antennate.types import Maneuver as Maneuver
from antennate.types import Robot as Robot

__version__: str
