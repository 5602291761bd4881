"""Does the shipped `drive` end as documented, whatever happens to it before the shipped `twin`?

Both run as processes, over pseudo-terminals, or TCP where cables are pulled. Each case breaks
something at a random moment of the walk, `--runs` times, and says what came of it:

    python benchmarks/drive_faults.py --runs 20 --json > outcomes.json
    python benchmarks/drive_faults.py --cases SIGTERM "bus silent"
"""

import argparse
import contextlib
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from wires import Cable

from antennate.twin.faults import read

ANTENNATE = [sys.executable, "-c", "import sys; from antennate.cli import main; sys.exit(main())"]
DRY_RUN, WALK, LONG_WALK = 1.0, 8.0, 30.0
"""Times of a drive [s]: a long walk where what happens is to end it sooner."""
EARLY, LATE = 0.3, 3.0
"""When something happens, after the first command was sent [s]."""
PATIENCE = 90.0
"""Time after which a drive hangs [s]: it waits 30 s for a lost bus, and 10 s after a fault."""
FILE = "twin.toml"
"""What the twin writes of its robot, zeros and directions."""


class Run:
    """A twin and a drive before it, while it walks.

    Attributes:
        drive: The process of the drive.
        place: A folder for everything.
        folder: Where the drive writes.
        cables: Of board and bus, if they can be pulled.
    """

    def __init__(self, twin: subprocess.Popen[str], paths: dict[str, str], place: Path) -> None:
        self._twin, self.place, self.folder = twin, place, place / "run"
        self.cables: dict[str, Cable] = {}
        self.paths = paths
        self.lines: list[str] = []

    def start(self, *more: str) -> None:
        """Start the drive, and wait until it walks."""
        ports = ["--esp32", self.paths["esp32"], "--bus", self.paths["bus"]]
        times = ["--dry-run", str(DRY_RUN), "--fault-time", "1"]
        words = ["drive", "--arm", "--no-touch-check", "--bus-return", "5", *ports, *times, *more]
        words += ["--config", str(self.place / FILE)]
        self.drive = subprocess.Popen(
            [*ANTENNATE, *words, "--out", str(self.folder)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert self.drive.stderr is not None
        for line in self.drive.stderr:
            self.lines.append(line.rstrip())
            if " sent=" in line and " sent=0 " not in line:
                return

    def order(self, text: str) -> None:
        """Tell the twin something."""
        assert self._twin.stdin is not None
        self._twin.stdin.write(f"{text}\n")
        self._twin.stdin.flush()

    def end(self) -> dict[str, Any]:
        """Wait for the drive; what is left of it."""
        try:
            out, err = self.drive.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self.drive.kill()
            out, err = self.drive.communicate()
            self.lines.append("HANGS")
        self.lines += [line for line in (out + err).splitlines() if line.strip()]
        found = self.folder / "result.json"
        result = json.loads(found.read_text()) if found.exists() else {}
        return {"code": self.drive.returncode, **result}


@contextlib.contextmanager
def twin(tcp: bool) -> Iterator[Run]:
    """A twin, and a place for what a drive before it writes."""
    with (
        tempfile.TemporaryDirectory() as place,
        contextlib.ExitStack() as stack,
        subprocess.Popen(
            [
                *[*ANTENNATE, "twin", "--orders", "-", *(["--tcp", "0"] if tcp else [])],
                *["--robot-toml", str(Path(place) / FILE)],
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stack.enter_context((Path(place) / "twin").open("w")),
            text=True,
        ) as process,
    ):
        assert process.stdout is not None
        run = Run(process, json.loads(process.stdout.readline()), Path(place))
        if tcp:
            for name, address in run.paths.items():
                run.cables[name] = stack.enter_context(Cable(address))
                run.paths[name] = run.cables[name].address
        try:
            yield run
        finally:
            process.terminate()


Act = Callable[[Run], None]
Check = Callable[[dict[str, Any]], bool]


def fault(text: str) -> Act:
    """Let a fault begin; BadInputError if the twin does not know it."""
    read(text)
    return lambda run: run.order(f"fault {text}")


def send(name: str) -> Act:
    """Send a signal to the drive alone."""
    return lambda run: run.drive.send_signal(getattr(signal, name))


def freeze(run: Run) -> None:
    """Stop the program for two seconds."""
    run.drive.send_signal(signal.SIGSTOP)
    time.sleep(2.0)
    run.drive.send_signal(signal.SIGCONT)


def pull(name: str) -> Act:
    """Pull a cable for a second and a half."""

    def act(run: Run) -> None:
        run.cables[name].pull()
        time.sleep(1.5)
        run.cables[name].plug()

    return act


def fill(run: Run) -> None:
    """Leave no byte of the disk free."""
    with (run.folder.parent / "filled").open("wb", buffering=0) as file:
        for size in (4096, 1):
            with contextlib.suppress(OSError):
                while file.write(b"x" * size):
                    pass


def walks_on(found: dict[str, Any]) -> bool:
    """To the end of its time, and no torque at the end."""
    return found["code"] == 0 and found["torque_off"] is True and found["ended"] == TIME


def ends(found: dict[str, Any]) -> bool:
    """By a signal, in order."""
    return found["code"] == 0 and found["torque_off"] is True and found["ended"] == "a signal"


def faults(found: dict[str, Any]) -> bool:
    """With a FAULT, torque off confirmed."""
    return found["code"] == 2 and worst(found) and found["torque_off"] is True


def named(*servos: int) -> Check:
    """With a FAULT, and just these servos do not confirm that their torque is off."""
    return lambda f: f["code"] == 2 and worst(f) and sorted(f["servos_on"]) == list(servos)


def names(cause: str, servo: int) -> Check:
    """With a FAULT of this cause that names the servo, torque off confirmed."""
    said = re.compile(rf"{cause}: [^()]*\(servo {servo}: ")
    return lambda f: faults(f) and said.search(f["why"]) is not None


def told(found: dict[str, Any]) -> bool:
    """It walks on, or it is a FAULT with all torque confirmed off or the other servos named."""
    if found["code"] == 0:
        return walks_on(found)
    off = found["torque_off"] is True
    return found["code"] == 2 and worst(found) and off != bool(found["servos_on"])


def killed(found: dict[str, Any]) -> bool:
    """No result, and a log that can be read."""
    return found["code"] == -signal.SIGKILL and "worst_state" not in found


def worst(found: dict[str, Any]) -> bool:
    """It is a fault, or the supply was gone."""
    return found["worst_state"] in ("FAULT", "OFF")


def without_log(found: dict[str, Any]) -> bool:
    """It walks on, and says that its log ended before it did."""
    return walks_on(found | {"code": 0}) and (found["code"], found["log_cut"]) == (2, True)


def holds(*words: str) -> Check:
    """It holds to the end of its time, torque off confirmed, and the cause is told so."""
    return lambda f: (
        walks_on(f) and f["worst_state"] == "HOLD" and all(word in f["why"] for word in words)
    )


def echoes(found: dict[str, Any]) -> bool:
    """It walks on, and says that requests came back."""
    return walks_on(found) and found["echoes"] > 0


TIME = "the end of its time"
WALKS_OR_FAULT = "walks on, or FAULT, torque off confirmed or servos named"
ALL = tuple(range(1, 20))
CASES: dict[str, tuple[Act, Check, str]] = {
    "nothing": (lambda run: None, walks_on, "walks on"),
    "board reset": (fault("esp32=reset"), walks_on, "holds, walks on"),
    "board replugged": (pull("esp32"), walks_on, "holds, walks on"),
    "bus replugged": (pull("bus"), faults, "FAULT, torque off confirmed"),
    "bus silent": (fault("bus=silent"), named(*ALL), "FAULT, all servos named"),
    "servo silent": (fault("servo:7=silent"), named(7), "FAULT, servo 7 named"),
    "servo reboots": (fault("servo:7=reboot"), faults, "FAULT, torque off confirmed"),
    "servo overloaded": (fault("servo:7=overload"), faults, "FAULT, torque off confirmed"),
    "leg cut": (fault("servo:9=goal_pwm:0"), names("NOT_FOLLOWING", 9), "FAULT, leg_r1 named"),
    "yaw cut": (fault("servo:2=goal_pwm:0"), names("NOT_FOLLOWING", 2), "FAULT, yaw2 named"),
    "leg frozen": (fault("servo:9=frozen"), names("NOT_FOLLOWING", 9), "FAULT, leg_r1 named"),
    "yaw frozen": (fault("servo:2=frozen"), names("NOT_FOLLOWING", 2), "FAULT, yaw2 named"),
    "yaw out of limits": (
        fault("servo:2=jump:-4096"),
        names("OUT_OF_LIMITS", 2),
        "FAULT, yaw2 named",
    ),
    "leg leaps": (fault("servo:9=jump:4096"), names("IMPOSSIBLE_SPEED", 9), "FAULT, leg_r1 named"),
    "mode changed": (
        fault("servo:2=operating_mode:1"),
        names("WRONG_MODE", 2),
        "FAULT, yaw2 named",
    ),
    "servo 50 ms late": (fault("servo:7=late:0.05"), told, WALKS_OR_FAULT),
    "servo bad CRC": (fault("servo:7=bad_crc"), told, WALKS_OR_FAULT),
    "BER 1e-5": (fault("wire=ber:1e-5"), walks_on, "walks on"),
    "BER 1e-4": (fault("wire=ber:1e-4"), walks_on, "walks on"),
    "BER 1e-3": (fault("wire=ber:1e-3"), told, WALKS_OR_FAULT),
    "BER 1e-2": (fault("wire=ber:1e-2"), told, WALKS_OR_FAULT),
    "supply sags 1 V/s": (fault("bus=discharge:1"), faults, "OFF or FAULT, torque off confirmed"),
    "hum 400": (fault("esp32=hum:400"), holds("NOISE", "50 Hz or an alias"), "HOLD, NOISE, 50 Hz"),
    "stuck +-1": (fault("esp32=stuck_left"), holds("STUCK", "left"), "HOLD, STUCK, left"),
    "sticky codes": (fault("esp32=sticky"), walks_on, "walks on"),
    "echo": (fault("bus=echo"), echoes, "walks on, the echo is named"),
    "SIGINT": (send("SIGINT"), ends, "torque off confirmed"),
    "SIGTERM": (send("SIGTERM"), ends, "torque off confirmed"),
    "SIGQUIT": (send("SIGQUIT"), ends, "torque off confirmed"),
    "SIGHUP": (send("SIGHUP"), ends, "torque off confirmed"),
    "SIGKILL": (send("SIGKILL"), killed, "killed; the next drive takes the torque off"),
    "SIGSTOP": (freeze, faults, "FAULT, torque off confirmed"),
    "full disk": (fill, without_log, "walks on, log not complete"),
}


def once(case: str, chance: random.Random) -> dict[str, Any]:
    """One run of a case: what came of it, and whether that is as documented."""
    act, check, _ = CASES[case]
    with twin(tcp="replugged" in case) as run, _disk(case, run):
        walk = WALK if check in (walks_on, told, without_log) else LONG_WALK
        run.start("--duration", str(walk))
        walked = run.drive.poll() is None
        time.sleep(chance.uniform(EARLY, LATE))
        if run.drive.poll() is None:
            act(run)
        found = run.end()
        if case == "SIGKILL":
            found["next"] = _next(run)
        said = (run.place / "twin").read_text()
    assert "not done" not in said, said  # an order that was refused would test nothing
    trace = any("Traceback" in line for line in run.lines)
    complete = "worst_state" in found or case == "SIGKILL"
    keys = ("code", "worst_state", "why", "torque_off", "servos_on", "ended", "refusal", "next")
    keys = (*keys, "pace")
    outcome = {key: found[key] for key in keys if key in found}
    good = walked and complete and not trace and "HANGS" not in run.lines and check(found)
    good = good and found.get("next", 0) == 0
    return {"as_documented": good, **outcome, "last": [] if good else run.lines[-4:]}


def _next(run: Run) -> int:
    """The exit code of a drive before the same twin after one that was killed."""
    time.sleep(0.5)
    run.folder = run.folder.with_name("next")
    run.start("--duration", "1")
    found = run.end()
    return found["code"] if found.get("torque_off") is True else 1


@contextlib.contextmanager
def _disk(case: str, run: Run) -> Iterator[None]:
    """For a full disk, a file system with room for two seconds of log; needs root, Linux."""
    if case != "full disk":
        yield
        return
    place = run.folder.parent / "small"
    place.mkdir()
    size = ["-o", "size=160k"]
    subprocess.run(["mount", "-t", "tmpfs", *size, "tmpfs", str(place)], check=True)
    run.folder = place / "run"
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def main() -> None:
    """Run the cases and print what came of them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--runs", type=int, default=1, help="runs of each case")
    parser.add_argument("--cases", nargs="*", default=list(CASES), choices=list(CASES))
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    parser.add_argument("--json", action="store_true", help="print one JSON object and no table")
    args = parser.parse_args()
    table: dict[str, Any] = {}
    for case in args.cases:
        if case == "full disk" and os.geteuid() != 0:
            table[case] = {"runs": 0, "as_documented": 0, "found": "needs root"}
            continue
        found = [once(case, random.Random(f"{args.seed} {case} {n}")) for n in range(args.runs)]
        good = sum(one["as_documented"] for one in found)
        kinds = Counter(f"{one.get('worst_state')}, exit {one['code']}" for one in found)
        table[case] = {
            "runs": args.runs,
            "as_documented": good,
            "documented": CASES[case][2],
            "found": dict(kinds),
            "others": [one for one in found if not one["as_documented"]],
        }
        if not args.json:
            said = "; ".join(f"{kind}: {count}" for kind, count in kinds.items())
            print(f"{case:18} {good}/{args.runs}  {CASES[case][2]}  ({said})", flush=True)
            for one in table[case]["others"]:
                print(f"    {one}", flush=True)
    if args.json:
        print(json.dumps({"cores": os.cpu_count(), "seed": args.seed, "cases": table}, indent=1))


if __name__ == "__main__":
    main()
