"""The page of a live view answers nobody but the browser that was let in (faults X19 to X25)."""

import json
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from view_rig import LIVE, Shown, ask, cookie, shown

from antennate import simulate

pytestmark = pytest.mark.ci


@pytest.fixture(scope="module")
def view(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shown]:
    """The page of a simulation that goes on for long."""
    folder = tmp_path_factory.mktemp("view")
    words = "tunnel --controllers open --trials 1 --scene flat --time-limit 3600 --view"
    with shown(*words.split(), "--view-port", "0", "--view-speed", "0.1", folder=folder) as found:
        yield found


COMMANDS = {
    "tunnel": "tunnel --controllers open --trials 1 --view-paused --view --view-port 0",
    "gait": "gait --view-paused --view --view-port 0",
    "wall": "bench wall --view-paused --view --view-port 0",
    "replay": "log replay trial.mcap --view-paused --view --view-port 0",
    "view": "log view trial.mcap --port 0",
    "twin": "twin --duration 600 --view --view-port 0",
    "drive": "drive --duration 600 --view --view-port 0",
}
"""Every command with a page; `teleop` wants a terminal, and shares that of `drive`."""


@contextmanager
def command(name: str, folder: Path) -> Iterator[Shown]:
    """One of these commands; `drive` has a twin of its own."""
    with ExitStack() as stack:
        words = COMMANDS[name].split()
        if name in ("replay", "view"):
            simulate("open", scene="flat", time_limit=0.5, log=folder / "trial.mcap")
        elif name == "drive":
            twin = stack.enter_context(shown("twin", "--duration", "600", folder=folder))
            paths = json.loads(twin.answer())
            words += ["--esp32", paths["esp32"], "--bus", paths["bus"]]
        yield stack.enter_context(shown(*words, folder=folder))


def own(view: Shown) -> str:
    """The Origin of the page itself."""
    return f"http://127.0.0.1:{view.port}"


def foreign_hosts(port: int) -> list[str | None]:
    """Names under which a page of another site may reach this computer."""
    return [
        *(None, "evil.example", f"evil.example:{port}", "127.0.0.1", "localhost", "[::1]"),
        *(f"127.0.0.1:{port + 1}", f"127.0.0.2:{port}", f"0.0.0.0:{port}", f"[::]:{port}"),
        *(f"localhost.evil.example:{port}", f"evil.localhost:{port}", f"localhost.:{port}"),
        *(f"127.0.0.1.nip.io:{port}", f"127.1:{port}", f"2130706433:{port}", f"0x7f.1:{port}"),
        *(f"127.0.0.1:{port}.evil.example", f"user@127.0.0.1:{port}", f"127.0.0.1:0{port}"),
        *(f"127.0.0.1:{port}, evil.example", f"evil.example, 127.0.0.1:{port}", "*", "/", "null"),
    ]


def foreign_origins(port: int) -> list[str]:
    """Origins of pages that are not ours."""
    return [
        *("null", "", "http://evil.example", f"http://evil.example:{port}", "http://127.0.0.1"),
        *("http://localhost", f"https://127.0.0.1:{port}", f"https://localhost:{port}", "file://"),
        *(f"http://127.0.0.1:{port + 1}", f"http://127.0.0.2:{port}", f"127.0.0.1:{port}", "*"),
        *(f"http://127.0.0.1:{port}.evil.example", f"http://127.0.0.1:{port}@evil.example"),
        *(f"http://evil.example/http://127.0.0.1:{port}", f"http://0.0.0.0:{port}", "about:blank"),
        *(f"http://localhost.evil.example:{port}", f"ws://127.0.0.1:{port}", "data:"),
        *(f"http://127.0.0.1:{port} http://evil.example", f"http://[::]:{port}", "blob:null"),
        *(f"http://LOCALHOST:{port}", f"chrome-extension://abcdef:{port}"),
    ]


def test_X20_names_of_other_computers_are_refused(view: Shown) -> None:
    """25 values of Host, of the page and of its live connection."""
    key = cookie(view)
    hosts = foreign_hosts(view.port)
    assert len(hosts) >= 25
    for host in hosts:
        assert ask(view.port, host=host, Cookie=key)[0] == 403, host
        live = ask(view.port, host=host, Cookie=key, Origin=own(view), **LIVE)
        assert live[0] == 403, host
    for name in ("localhost", "127.0.0.1", "[::1]"):
        assert ask(view.port, host=f"{name}:{view.port}", Cookie=key)[0] == 200, name


