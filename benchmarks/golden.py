"""Runs everything once, small, and keeps what comes out: `python benchmarks/golden.py FOLDER`.

Made before a change and after it, two such folders are compared with `same_numbers.py OLD NEW`: not
one value may differ. There are runs of the experiments with one worker and with two, one that was
killed and resumed, logs of simulated trials and what a replay decides upon them, environments under
drawn actions, a learned policy, each tick of a drive in lock-step, and the bytes that a twin and
its board sent in a minute. Ten minutes on two cores. Parts by name: `golden.py FOLDER antenna
tunnel drive`.
"""

from __future__ import annotations

import csv
import importlib
import json
import math
import os
import select
import shutil
import signal
import subprocess
import sys
import time
import tty
from pathlib import Path

ROOT = Path(__file__).parents[1]
ANTENNATE = (sys.executable, "-m", "antennate")
TRIALS = "--trials 3 --seed 5 --time-limit 30"
ALONE = {
    "antenna": "antenna",
    "gait": "gait --cycles 2 --settling-cycles 1 --sweep-points 4",
    "gait_hexapod": "gait --robot hexapod --cycles 2 --settling-cycles 1 --sweep-points 4",
    "calibrate": "calibrate",
    "geometry": "geometry --gaits 3 --wave-numbers 1 --leads 5 --front-waves 1 --turns 1 "
    "--cells 6 --repeats 1",
    "dataset": "dataset --trials 10",
    "force": "bench force --profiles stiff descending --traverses 6 --loads 6 --place-step 0.25",
}
"""Runs without workers, or whose trials are few."""
POOLED = {
    "touch": "bench touch --trials 1 --walls flat boulders --speeds 0.1 "
    "--profiles stiff descending",
    "wall": "bench wall --trials 2",
    "sweep": "bench sweep --profiles stiff --distances 0.5 --centres 1.2 --amplitudes 0.5 "
    "--sweeps 1",
    "tunnel": f"tunnel {TRIALS}",
    "corridors": "tunnel --scene corridors --trials 2 --time-limit 20 --controllers random map",
    "links": f"tunnel --robot {ROOT / 'examples' / 'eight_links.toml'} --trials 1 --time-limit 20",
    "climb": "climb --heights 0.08 --grounds gap:0.1 --conditions rhythm climb --divisors 128 "
    "--sensing 1 --time-limit 8",
    "compete": "compete --controllers open closed --scenes corner --trials 1 --decision-limit 10",
    "policy": f"tunnel --controllers {ROOT / 'entries' / 'apprentice' / 'policy.onnx'} --trials 3 "
    "--time-limit 20 --robot.legs.fastest 6.29",
    "readings": f"tunnel {TRIALS} --controllers closed --readings swapped yoked delayed:0.2",
    "knows": f"tunnel {TRIALS} --controllers timed closed --knows side jam",
    "study": f"study {ROOT / 'studies' / 'smoke.toml'}",
}
"""Runs with one worker and with two."""
KILLED = "tunnel --trials 8 --seed 6 --time-limit 30 --controllers open closed --workers 2"
LOGGED = f"tunnel {TRIALS} --log"
MINUTE = 6000
"""Control ticks."""
DRIVEN = (("closed", 1, math.inf), ("paper", 0, 600.0))
"""Controller, trial and most ticks of each drive in lock-step."""
ENVIRONMENTS = (("Tunnel-v1", "maneuver"), ("UTurn-v1", "gait"), ("Corner120-v1", "joints"))
STEPS = 60
"""Decisions in each environment."""


