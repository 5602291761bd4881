"""viser behind our gate, on a socket of ours.

viser serves whoever connects, takes the next port if one is taken, and can make a public address.
Its server is therefore given a socket that is bound already and a check of every handshake, where
it calls `websockets.serve`. A second server in front of it would leave its own port without checks.
"""

from __future__ import annotations

import logging
import socket
from typing import Any

import viser
from websockets.asyncio import server as websockets_server

from antennate.errors import BadInputError
from antennate.messages import extra
from antennate.telemetry.view.gate import Gate


class _Server(viser.ViserServer):
    def request_share_url(self, verbose: bool = True) -> str | None:
        """Make no public address: nothing leaves this computer."""
        return None


def serve(listener: socket.socket, gate: Gate) -> viser.ViserServer:
    """Serve the page on a socket that is bound.

    Raises:
        BadInputError: The installed viser serves in another way, so that nothing would be checked.
    """
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
