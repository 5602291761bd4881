"""From an address to a Port: a serial line, a board on the network, or a TCP connection."""

from __future__ import annotations

from collections.abc import Callable
from urllib.parse import urlsplit

from antennate.errors import BadInputError, ConfigError
from antennate.messages import extra
from antennate.params.hardware import NetworkParams
from antennate.port import Line


def finder(
    address: str,
    baud: int,
    flag: str = "",
    key: bytes | None = None,
    network: NetworkParams | None = None,
) -> Callable[[], Line]:
    """What opens the port that an address names, and opens the same one again when called again.

    Args:
        address: Path of a serial line, tcp://HOST:PORT or udp://HOST:PORT.
        baud: Bits per second of a serial line.
        flag: What named it, for errors.
        key: Of the board behind udp://; empty for one without a key.
        network: Pace and limits of udp://.

    Raises:
        BadInputError: It is no address, or needs a key.
    """
    scheme, separator, _ = address.partition("://")
    if not separator:
        return _serial(address, baud, flag)
    host, port = _place(address, flag)
    if scheme == "tcp":
        from antennate.hardware.ports.tcp_port import TcpPort

        return lambda: TcpPort(host, port)
    if scheme != "udp":
        raise BadInputError(f"{flag}: expected a path, tcp:// or udp://, found {address!r}")
    if key is None:
        raise BadInputError(
            f"{address}: expected the key of the board; give --key FILE, or --insecure-udp for a "
            "board without one (anybody on the network can then send frames in its place)"
        )
    from antennate.hardware.ports.udp_port import UdpPort

    return lambda: UdpPort(host, port, key, network)


def is_udp(address: str) -> bool:
    """Whether an address needs a key."""
    return address.startswith("udp://")


def _place(address: str, flag: str) -> tuple[str, int]:
    scheme = address.partition("://")[0]
    wanted = f"{flag}: expected {scheme}://HOST:PORT such as {scheme}://192.168.4.2:4210"
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise BadInputError(f"{wanted}, found {address!r}: {error}") from None
    if "@" in parts.netloc:
        raise BadInputError(f"{wanted}, found one with a name before @; a key never goes there")
    if not host or not port or parts.path or parts.query or parts.fragment:
        raise BadInputError(f"{wanted}, found {address!r}")
    return host, port


def _serial(path: str, baud: int, flag: str) -> Callable[[], Line]:
    try:
        from antennate.hardware.ports.serial_finder import SerialFinder
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"expected pyserial for real ports, found no module {error.name}; install it "
            f"with {extra('hardware')}"
        ) from None
    return SerialFinder(path, baud, flag)
