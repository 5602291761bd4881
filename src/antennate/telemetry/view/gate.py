"""Who may see the page: Host, Origin and a token are checked before anything is answered.

A page of another site that is open in the same browser can reach this computer too, under a name
of its own (DNS rebinding) or by a WebSocket to 127.0.0.1. So Host and Origin must be names of this
computer with our port. The link that the terminal shows has a token that is good for one browser
and once; the browser gets a cookie for it that no script can read.
"""

from __future__ import annotations

import hmac
import http
import secrets
from collections.abc import Callable
from urllib.parse import parse_qs

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

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
            known = path == "/" and self._is_known(headers)
            return None if known else self._refuse("expected the cookie of the page")
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
