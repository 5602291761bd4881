"""What holds for all tests."""

from __future__ import annotations

import signal

import pytest
from hypothesis import settings

settings.register_profile("any machine", deadline=None)  # how long an example takes says nothing
settings.load_profile("any machine")

# Programs that the tests start inherit what is ignored, and `nohup` or a script that runs the tests
# in the background ignores these: a test that ends a program by them would wait for ever.
for number in (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(
            number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        )


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--pictures`: tests that look at a page also make the pictures of the docs."""
    parser.addoption("--pictures", action="store_true", help="make docs/images/view-*.webp anew")
