"""What holds for all tests."""

from __future__ import annotations

import signal

# Programs that the tests start inherit what is ignored, and `nohup` or a script that runs the tests
# in the background ignores these: a test that ends a program by them would wait for ever.
for number in (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(
            number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        )
