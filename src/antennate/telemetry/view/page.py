"""The page of the viser client, and what it is allowed to load: nothing but itself.

The client is one file whose only script unpacks a style and a second script into the page; a line
of ours chooses dark or light before. The policy names all three scripts by their hash, so that a
text that became markup by mistake could not run.
"""

from __future__ import annotations

import base64
import hashlib
import re
from importlib import resources

import numpy as np

from antennate.colours import SERIES
from antennate.errors import BadInputError
from antennate.messages import extra
from antennate.telemetry.view.gate import HOSTS

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


def load(port: int) -> tuple[bytes, str]:
    """The page and its Content-Security-Policy.

    Raises:
        BadInputError: The installed viser has a page of another form.
    """
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
