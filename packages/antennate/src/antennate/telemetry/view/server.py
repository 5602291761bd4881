"""The page of the viser client: who may see it, what it may load, and the server behind both.

A page of another site that is open in the same browser can reach this computer too, under a name
of its own (DNS rebinding) or by a WebSocket to 127.0.0.1. So Host and Origin must be names of this
computer with our port. The link that the terminal shows has a token that is good for one browser
and once; the browser gets a cookie for it that no script can read.

The client is one file whose only script unpacks a style and a second script into the page; a line
of ours chooses dark or light before. The policy names all three scripts by their hash, so that a
text that became markup by mistake could not run.

viser serves whoever connects, takes the next port if one is taken, and can make a public address.
Its server is therefore given a socket that is bound already and a check of every handshake, where
it calls `websockets.serve`. A second server in front of it would leave its own port without checks.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import http
import logging
import re
import secrets
import socket
from collections.abc import Callable
from importlib import resources
from typing import Any
from urllib.parse import parse_qs

import numpy as np
import viser
from websockets.asyncio import server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from antennate.errors import BadInputError
from antennate.figures import SERIES
from antennate.messages import extra

HOSTS = ("localhost", "127.0.0.1", "[::1]")
_BYTES = 32
_SAFE = {
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_WELCOME = """<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url=/">\
<title>antennate</title><p><a href="/">antennate</a></p>"""


class Gate:
    """Answers requests to the page; the live connection goes through only if all is right.

    Args:
        port: Port of the page.
        page: The page.
        policy: Its Content-Security-Policy.
        on_used: Called when a link has been used, so that a new one can be shown.

    Attributes:
        refused: Requests that were refused.
    """

    def __init__(
        self, port: int, page: bytes, policy: str, on_used: Callable[[], None] = lambda: None
    ) -> None:
        self._names = {f"{host}:{port}" for host in HOSTS}
        self._sites = {f"http://{name}" for name in self._names}
        self._port, self._page, self._on_used = port, page, on_used
        self._policy = policy
        self._cookie, self._session = f"antennate_{port}", secrets.token_urlsafe(_BYTES)
        self._token = secrets.token_urlsafe(_BYTES)
        self.refused = 0

    @property
    def link(self) -> str:
        """The address to open, good for one browser."""
        return f"http://127.0.0.1:{self._port}/?token={self._token}"

    def answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """The answer to a request, None for a live connection that may go on."""
        headers = request.headers
        live = any("websocket" in each.lower() for each in headers.get_all("Upgrade"))
        origins = headers.get_all("Origin")
        if headers.get_all("Host") not in [[name] for name in self._names]:
            return self._refuse("expected the address of this computer with the port of the view")
        if origins not in [[], *([site] for site in self._sites)] or (live and not origins):
            return self._refuse("expected a request of the page itself")
        path, _, query = request.path.partition("?")
        if live:
            allowed = path == "/" and self._is_known(headers)
            return None if allowed else self._refuse("expected the cookie of the page")
        tokens = parse_qs(query).get("token", [])
        if path == "/" and tokens:
            return self._let_in(tokens)
        if not self._is_known(headers):
            return self._refuse("open the link that the terminal shows; each is good for one time")
        if path == "/":
            return _response(http.HTTPStatus.OK, self._page, Policy=self._policy)
        return _response(http.HTTPStatus.NOT_FOUND, b"not found", plain=True)

    def _let_in(self, tokens: list[str]) -> Response:
        if len(tokens) != 1 or not _same(tokens[0], self._token):
            return self._refuse("expected a new link; each is good for one time")
        self._token = secrets.token_urlsafe(_BYTES)
        self._on_used()
        cookie = f"{self._cookie}={self._session}; Path=/; HttpOnly; SameSite=Strict"
        # The browser loads the page by itself: a redirect would not carry a Strict cookie.
        return _response(http.HTTPStatus.OK, _WELCOME.encode(), Cookie=cookie)

    def _is_known(self, headers: Headers) -> bool:
        given = [
            value
            for line in headers.get_all("Cookie")
            for name, _, value in (each.strip().partition("=") for each in line.split(";"))
            if name == self._cookie
        ]
        return len(given) == 1 and _same(given[0], self._session)

    def _refuse(self, why: str) -> Response:
        self.refused += 1
        return _response(http.HTTPStatus.FORBIDDEN, f"403: {why}\n".encode(), plain=True)


def _same(given: str, wanted: str) -> bool:
    """Whether two secrets are the same, in a time that does not tell where they differ."""
    return hmac.compare_digest(given.encode("utf-8", "replace"), wanted.encode())


