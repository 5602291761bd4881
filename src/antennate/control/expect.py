"""The error line of the checks of `antennate.testing`."""

from __future__ import annotations


def expect(holds: bool, expected: str, found: str) -> None:
    """Raise an error that says what was expected and found.

    Raises:
        AssertionError: It does not hold.
    """
    if not holds:
        raise AssertionError(f"expected {expected}, found {found}")
