"""A headless Chromium, driven through its DevTools; no other package is needed.

All that its pages ask for is kept, so that a test can see whether anything left this computer.
"""

import base64
import json
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
"""The browser, None if there is none."""
_WORDS = (
    "--headless=new --no-sandbox --disable-dev-shm-usage --use-angle=swiftshader "
    "--enable-unsafe-swiftshader --disable-gpu-rasterization --disable-accelerated-2d-canvas "
    "--disable-background-networking --no-first-run "
    "--disable-component-update --disable-sync --hide-scrollbars --remote-debugging-port=0"
)
_STARTING = 120.0
_ANSWERING = 300.0
"""Longest that a page may take to answer [s]: it is drawn without a graphics card."""

_GIVES_WAY = "Inspected target navigated or closed"
_TWICE_A_SECOND = """\
window.requestAnimationFrame = draw => setTimeout(() => draw(performance.now()), 500)
window.cancelAnimationFrame = clearTimeout
"""


class GivesWay(Exception):
    """A page was left while it was asked."""


class Tab:
    """One page.

    Attributes:
        requests: Addresses that it asked for, live connections too.
        troubles: What its console says of errors and of refused loads.
    """

    def __init__(self, connection: ClientConnection) -> None:
        self._connection, self._count = connection, 0
        self.requests: list[str] = []
        self.troubles: list[str] = []
        for each in ("Page", "Network", "Runtime", "Log"):
            self.call(f"{each}.enable")
        self.call(
            "Target.setAutoAttach", autoAttach=True, waitForDebuggerOnStart=True, flatten=True
        )

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Call a method of the DevTools; its result. A page that hangs still sends events."""
        number = self._send(method, params)
        end = time.monotonic() + _ANSWERING
        while True:
            answer = json.loads(self._connection.recv(max(0.0, end - time.monotonic())))
            if answer.get("id") == number:
                error = answer.get("error", {})
                if _GIVES_WAY in error.get("message", ""):
                    raise GivesWay(method)
                assert not error, (method, answer)
                return answer["result"]
            self._note(answer.get("method", ""), answer.get("params", {}))

    def _watch(self, session: str) -> None:
        """Keep what a worker of the page asks for, too."""
        for method in ("Network.enable", "Runtime.runIfWaitingForDebugger"):
            self._send(method, {}, sessionId=session)

    def _send(self, method: str, params: dict[str, Any], **more: str) -> int:
        self._count += 1
        message = {"id": self._count, "method": method, "params": params, **more}
        self._connection.send(json.dumps(message))
        return self._count

    def _note(self, event: str, params: dict[str, Any]) -> None:
        if event == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"][:200])
        elif event == "Target.attachedToTarget":
            self._watch(params["sessionId"])
        elif event == "Network.webSocketCreated":
            self.requests.append(params["url"])
        elif event == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.troubles.append(params["entry"]["text"])
        elif event == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            what = details.get("exception", {}).get("description", "")
            self.troubles.append(f"{details['text']} {what}")

    def draw_little(self) -> None:
        """Let pages draw twice a second, and a quarter of the pixels of a window.

        Without a graphics card a second of 60 pictures takes many seconds of both cores, before
        all others: Chromium gives its process that draws a nice level of -8 where it may.
        """
        self.call("Page.addScriptToEvaluateOnNewDocument", source=_TWICE_A_SECOND)
        size = {"width": 1280, "height": 940, "deviceScaleFactor": 0.5, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def open(self, address: str) -> None:
        """Go to an address."""
        self.call("Page.navigate", url=address)

    def run(self, script: str) -> Any:
        """The value of an expression of JavaScript; None while a page gives way to the next."""
        try:
            found = self.call("Runtime.evaluate", expression=script, returnByValue=True)
        except GivesWay:
            return None
        return found["result"].get("value")

    def until(self, script: str, patience: float = _STARTING) -> Any:
        """The value of an expression once it is true."""
        end = time.monotonic() + patience
        while not (value := self.run(script)):
            assert time.monotonic() < end, (script, self.run("document.body.innerText"))
            time.sleep(0.1)
        return value

    def until_is(self, script: str, wanted: Any) -> None:
        """Return once an expression has this value; else its last one is told."""
        end = time.monotonic() + _STARTING
        while (value := self.run(script)) != wanted:
            assert time.monotonic() < end, (script, value, wanted)
            time.sleep(0.1)

    def click(self, tag: str, text: str) -> None:
        """Click the first element of that kind with that text, if there is one."""
        self.run(
            f"[...document.querySelectorAll('{tag}')].find(e => e.textContent == {text!r})?.click()"
        )

    def fill(self, label: str, text: str) -> None:
        """Type into the field behind a label, in place of what it holds."""
        self._focus(label)
        self.call("Input.insertText", text=text)
        self._enter()

    def choose(self, label: str, text: str) -> None:
        """Choose an entry of the list behind a label."""
        self._focus(label)
        self.until("!!document.querySelector('[role=option]')")
        self.click("[role=option]", text)

    def _focus(self, label: str) -> None:
        script = f"""(() => {{
            let box = [...document.querySelectorAll('label')].find(e => e.textContent == {label!r});
            let field = null;
            while (box && !(field = box.querySelector('input:not([type=hidden])')))
                box = box.parentElement;
            if (!field) return false;
            field.focus(); field.select(); field.click();
            return true;
        }})()"""
        assert self.run(script), label

    def _enter(self) -> None:
        time.sleep(0.2)  # the page takes the text first
        key: dict[str, Any] = {"key": "Enter", "text": "\r", "windowsVirtualKeyCode": 13}
        for kind in ("rawKeyDown", "char", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, **key)

    def drag(self, *way: tuple[float, float]) -> None:
        """Press the mouse at the first place, move it along the others, and let it go."""
        more: dict[str, Any] = {"button": "left", "clickCount": 1}
        self.mouse("mouseMoved", *way[0])
        self.mouse("mousePressed", *way[0], **more)
        for place in way[1:]:
            self.mouse("mouseMoved", *place, buttons=1, **more)
            time.sleep(0.05)
        self.mouse("mouseReleased", *way[-1], **more)

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """One event of the mouse."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def picture(self, kind: str = "png", **more: Any) -> bytes:
        """What is seen."""
        return base64.b64decode(self.call("Page.captureScreenshot", format=kind, **more)["data"])


@contextmanager
def browser(folder: Path, width: int = 1280, height: int = 940) -> Iterator[Tab]:
    """A tab of a browser whose files are in a folder."""
    assert CHROMIUM is not None
    # it draws without a graphics card: what it shows goes first
    words = ["nice", CHROMIUM, *_WORDS.split(), f"--window-size={width},{height}"]
    process = subprocess.Popen(
        [*words, f"--user-data-dir={folder}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        how: Any = {"max_size": None, "proxy": None, "ping_interval": None, "close_timeout": 0.1}
        with connect(_address(folder), **how) as connection:
            yield Tab(connection)
    finally:
        process.kill()
        process.wait(_STARTING)


def _address(folder: Path) -> str:
    """Where the DevTools of the first tab are."""
    end = time.monotonic() + _STARTING
    file = folder / "DevToolsActivePort"
    while time.monotonic() < end:
        lines = file.read_text().splitlines() if file.exists() else []
        if len(lines) == 2:
            with urllib.request.urlopen(f"http://127.0.0.1:{lines[0]}/json") as reply:
                pages = [each for each in json.load(reply) if each["type"] == "page"]
            if pages:
                return pages[0]["webSocketDebuggerUrl"]
        time.sleep(0.1)
    raise AssertionError("the browser does not answer")
