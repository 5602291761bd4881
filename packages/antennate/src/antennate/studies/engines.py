"""Where trials are run: processes of this machine, Dask, SLURM, a GPU, or any executor."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from antennate.errors import ConfigError, WorkerError
from antennate.messages import shown
from antennate.studies.work import Call, Engine, Together, processor

LOCAL = "local"
WARP = "warp"
EVERYWHERE = (LOCAL, "dask", "dask://HOST:PORT", "slurm", "slurm-local")
"""How an engine is named; slurm-local starts what would be jobs as processes of this machine."""
BATCHED = (WARP, f"{WARP}:DEVICE")
"""How an engine is named that only tunnel and studies of it have."""
NO_BATCHES = "--engine warp: expected tunnel or a study of it"
FORMS = (*EVERYWHERE, *BATCHED)


def make_engine(name: Any, slurm: Sequence[str] = ()) -> Engine | None:
    """The engine of a name or of an object of the user; None is this machine.

    Args:
        name: One of FORMS, or an executor.
        slurm: What SLURM is asked for, each as NAME=VALUE.
    """
    if slurm and name not in ("slurm", "slurm-local"):
        raise ConfigError("--slurm: expected --engine slurm beside it, found another engine")
    if name == LOCAL:
        return None
    if isinstance(name, str) and re.fullmatch(rf"{WARP}(:.+)?", name):
        return Device(name.partition(":")[2] or None)
    if isinstance(name, str):
        # these need packages that are optional
        from antennate.studies.dask import Dask
        from antennate.studies.slurm import Slurm

        if name in ("slurm", "slurm-local"):
            return Slurm("slurm" if name == "slurm" else "local", slurm)
        if name == "dask":
            return Dask()
        if re.fullmatch(r"dask://[^/\s]+:[0-9]{1,5}", name):
            return Dask(name.removeprefix("dask://"))
        raise ConfigError(f"engine: expected one of {', '.join(FORMS)}, found {shown(name)}")
    if not callable(getattr(name, "submit", None)):
        raise ConfigError(
            f"engine: expected a name or an object with submit, found {type(name).__name__}"
        )
    from antennate.studies.submitted import Submitted  # only where workers are elsewhere

    return Submitted("executor", name.submit)


class NoMore:
    """No worker: all tasks have been finished elsewhere, by shards."""

    name = "merge"

    def run(self, call: Call, count: int) -> None:
        """Refuse tasks that wait; see `Engine`."""
        total = len(call.work.tasks)
        raise WorkerError(
            f"expected {total} finished trials, found {total - len(call.places)}: a shard is "
            "missing"
        )


class Device:
    """All tasks at once, as one batch on a GPU, in this process.

    Args:
        device: Name of a device of Warp, as cuda:0 or cpu; a GPU if not given.
    """

    name = WARP

    def __init__(self, device: str | None = None) -> None:
        self._device = device

    def run(self, call: Call, count: int) -> None:
        """Carry out all parts of a call; see `Engine`."""
        function = call.work.function
        batched = function.batched if isinstance(function, Together) else None
        if batched is None:
            raise ConfigError(f"{NO_BATCHES}; this one has no batches on a GPU")
        call.saw(processor())
        places = call.places
        tasks = [call.work.tasks[place] for place in places]
        batched(
            tasks,
            lambda i, result: call.emit(places[i], result),
            lambda i, failure: call.fail(places[i], failure),
            self._device,
        )
