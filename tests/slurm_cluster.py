"""A cluster of SLURM with one node, this machine, in a folder and on free ports."""

from __future__ import annotations

import contextlib
import os
import pwd
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scancel", "scontrol", "squeue", "srun")
CORES = 2
LIMIT = 60
"""Longest time limit of a job [min]."""
CONF = """
ClusterName=antennae
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
SchedulerParameters=bf_interval=1,sched_interval=1,sched_min_interval=100000
ReturnToService=2
KillWait=1
MessageTimeout=2
MailProg=/bin/true
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN
PartitionName=short Nodes=ALL Default=YES MaxTime={limit} State=UP
"""
"""A job that SLURM begins again waits for 5 s in place of 120 s."""
SACCT = """#!/bin/sh
echo 'JobID|State|NodeList'
exec squeue --noheader --states=all --format='%A|%T|%N'
"""
"""What submitit asks for jobs: without a database of accounts, the controller knows them."""


class NoCluster(Exception):
    """There can be none here; the text says why."""


class Cluster:
    """A cluster that runs.

    Attributes:
        known: Environment of a program that is to find it.
        folder: Where it keeps everything.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        there = os.pathsep.join([str(folder), os.environ["PATH"], "/usr/sbin", "/usr/local/sbin"])
        self.known = {**os.environ, "PATH": there, "SLURM_CONF": str(folder / "slurm.conf")}
        if missing := [each for each in PROGRAMS if shutil.which(each, path=there) is None]:
            raise NoCluster(f"not installed: {', '.join(missing)}")
        self._daemons: dict[str, subprocess.Popen[bytes]] = {}

    def start(self) -> None:
        """Start it.

        Raises:
            NoCluster: The daemons do not run here.
        """
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        (self.folder / "munge.key").write_bytes(secrets.token_bytes(1024))
        (self.folder / "munge.key").chmod(0o600)
        here = ("127.0.0.1", 0)
        with socket.create_server(here) as one, socket.create_server(here) as two:
            ports = (one.getsockname()[1], two.getsockname()[1])
        host, user = socket.gethostname().partition(".")[0], pwd.getpwuid(os.getuid()).pw_name
        told = {"folder": self.folder, "ports": ports, "cores": CORES, "limit": LIMIT}
        (self.folder / "slurm.conf").write_text(CONF.format(host=host, user=user, **told))
        (self.folder / "sacct").write_text(SACCT)
        (self.folder / "sacct").chmod(0o700)
        munge = self.folder / "munge"
        files = [f"--{each}-file={munge}.{each}" for each in ("key", "pid", "log", "seed")]
        self._daemon("munged", "--foreground", "--force", f"--socket={munge}.socket", *files)
        self.until((self.folder / "munge.socket").exists)
        self.start_controller()
        self._daemon("slurmd", "-D")
        self.until(lambda: "idle" in self.say("sinfo", "--noheader", "--format=%t"))

    def start_controller(self) -> None:
        """Start what jobs are submitted to."""
        self._daemon("slurmctld", "-D")
        self.until(lambda: "UP" in self.say("scontrol", "ping"))

    def stop_controller(self) -> None:
        """Stop it; jobs that run go on."""
        daemon = self._daemons.pop("slurmctld")
        daemon.terminate()
        daemon.wait()

    def stop(self) -> None:
        """End every job and every daemon, whatever state they are in."""
        try:
            if "slurmctld" in self._daemons and "slurmd" in self._daemons:
                with contextlib.suppress(NoCluster):
                    self.end_jobs()
        finally:
            for daemon in reversed(self._daemons.values()):
                daemon.kill()
                daemon.wait()
            for process in self.processes(f"SLURM_CONF={self.folder}/slurm.conf"):
                with contextlib.suppress(OSError):
                    os.kill(process, signal.SIGKILL)

    def say(self, *words: str) -> str:
        """What a command prints; nothing if it fails."""
        done = subprocess.run(words, env=self.known, capture_output=True, text=True, timeout=60.0)
        return done.stdout if done.returncode == 0 else ""

    def jobs(self) -> dict[str, str]:
        """States of the jobs that wait, run or are being ended, by number."""
        lines = self.say("squeue", "--noheader", "--format=%A %T").splitlines()
        return dict(line.split() for line in lines)

    def end_jobs(self) -> None:
        """Cancel all jobs, and wait until they have ended."""
        self.say("scancel", f"--user={os.getuid()}")
        self.until(lambda: not self.jobs())

    def running(self) -> list[str]:
        """Numbers of the jobs that run."""
        return [number for number, state in self.jobs().items() if state == "RUNNING"]

    def processes(self, *known: str) -> list[int]:
        """Processes that have all of this in the environment that they were started with."""
        found = []
        for path in Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):
                lines = path.read_bytes().decode(errors="replace").split("\0")
                if set(known) <= set(lines):
                    found.append(int(path.parent.name))
        return found

    def _daemon(self, name: str, *words: str) -> None:
        """Start a daemon that ends with this process, however that ends."""
        ends = [] if shutil.which("setpriv") is None else ["setpriv", "--pdeathsig=KILL"]
        with (self.folder / f"{name}.log").open("ab") as log:
            self._daemons[name] = subprocess.Popen(
                [*ends, name, *words], env=self.known, stdout=log, stderr=log
            )

    def until(self, done: Callable[[], object]) -> None:
        """Wait until something is so.

        Raises:
            NoCluster: It is not, or a daemon has ended.
        """
        end = time.monotonic() + 30.0
        while not done():
            for name, daemon in self._daemons.items():
                if daemon.poll() is not None or time.monotonic() > end:
                    lines = (self.folder / f"{name}.log").read_text().splitlines()
                    raise NoCluster(f"{name} does not run here: {lines[-1] if lines else ''}")
            time.sleep(0.1)


@contextlib.contextmanager
def cluster(folder: Path) -> Iterator[Cluster]:
    """A cluster in a folder; all of it ends with the block.

    Raises:
        NoCluster: There can be none here.
    """
    made = Cluster(folder)
    try:
        made.start()
        yield made
    finally:
        made.stop()
