"""A twin that is asked to end twice at once, and again while it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys

import pytest

PROGRAM = "import sys; from antennate.cli import main; sys.exit(main())"
INT, TERM, HUP = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@pytest.mark.ci
@pytest.mark.parametrize("pair", [(INT, TERM), (TERM, TERM), (HUP, HUP)])
def test_a_twin_ends_in_order_however_often_it_is_asked_to(pair: tuple[int, int]) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "twin"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as twin:
        assert twin.stdout is not None
        assert set(json.loads(twin.stdout.readline())) == {"esp32", "bus"}
        os.kill(twin.pid, signal.SIGSTOP)  # so that both wait for it
        for number in pair:
            os.kill(twin.pid, number)
        os.kill(twin.pid, signal.SIGCONT)
        while twin.poll() is None:
            for number in pair:
                twin.send_signal(number)
            try:
                twin.wait(0.001)
            except subprocess.TimeoutExpired:
                continue
        said = twin.communicate()[1]
    assert twin.returncode == 130
    *_, last, interrupted = said.splitlines()
    assert last.startswith("The twin has ended: ")
    assert "late" in last
    assert interrupted == "antennate twin: interrupted"
    assert "Traceback" not in said