def _response(
    status: http.HTTPStatus, body: bytes, plain: bool = False, Policy: str = "", Cookie: str = ""
) -> Response:
    policy = Policy or "default-src 'none'; frame-ancestors 'none'"
    kind = "text/plain" if plain else "text/html"
    headers = Headers(
        {
            **_SAFE,
            "Content-Type": f"{kind}; charset=utf-8",
            "Content-Length": str(len(body)),
            "Content-Security-Policy": policy,
            "Connection": "close",
        }
    )
    if Cookie:
        headers["Set-Cookie"] = Cookie
    return Response(status.value, status.phrase, headers, body)


_SCRIPT = re.compile(
    r'<script data-p="([^"]*)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.S
)
_DIGITS = (
    "!#$%()*+,-./0123456789:;=?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_abcdefghijklmnopqrstuvwxyz{|}~"
)
"""The digits of its base 88: five of them hold four bytes."""
_DARK = """\
{ const dark = matchMedia("(prefers-color-scheme: dark)").matches
history.replaceState(null, "", dark ? "?darkMode" : "/") }
"""
"""Dark where the browser is: the client looks for that word."""
BLUE = SERIES[0]
"""Colour of buttons."""
_SHEET = '.mantine-Paper-root[style*="position: fixed"]'
"""The panel of the client in a window narrower than 36em, where it would lie over the scene."""
_STYLE = f"""\
.mantine-Button-root {{ background: {BLUE} !important; color: #fff !important }}
@media (max-width: 36em) {{
  div:has(> {_SHEET}) {{ flex-direction: column }}
  div:has(> {_SHEET}) > div:has(canvas) {{ height: 0 !important; flex: 1 }}
  {_SHEET} {{ position: static !important; flex: none; width: 100% !important }}
  {_SHEET} [style*="width: 20em"] {{ width: 100% !important }}
}}
"""
"""There the scene is above the panel; and buttons whose text is read in the dark too."""


def load_page(port: int) -> tuple[bytes, str]:
    """The page and its Content-Security-Policy."""
    text = resources.files("viser").joinpath("client/build/index.html").read_text("utf-8")
    match = _SCRIPT.search(text)
    if match is None or text.count("<script") != 1:
        raise BadInputError(
            "view: expected the page of viser 1.1, found another form; "
            f"install it with {extra('view')}"
        )
    packed, style, script, loader = match[1], int(match[2]), int(match[3]), match[4]
    unpacked = _unpacked(packed, style + script)
    hashes = " ".join(map(_hash, (_DARK.encode(), loader.encode(), unpacked[style:])))
    live = " ".join(f"ws://{host}:{port}" for host in HOSTS if "[" not in host)
    policy = (
        f"default-src 'none'; script-src {hashes} 'wasm-unsafe-eval' blob:; worker-src blob:; "
        f"style-src 'unsafe-inline'; img-src 'self' data: blob:; font-src data:; "
        f"connect-src 'self' {live} data: blob:; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    head = f"<title>antennate</title><style>{_STYLE}</style><script>{_DARK}</script>"
    text = text.replace("<title>Viser</title>", head)
    return text.encode(), policy


def _unpacked(packed: str, size: int) -> bytes:
    import zstandard

    values = np.full(128, -1, np.int64)
    values[np.frombuffer(_DIGITS.encode(), np.uint8)] = np.arange(len(_DIGITS))
    digits = values[np.frombuffer(packed.encode(), np.uint8)]
    rest = len(digits) % 5
    padded = np.concatenate([digits, np.zeros((5 - rest) % 5, np.int64)])
    words = padded.reshape(-1, 5) @ (88 ** np.arange(4, -1, -1))
    data = words.astype(">u4").tobytes()
    if rest:  # the last group holds fewer bytes, and its value is theirs
        last = 0
        for digit in digits[-rest:].tolist():
            last = 88 * last + digit
        data = data[:-4] + last.to_bytes(rest - 1, "big")
    return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)


def _hash(script: bytes) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}'"


class _Server(viser.ViserServer):
    def request_share_url(self, verbose: bool = True) -> str | None:
        """Make no public address: nothing leaves this computer."""
        return None


def serve(listener: socket.socket, gate: Gate) -> viser.ViserServer:
    """Serve the page on a socket that is bound."""
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)  # refusals are no errors
    begin: Any = websockets_server.serve
    checked = False

    def checking(handler: Any, host: Any, port: Any, **options: Any) -> Any:
        nonlocal checked
        checked = True
        return begin(handler, sock=listener, **(options | {"process_request": gate.answer}))

    host, port = listener.getsockname()[:2]
    websockets_server.serve = checking  # type: ignore[assignment]
    try:
        server = _Server(host=host, port=port, label="antennate", verbose=False)
    finally:
        websockets_server.serve = begin
    if not checked:
        server.stop()
        raise BadInputError(
            "view: expected viser 1.1, which serves through websockets, found another; "
            f"install it with {extra('view')}"
        )
    server.gui.configure_theme(
        control_width="large", show_logo=False, show_share_button=False, brand_color=(0, 114, 178)
    )
    return server
