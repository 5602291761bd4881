"""From an address to a Port: a serial line, a board on the network, or a TCP connection."""

from __future__ import annotations

from typing import Protocol
from urllib.parse import urlsplit

from antennate.errors import BadInputError, ConfigError
from antennate.hardware.port import Port
from antennate.params.network import NetworkParams


class ClosablePort(Port, Protocol):
    """A Port that can be let go."""

    def close(self) -> None:
        """Let it go."""
        ...


def open_port(
    address: str, baud: int, key: bytes | None = None, network: NetworkParams | None = None
) -> ClosablePort:
    """Open what an address names.

    Args:
        address: Path of a serial line, tcp://HOST:PORT or udp://HOST:PORT.
        baud: Bits per second of a serial line.
        key: Of the board behind udp://; empty for one without a key.
        network: Pace and limits of udp://.

    Raises:
        PortError: It cannot be opened.
        BadInputError: It is no address, or needs a key.
    """
    scheme, separator, _ = address.partition("://")
    if not separator:
        return _serial(address, baud)
    host, port = _place(address)
    if scheme == "tcp":
        from antennate.hardware.tcp_port import TcpPort

        return TcpPort(host, port)
    if scheme != "udp":
        raise BadInputError(f"expected a path, tcp:// or udp://, found {address!r}")
    if key is None:
        raise BadInputError(
            f"{address}: expected the key of the board; give --key FILE, or --insecure-udp for a "
            "board without one, which anybody on the network can feign"
        )
    from antennate.hardware.udp_port import UdpPort

    return UdpPort(host, port, key, network)


def is_udp(address: str) -> bool:
    """Whether an address needs a key."""
    return address.startswith("udp://")


def _place(address: str) -> tuple[str, int]:
    wanted = "expected SCHEME://HOST:PORT such as udp://192.168.4.2:4210"
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


def _serial(path: str, baud: int) -> ClosablePort:
    try:
        from antennate.hardware.serial_port import SerialPort
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"expected pyserial for real ports, found no module {error.name}; install "
            "antennate[hardware], or run `uv run --extra hardware antennate drive ...`"
        ) from None
    return SerialPort(path, baud)
