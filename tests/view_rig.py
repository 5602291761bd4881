"""A command that shows itself on a page, in a process of its own, and what its page answers."""

import os
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

ANTENNATE = [sys.executable, "-m", "antennate"]
PATIENCE = 120.0


@dataclass
class Shown:
    """A command that runs.

    Attributes:
        process: It.
        lines: What it has said on stderr.
    """

    process: subprocess.Popen[str]
    lines: list[str] = field(default_factory=list)
    _more: threading.Condition = field(default_factory=threading.Condition)

    def read(self) -> None:
        """Keep what it says, until it ends."""
        assert self.process.stderr is not None
        for line in self.process.stderr:
            with self._more:
                self.lines.append(line)
                self._more.notify_all()

    def answer(self) -> str:
        """The first line that it writes on stdout."""
        assert self.process.stdout is not None
        return self.process.stdout.readline()

    def said(self, begin: str) -> str:
        """The first line that begins so, once it has been said."""

        def found() -> list[str]:
            return [line for line in self.lines if line.startswith(begin)]

        with self._more:
            assert self._more.wait_for(found, PATIENCE), self.lines
            return found()[0]

    @property
    def link(self) -> str:
        """The newest link to its page."""
        return self.links(1)[-1]

    def links(self, least: int) -> list[str]:
        """All links that it has told, once there are that many."""

        def found() -> list[str]:
            return re.findall(r"^view: .*?(http\S+)$", "".join(self.lines), re.M)

        with self._more:
            assert self._more.wait_for(lambda: len(found()) >= least, PATIENCE), self.lines
            return found()

    @property
    def port(self) -> int:
        """Port of its page."""
        return int(self.link.split(":")[2].partition("/")[0])


@contextmanager
def shown(*words: str, folder: Path) -> Iterator[Shown]:
    """A command with these words, which is ended afterwards."""
    process = subprocess.Popen(
        [*ANTENNATE, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
    )
    found = Shown(process)
    reader = threading.Thread(target=found.read)
    reader.start()
    try:
        yield found
    finally:
        process.terminate()
        process.wait(PATIENCE)
        reader.join(PATIENCE)
        assert process.stderr is not None
        process.stderr.close()
        assert process.stdout is not None
        process.stdout.close()


def child_of(process: int) -> int:
    """The process of the page that a program has started. A drive begins one for its log, too."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    [page] = [
        child
        for child in children
        if b"antennate.cli.pages" in Path(f"/proc/{child}/cmdline").read_bytes()
    ]
    return int(page)


def told(view: Shown, what: str) -> None:
    """Return once it has said so."""
    end = time.monotonic() + PATIENCE
    while not any(what in line for line in view.lines):
        assert time.monotonic() < end, view.lines
        time.sleep(0.1)


def share_cores(view: Shown) -> None:
    """Give the process of a page its share of the cores.

    Beside a loop in real time it has what nothing else wants: nothing where others are busy.
    """
    for thread in Path(f"/proc/{child_of(view.process.pid)}/task").iterdir():
        os.sched_setscheduler(int(thread.name), os.SCHED_OTHER, os.sched_param(0))


def ask(port: int, path: str = "/", host: str | None = "", **headers: str) -> tuple[int, str]:
    """Status and text of the answer to a request; underscores in names of headers are hyphens.

    `host` is the right one if it is empty, and left out if it is None.
    """
    lines = [f"GET {path} HTTP/1.1"]
    if host is not None:
        lines.append(f"Host: {host or f'127.0.0.1:{port}'}")
    lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
    with socket.create_connection(("127.0.0.1", port), PATIENCE) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).encode("latin-1"))
        answer = b""
        while b"\r\n\r\n" not in answer and (more := connection.recv(65536)):
            answer += more
        head = answer.partition(b"\r\n\r\n")[0].decode("latin-1")
        length = int((re.search(r"(?i)content-length: (\d+)", head) or [0, "0"])[1])
        while len(answer) - len(head) - 4 < length and (more := connection.recv(65536)):
            answer += more
    return int(head.split()[1]), answer.decode("utf-8", "replace")


LIVE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec_WebSocket_Version": "13",
}
"""Headers of a live connection; the key is the example of RFC 6455."""


def cookie(view: Shown) -> str:
    """A cookie of the page, for its newest link."""
    before = len(view.links(1))
    status, text = ask(view.port, view.link.partition(str(view.port))[2])
    assert status == 200, text
    view.links(before + 1)
    found = re.search(r"(?i)set-cookie: ([^;]+)", text)
    assert found is not None, text
    return found[1]