def antennate(words: str, *more: str | Path) -> None:
    """Run a command, which must succeed."""
    done = subprocess.run(
        [*ANTENNATE, *words.split(), *map(str, more)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    if done.returncode:
        sys.exit(f"{words}: {done.returncode}: {done.stderr.decode()[-2000:]}")


def run(words: str, folder: Path, *more: str) -> None:
    """A run without figures."""
    antennate(words, "--no-figures", "--out", folder, *more)


def killed(folder: Path) -> None:
    """A run whose processes are killed after some rows, then resumed."""
    words = [*ANTENNATE, *KILLED.split(), "--no-figures", "--out", str(folder)]
    store = folder / "trials.jsonl"
    quiet = subprocess.DEVNULL
    with subprocess.Popen(words, start_new_session=True, stdout=quiet, stderr=quiet) as process:
        while process.poll() is None:
            if store.exists() and store.read_bytes().count(b"\n") > 4:
                os.killpg(process.pid, signal.SIGKILL)
                break
            time.sleep(0.01)
    run(KILLED, folder, "--resume")


def logged(folder: Path) -> None:
    """Logs of trials, and what replays decide upon them."""
    run(LOGGED, folder / "run")
    for log in sorted((folder / "run").rglob("*.mcap")):
        name = log.parent.name + "-" + log.stem if log.parent.name != "logs" else log.stem
        antennate("log replay", log, "--out", folder / f"replay-{name}")
        antennate("log replay --controller paper", log, "--out", folder / f"paper-{name}")


def take(received: dict[int, bytearray], open_ports: set[int], patience: float = 0.0) -> bool:
    """Take what has come to ports; whether any came within a time [s]. One that ended goes."""
    ready, _, _ = select.select(list(open_ports), [], [], patience)
    for port in ready:
        try:
            data = os.read(port, 65536)
        except OSError:
            data = b""
        if not data:
            open_ports.discard(port)
        received[port] += data
    return bool(ready)


def packets_of(tick: int) -> bytes:
    """What the robot is told in a tick: legs and yaw that swing; each tenth, where they are."""
    from antennate.robots.spec import RobotSpec
    from dynamixel_bus import packets

    robot = RobotSpec()
    swing = round(150 * math.sin(2 * math.pi * 0.006 * tick))
    goals = {
        servo: (zero + swing * (-1) ** place).to_bytes(4, "little", signed=True)
        for place, (servo, zero) in enumerate(zip(robot.ids, robot.zeros, strict=True))
    }
    asked = packets.sync_read(list(robot.ids), 132, 4) if tick % 10 == 0 else b""
    torque = packets.sync_write(64, dict.fromkeys(robot.ids, b"\x01")) if tick == 0 else b""
    return torque + asked + packets.sync_write(116, goals)


def frames_of(data: bytes) -> list[bytes]:
    """Frames of a board from its tenth sample on; when it is heard first is a matter of time."""
    from antennate.hardware.esp32 import frame
    from antennate.hardware.esp32.wire import Sample, parse

    frames = [chunk for chunk in data.split(b"\0") if chunk]
    for place, chunk in enumerate(frames):
        body = frame.unstuff(chunk)
        if body and isinstance(found := parse(body[: -frame.CRC_SIZE]), Sample) and found.seq == 10:
            return frames[place : place + MINUTE - 100]
    sys.exit(f"expected the tenth sample among {len(frames)} frames of the board, found none")


def served(folder: Path) -> None:
    """What a twin in lock-step and its board send while a robot swings its joints for a minute."""
    folder.mkdir(parents=True)
    words = [*ANTENNATE, "twin", "--pace", "lockstep", "--duration", f"{0.01 * MINUTE}"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        ports = json.loads(process.stdout.readline())
        board, bus = (os.open(ports[name], os.O_RDWR | os.O_NONBLOCK) for name in ("esp32", "bus"))
        received = {board: bytearray(), bus: bytearray()}
        open_ports = set(received)
        for port in received:
            tty.setraw(port)
        for tick in range(MINUTE):
            packet = packets_of(tick)
            while packet:
                try:
                    packet = packet[os.write(bus, packet) :]
                except BlockingIOError:
                    take(received, open_ports, 0.01)
            take(received, open_ports)
        while open_ports and take(received, open_ports, 5.0):
            pass
        process.wait(60)
    (folder / "board.bytes").write_bytes(b"\0".join(frames_of(bytes(received[board]))))
    (folder / "bus.bytes").write_bytes(received[bus])


def driven(folder: Path) -> None:
    """Each tick of drives in lock-step, through session, supervisor and bytes."""
    sys.path.insert(0, str(ROOT / "tests"))
    drive = importlib.import_module("driven_rig").driven

    from antennate.experiments.tunnel.physics import TunnelConfig

    folder.mkdir(parents=True)
    for name, trial, ticks in DRIVEN:
        walk = drive(TunnelConfig(seed=0), name, trial, ticks).walk
        with (folder / f"{name}.csv").open("w", newline="") as file:
            table = csv.writer(file)
            table.writerow(["t", "left", "right", "maneuver", "command", "goals"])
            for reading, maneuver, command, goals in zip(
                walk.readings, walk.maneuvers, walk.commands, walk.goals, strict=False
            ):
                table.writerow([*map(repr, reading), maneuver, command.hex(), *goals])


def stepped(folder: Path) -> None:
    """Observations and rewards of environments in lockstep, under actions drawn by a seed."""
    import gymnasium as gym

    importlib.import_module("antennate.envs")
    folder.mkdir(parents=True)
    for name, action in ENVIRONMENTS:
        env = gym.make_vec(f"antennate/{name}", 2, action=action)
        env.action_space.seed(4)
        state, _ = env.reset(seed=4)
        with (folder / f"{name}-{action}.csv").open("w", newline="") as file:
            table = csv.writer(file)
            table.writerow(["step", "robot", "reward", "ended", "cut", "state"])
            for step in range(STEPS):
                state, reward, ended, cut, _ = env.step(env.action_space.sample())
                for i, row in enumerate(state):
                    cells = reward[i].item(), bool(ended[i]), bool(cut[i])
                    table.writerow([step, i, *cells, row.tobytes().hex()])
        env.close()


def main(folder: Path, wanted: list[str]) -> None:
    """Make the parts that are wanted, all without names; a part that is there is made anew."""
    parts = {name: lambda f, w=words: run(w, f) for name, words in ALONE.items()}
    for name, words in POOLED.items():
        for count in (1, 2):
            parts[f"{name}-{count}"] = lambda f, w=words, c=count: run(w, f, "--workers", str(c))
    parts |= {"killed": killed, "logged": logged, "twin": served, "drive": driven, "envs": stepped}
    if unknown := [each for each in wanted if each not in parts and f"{each}-1" not in parts]:
        sys.exit(f"expected parts of {', '.join(parts)}, found {', '.join(unknown)}")
    names = [name for name in parts if not wanted or name in wanted or name[:-2] in wanted]
    for name in names:
        began = time.monotonic()
        shutil.rmtree(folder / name, ignore_errors=True)
        parts[name](folder / name)
        print(f"{name}: {time.monotonic() - began:.0f} s", flush=True)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("expected a folder, and perhaps names of parts")
    main(Path(sys.argv[1]), sys.argv[2:])
