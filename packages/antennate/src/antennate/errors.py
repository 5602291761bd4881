"""The error tree: everything that antennate raises on purpose descends from AntennateError."""

from __future__ import annotations

import contextlib
import signal
import traceback
from collections.abc import Iterator
from pathlib import Path

import dynamixel_bus.errors
import geometric_locomotion.errors


class AntennateError(Exception):
    """Base of all errors of this package; its text is one line fit to be shown to a user."""


class BadInputError(AntennateError, ValueError):
    """Something a user supplied cannot be used: a file, a flag, a value, a folder."""


class ConfigError(BadInputError):
    """A configuration is not acceptable: unknown key, wrong type, value out of bounds."""


class SceneError(BadInputError):
    """A scene cannot be found, read or built as described, or the robot does not fit into it."""


class OutputError(BadInputError):
    """A result cannot be written where the user asked for it."""


class SimulationError(AntennateError):
    """The physics of one world became invalid.

    Attributes:
        step: Physics step at which it was noticed.
        reason: What was found.
    """

    def __init__(self, step: int, reason: str) -> None:
        super().__init__(f"simulation invalid at physics step {step}: {reason}")
        self.step = step
        self.reason = reason


class WorkerError(AntennateError):
    """A worker process failed or died; finished trials are kept."""


class CalibrationError(BadInputError):
    """A recording or a calibration file cannot be used."""


class LogError(BadInputError):
    """The log of a drive cannot be written, read or replayed."""


class ControllerError(AntennateError):
    """A controller raised an exception, or answered in another form than its protocol says."""


class MissingPackageError(AntennateError, ImportError):
    """An optional package is needed for this and not installed; the text says how to get it."""


FAILURES = (
    AntennateError,
    dynamixel_bus.errors.BusError,
    geometric_locomotion.errors.LocomotionError,
)
"""What this package and those below it raise on purpose, to be caught together."""


@contextlib.contextmanager
def own_errors() -> Iterator[None]:
    """Bad input that `dynamixel_bus` refuses, as an error of this package."""
    try:
        yield
    except dynamixel_bus.errors.ConfigError as error:
        raise ConfigError(str(error)) from None
    except dynamixel_bus.errors.BadInputError as error:
        raise BadInputError(str(error)) from None


def is_ctrl_c(error: BaseException) -> bool:
    """Whether it may come of Ctrl-C: a worker process ignores that, so there it is of some code."""
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    return isinstance(error, KeyboardInterrupt) and not ignored


_LONGEST = 300
"""Most characters of an exception that are quoted; it may hold anything."""


def in_one_line(error: BaseException) -> str:
    """Type and text of any exception in one line; the type alone if its text cannot be had."""
    name = type(error).__name__
    try:
        text = " ".join(str(error).split()).encode(errors="backslashreplace").decode()
    except KeyboardInterrupt:
        raise
    except BaseException:  # noqa: BLE001 anybody's __str__ may raise anything
        return name
    return f"{name}: {text}"[:_LONGEST] if text else name


def reason(error: BaseException) -> str:
    """Why something failed, in one line that is never empty.

    What the system says of an OSError; else the text of the exception; of one without, its type.
    """
    text = getattr(error, "strerror", None) or str(error)
    return " ".join(text.split()) or type(error).__name__


def raised(error: BaseException) -> str:
    """What a user's code raised, and the file and line of it, in one line."""
    return f"{in_one_line(error)}{where_of(error)}"


_MODULES = (__file__, dynamixel_bus.errors.__file__, geometric_locomotion.errors.__file__)
_OURS = [Path(file).parent for file in _MODULES]
_PYTHON = Path(traceback.__file__).parent


def where_of(error: BaseException, in_packages: bool = True) -> str:
    """` (FILE:LINE)` of the user's code that raised an error; empty if it was none of the user's.

    It is the last place outside this package, and outside installed packages if there is one.

    Args:
        error: What was raised.
        in_packages: Whether a place in an installed package is told where there is no other.
    """
    places = [(Path(f.filename), f.lineno) for f in traceback.extract_tb(error.__traceback__)]
    files = [at for at in places if at[0].is_file()]
    outside = [at for at in files if not any(map(at[0].is_relative_to, _OURS))]
    installed = [at for at in outside if "site-packages" in at[0].parts]
    own = [at for at in outside if at not in installed and not at[0].is_relative_to(_PYTHON)]
    own = own or (installed if in_packages else [])
    if not own:
        return ""
    path, line = own[-1]
    folder = Path.cwd()
    return f" ({path.relative_to(folder) if path.is_relative_to(folder) else path}:{line})"
