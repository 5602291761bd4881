"""One line for what a check expected and found, for the checks of `antennate.testing`."""

from __future__ import annotations


def expect(holds: bool, expected: str, found: str) -> None:
    """Fail with both in one line.

    Raises:
        AssertionError: It does not hold.
    """
    if not holds:
        raise AssertionError(f"expected {expected}, found {found}")
