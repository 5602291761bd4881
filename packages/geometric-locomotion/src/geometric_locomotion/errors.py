"""Errors of geometric mechanics: all that it raises on purpose descends from LocomotionError."""

from __future__ import annotations


class LocomotionError(Exception):
    """Base of all errors of this package; its text is one line fit to be shown to a user."""


class BadInputError(LocomotionError, ValueError):
    """Something a user supplied cannot be used: a body, a shape, a stroke, a bound."""
