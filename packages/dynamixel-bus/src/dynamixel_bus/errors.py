"""Errors of the servo bus: all that it raises on purpose descends from BusError."""

from __future__ import annotations


class BusError(Exception):
    """Base of all errors of this package; its text is one line fit to be shown to a user."""


class BadInputError(BusError, ValueError):
    """Something a user supplied cannot be used: a file, a flag, a value, a port."""


class ConfigError(BadInputError):
    """A model or a list of servos is not acceptable: unknown key, wrong type, out of bounds."""


class MissingPackageError(BusError, ImportError):
    """An optional package is needed for this and not installed; the text says how to get it."""


def reason(error: BaseException) -> str:
    """Why something failed, in one line that is never empty.

    What the system says of an OSError; else the text of the exception; of one without, its type.
    """
    text = getattr(error, "strerror", None) or str(error)
    return " ".join(text.split()) or type(error).__name__