def test_X21_pages_of_other_sites_are_refused(view: Shown) -> None:
    """25 values of Origin, even where Host agrees with it."""
    key = cookie(view)
    origins = foreign_origins(view.port)
    assert len(origins) >= 25
    for origin in origins:
        assert ask(view.port, Cookie=key, Origin=origin, **LIVE)[0] == 403, origin
        assert ask(view.port, Cookie=key, Origin=origin)[0] == 403, origin
    assert ask(view.port, Cookie=key, **LIVE)[0] == 403  # no page at all
    trick = f"evil.example:{view.port}"
    assert ask(view.port, host=trick, Cookie=key, Origin=f"http://{trick}", **LIVE)[0] == 403
    assert ask(view.port, Cookie=key, Origin=own(view), **LIVE)[0] == 101


def test_X22_nobody_without_the_cookie_is_let_in(view: Shown) -> None:
    """A wrong, an old and no token; a wrong cookie."""
    old = view.link.partition(str(view.port))[2]
    key = cookie(view)
    name, _, secret = key.partition("=")
    assert len(secret) >= 43  # 256 bits in base 64
    wrong = secret[:-1] + ("A" if secret[-1] != "A" else "B")
    for path in ("/", old, "/?token=", "/?token=x", f"/?token={secret}", f"{old}&token=x"):
        assert ask(view.port, path)[0] == 403, path
    for line in ("", f"{name}=", f"{name}={wrong}", f"other={secret}", f"{key}; {name}={wrong}"):
        assert ask(view.port, Cookie=line)[0] == 403, line
        assert ask(view.port, Cookie=line, Origin=own(view), **LIVE)[0] == 403, line
    assert ask(view.port, Cookie=f"a=b; {key}")[0] == 200


def test_X24_nothing_but_the_page_is_served(view: Shown) -> None:
    """40 other paths, of files that are there as well."""
    key = cookie(view)
    ups = ["../" * count for count in range(1, 9)]
    paths = [f"/{up}etc/passwd" for up in ups]
    paths += [f"/{up.replace('/', '%2f')}etc%2fpasswd" for up in ups]
    paths += [f"/{up.replace('.', '%2e')}etc/passwd" for up in ups]
    paths += [f"/{up}etc\\passwd".replace("/..", "\\..") for up in ups]
    paths += ["//etc/passwd", "/index.html", "/.", "/..", "/./index.html", "/%00", "/assets", "*"]
    assert len(paths) == 40
    for path in paths:
        status, text = ask(view.port, path, Cookie=key)
        assert status in (400, 403, 404), path
        assert "root:" not in text


def test_X22_X25_the_answers_keep_the_page_to_itself(view: Shown) -> None:
    """The cookie is out of reach of scripts, and the page may load nothing from elsewhere."""
    path = view.link.partition(str(view.port))[2]
    text = ask(view.port, path)[1]
    set_cookie = re.search(r"(?i)set-cookie: (.*)", text)
    assert set_cookie is not None
    assert {"HttpOnly", "SameSite=Strict"} <= {part.strip() for part in set_cookie[1].split(";")}
    key = set_cookie[1].partition(";")[0]
    for answer in (text, ask(view.port, Cookie=key)[1], ask(view.port)[1]):
        head = answer.partition("\r\n\r\n")[0].lower()
        assert "referrer-policy: no-referrer" in head
        assert "access-control-allow-origin" not in head
        policy = re.search(r"content-security-policy: (.*)", head)
        assert policy is not None
        assert policy[1].startswith("default-src 'none'")
        assert "frame-ancestors 'none'" in policy[1]
        scripts = re.search(r"script-src ([^;]*)", policy[1])
        assert scripts is None or not re.search(r"'unsafe-(inline|eval)'|https?:|\*", scripts[1])


@pytest.mark.parametrize("name", COMMANDS)
def test_X19_the_page_of_every_command_is_behind_the_gate(name: str, tmp_path: Path) -> None:
    """A wrong Host, a wrong Origin, no cookie, an old link: 403, before and after one is let in."""
    with command(name, tmp_path) as view:
        old = view.link.partition(str(view.port))[2]
        assert ask(view.port)[0] == ask(view.port, Origin=own(view), **LIVE)[0] == 403
        key, evil = cookie(view), f"evil.example:{view.port}"
        assert ask(view.port, old)[0] == 403
        assert ask(view.port, host=evil, Cookie=key)[0] == 403
        assert ask(view.port, Cookie=key, Origin=f"http://{evil}", **LIVE)[0] == 403
        assert ask(view.port, Cookie=key)[0] == 200
        assert ask(view.port, Cookie=key, Origin=own(view), **LIVE)[0] == 101
        assert listening(view.port) == [f"0100007F:{view.port:04X}"]  # 127.0.0.1, little end first


def listening(port: int) -> list[str]:
    """Addresses of all sockets that listen with a port, as the kernel writes them."""
    return [
        line.split()[1]
        for name in ("tcp", "tcp6")
        for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]
        if line.split()[3] == "0A" and line.split()[1].endswith(f":{port:04X}")
    ]
