"""Write docs/performance.md from docs/performance.json and .toml.

`uv run python benchmarks/performance.py` measures and writes that file, part by part.
"""

import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from generated import finish, heads, row

RESULT = Path(__file__).with_name("performance.json")
COMMAND = "uv run python benchmarks/performance.py"
IDLE = 0.1
"""Cores that other programs may have kept busy where a machine counts as idle."""
HEAD = f"""\
# Performance

What a trial costs, how the cost grows, what a second core brings, and how other simulators do on
the nearest job. These commands measure it:

```sh
{COMMAND} # ten minutes on an idle machine; --quick: two
{COMMAND} --parts trial start
```

All ratios of a part are taken in one run on one machine. The cases alternate, so that a change of
load or speed affects all of them equally. A figure is the median over repetitions, with the
smallest and the largest in brackets. Compare ratios between machines, not seconds.
"""
Figures = Mapping[str, Any]


def short(value: float, digits: int = 3) -> str:
    """A number with so many significant digits, without an exponent if it is not tiny."""
    return f"{float(f'{value:.{digits}g}'):g}"


def told(found: Mapping[str, float], digits: int = 3) -> str:
    """A median with its smallest and largest."""
    median, low, high = (short(found[name], digits) for name in ("median", "low", "high"))
    return median if low == high else f"{median} ({low}–{high})"


def table(names: tuple[str, ...], rows: Sequence[tuple[object, ...]]) -> str:
    return "\n".join([heads(*names), *(row(*cells) for cells in rows)]) + "\n"


def machines(parts: Mapping[str, Any]) -> str:
    """When and where each part was measured, and how busy the machine was."""
    known: list[Mapping[str, Any]] = []
    rows = list[tuple[object, ...]]()
    for name in parts:
        about = parts[name]["about"]
        if about["machine"] not in known:
            known.append(about["machine"])
        rows.append(
            (
                name + " (quick)" * about["quick"],
                about["date"],
                known.index(about["machine"]) + 1,
                "not measured" if about["seconds"] is None else f"{about['seconds']} s",
                "not measured" if about["others"] is None else about["others"],
                f"{about['load_before']}, {about['load_after']}",
            )
        )
    columns = ("part", "date", "machine", "took", "other programs [cores]", "load before, after")
    lines = ["## When and where", "", table(columns, rows)]
    for number, machine in enumerate(known, start=1):
        packages = ", ".join(f"{name} {version}" for name, version in machine["packages"].items())
        lines.append(
            f"Machine {number}: {machine['cpu']}, {machine['cores']} cores, {machine['system']}, "
            f"Python {machine['python']}; {packages}.\n"
        )
    busy = [name for name in parts if (parts[name]["about"]["others"] or 0.0) > IDLE]
    if busy:
        lines.append(
            f"**The machine was not idle** while {', '.join(busy)} ran: other programs kept more "
            f"than {IDLE:g} cores busy. Ratios of times on the clock suffer most.\n"
        )
    return "\n".join(lines)


def aims(parts: Mapping[str, Any]) -> str:
    """What was aimed at, and whether it is so."""
    rows = list[tuple[object, ...]]()

    def add(part: str, what: str, found: Mapping[str, float], bound: float, most: bool) -> None:
        about = parts[part]["about"]
        met = found["median"] <= bound if most else found["median"] >= bound
        asked = f"{'at most' if most else 'at least'} {bound:g}"
        unsure = ", quick" * about["quick"] + ", machine not idle" * (about["others"] > IDLE)
        if found["low"] <= bound <= found["high"] and found["count"] > 1:
            unsure += ", repetitions on both sides"
        rows.append((what, asked, told(found), ("met" if met else "**not met**") + unsure))

    if "trial" in parts:
        most, found = [*parts["trial"]["figures"]["at_once"].items()][-1]
        what = f"trial over bare engine, {most} in lockstep (CPU time)"
        add("trial", what, found["over_bare_engine"], 1.15, True)
        one = parts["trial"]["figures"]["at_once"]["1"]["over_bare_engine"]
        add("trial", "trial over bare engine, one alone (CPU time)", one, 1.15, True)
    if "cores" in parts:
        figures = parts["cores"]["figures"]
        what = "two processes over one, once started"
        add("cores", what, figures["faster"]["two started"], 1.8, False)
        what = f"two processes over one, start included, {figures['trials']} trials"
        add("cores", what, figures["faster"]["two workers"], 1.8, False)
    if "whole" in parts:
        figures = parts["whole"]["figures"]
        add("whole", "default `tunnel`, two workers [s]", figures["seconds"]["2"], 90.0, True)
        add("whole", "two workers over one in it, start included", figures["faster"], 1.8, False)
    if "dask" in parts:
        figures = parts["dask"]["figures"]
        what = f"Dask over local processes, trials of {figures['trial_s']:g} s, once started"
        add("dask", what, figures["steady_over_local"], 1.1, True)
    if "start" in parts:
        figures = parts["start"]["figures"]
        add("start", "`import antennate` [s]", figures["import"], 0.3, True)
        name = [*figures["seconds"]][-1]
        add("start", f"{name}, from the command [s]", figures["seconds"][name], 2.0, True)
    return "## Aims and what is measured\n\nThe aims are the project's own.\n\n" + table(
        ("what", "aim", "measured", ""), rows
    )


def trial(figures: Figures) -> str:
    rows = [
        (
            n,
            told(one["over_bare_engine"]),
            told(one["own_us_per_tick"]),
            told(one["realtime_factor"]),
        )
        for n, one in figures["at_once"].items()
    ]
    columns = ("trials at once", "over bare engine", "own time a tick [µs]", "realtime factor")
    man, tunnel, most = figures["humanoid"], figures["tunnel"], [*figures["at_once"]][-1]
    return f"""\
## A trial beside its physics

CPU time of whole trials of the closed loop (sensing, control, recording) over that of the bare
engine, which replays their commands on the same models, one trial after the other, and must end on
the same bits. 1 would mean that control costs no time. {figures["trials"]} trials,
{figures["simulated_s"]:g} simulated seconds.

{table(columns, rows)}
The program steps up to {most} trials of a process in lockstep; of the default 30 a controller, 15
on each of two cores. They share each NumPy call, but their worlds push one another out of the
cache, and that counts against us: the bare engine alone takes {told(figures["bare_at_once"])} times
as long if it steps {most} in turn. An own time below 0 is one that is too short to be seen here.

A physics step of the tunnel takes {told(figures["step_us"])} µs, one of a humanoid that falls on a
floor {told(figures["humanoid_step_us"])} µs: **{told(figures["step_over_humanoid"])} times** as
long. The tunnel has {tunnel["dof"]} degrees of freedom and {tunnel["geoms"]} shapes and steps 2 ms,
the humanoid {man["dof"]}, {man["geoms"]} and 5 ms. The engine's package brings no humanoid; this
one is ours, with as many joints and motors as that of the engine's samples.
"""


def tick(figures: Figures) -> str:
    rows = [
        (
            n,
            told(one["p50"]),
            told(one["p99"]),
            short(one["p50"]["median"] / int(n)),
            short(one["p99"]["median"] / int(n)),
        )
        for n, one in figures["robots"].items()
    ]
    columns = ("robots", "median [µs]", "99 % below [µs]", "median a robot", "99 % below, a robot")
    return f"""\
## A control tick

Time on the clock of one step of the controller `closed`, from the readings of both antennae to all
joint targets, with the readings of {figures["ticks"]} ticks of real trials. The robot has
{figures["period_us"] / 1e3:g} ms for a tick, in which it also talks to its bus.

{table(columns, rows)}"""


KINDS = {
    "hinges": "hinges an antenna; the robot walks on a flat floor",
    "links": "links of the robot, with their legs; the same walk",
    "cylinders": "loose cylinders in the tunnel, most of them at rest",
    "robots": "trials of the tunnel in lockstep, a robot",
}


def growth(figures: Figures) -> str:
    rows = [
        (
            KINDS[kind],
            *(
                "; ".join(f"{n}: {told(one[name])}" for n, one in figures[kind].items())
                for name in ("ratio", "ms_per_s")
            ),
        )
        for kind in KINDS
    ]
    columns = ("what grows", "its number: cost", "its number: CPU time a simulated second [ms]")
    note = (
        "The cost is the median of ratios within a repetition, the CPU time a median over all. "
        "Where the machine\nchanged between repetitions the two need not agree.\n\n"
    )
    return "## How the cost grows\n\n" + note + table(columns, rows)


WAYS = {
    "one": "one process",
    "two workers": "two processes, their start included: `--workers 2`",
    "two started": "two processes that run already",
    "threads, rows": "one process, the rows of one batch stepped on two threads",
    "threads, batches": "one process, two threads with a batch each",
}


def cores(figures: Figures) -> str:
    faster = {"one": 1} | {name: told(found) for name, found in figures["faster"].items()}
    rows = [(way, told(figures["seconds"][n]), faster[n]) for n, way in WAYS.items()]
    seconds = figures["seconds"]
    start = seconds["two workers"]["median"] - seconds["two started"]["median"]
    saved = f"{start:.2g} s a command here" if start > 0 else "too short to be seen here"
    steps = [
        (way, told(found["faster"]), "yes" if found["same"] else "**no**")
        for way, found in figures["stepping"].items()
    ]
    return f"""\
## Two cores: processes or threads

{figures["trials"]} trials of `closed`, ended after {figures["time_limit_s"]:g} s, on the clock. All
ways give the same rows, number by number. Two processes with a few trials each are
{told(figures["machine"])} times as fast at once as in turn: that is what this machine gives.

{table(("way", "time [s]", "faster than one process"), rows)}
Stepping alone: twelve tunnels, filled up to one number of cylinders, tick by tick on two threads.

{table(("way", "faster than in turn", "same bits"), steps)}
**Processes stay the way in which the program uses its cores.** A process that crashes, hangs or
runs out of memory loses its own trials alone, and a controller of yours need not be safe for
threads. What threads could save is the start of the processes, {saved}. Within
a process, each control tick ends in Python, which one thread at a time runs. The engine's own
batch does not take the tunnels as they are drawn, with different numbers of cylinders
(`{figures["refused"]}`).
"""


def whole(figures: Figures) -> str:
    one, two = (figures["seconds"][workers]["median"] for workers in "12")
    return f"""\
## The main job

The default `antennate tunnel` before `timed` was added to it, 90 trials of which some take the
full 100 s, without figures, from the command to its end: {one:.0f} s with `--workers 1`,
{two:.0f} s with two, once each.
"""


def dask(figures: Figures) -> str:
    rows = [
        (name, told(figures["start_s"][name]), told(figures["steady_s"][name]))
        for name in ("local", "dask")
    ]
    return f"""\
## Dask beside local processes

{figures["trials"]} trials that compute for {figures["trial_s"]:g} s each, on two workers.

{table(("engine", "start [s]", "a trial on each worker, once started [s]"), rows)}
Start included, the whole takes {told(figures["whole_over_local"])} times as long with Dask.
"""


def start(figures: Figures) -> str:
    rows = [(f"`{n}`" if "antennate" in n else n, told(s)) for n, s in figures["seconds"].items()]
    return f"""\
## Start

Time on the clock from the command; *first tick* is the first control tick of the first trial of
`antennate tunnel`, with everything read, drawn and compiled before it.

{table(("what", "time [s]"), rows)}
`import antennate` alone takes {told(figures["import"])} s.
"""


def peers(figures: Figures) -> str:
    rows = list[tuple[object, ...]]()
    compared = tomllib.loads(RESULT.with_suffix(".toml").read_text(encoding="utf-8"))
    for one in compared["peers"]:
        title, job, same, differs = (one[key] for key in ("name", "does", "same", "differs"))
        about = figures["peers"].get(one["peer"], {"failed": "not asked"})
        if "failed" in about:
            rows.append((title, job, f"not measured: {about['failed']}", "-", same, differs))
            continue
        said = about["jobs"][one["job"]]
        factor = short(1 / said["cpu_per_s"]["median"])
        rows.append(
            (
                f"{title} {said['version']}",
                f"{job}; {said['size']}",
                factor,
                told(said["ours_faster"]),
                same,
                differs,
            )
        )
    mine = [
        (OURS[job], short(1 / found["cpu_per_s"]["median"]))
        for job, found in figures["ours"].items()
    ]
    columns = ("peer", "job", "realtime factor", "ours is faster", "the same", "what differs")
    return f"""\
## Beside other simulators

One core each, CPU time, ours and theirs in turn; every peer in an environment of its own
(`benchmarks/peers`). No two of them simulate the same thing: read the last column first.

{table(("ours", "realtime factor"), mine)}
{table(columns, rows)}"""


OURS = {
    "walk": "the robot walks on a flat floor, 2 ms, sensing and gait included",
    "antenna": "one antenna of six hinges swings into a sphere, 1 ms",
}


def gpu(figures: Figures) -> str:
    rows = [
        (
            one["batch"],
            short(one["robot_seconds_per_second"]),
            short(one["bare_warp"]),
            short(one["over_bare_warp"]),
        )
        for one in figures["batches"]
    ]
    columns = ("robots", "robot-seconds a second", "bare Warp", "over bare Warp")
    return f"""\
{GPU_HEAD}
{figures["device"]}, mujoco-warp {figures["mujoco_warp"]}, warp {figures["warp"]}.

{table(columns, rows)}"""


GPU_HEAD = """\
## A batch on a GPU

`antennate tunnel --engine warp` steps thousands of tunnels at once ([how](gpu.md)). Published for
FlyGym 2 on a GPU: about 60 times real time.
"""


def engines(figures: Figures) -> str:
    rows = [
        (engine, at_once, told(one["over_bare_engine"]), told(one["realtime_factor"]))
        for engine, cases in figures["engines"].items()
        for at_once, one in cases.items()
    ]
    steps = figures["step_us"]
    locked, other = steps
    columns = ("engine", "trials at once", "over bare engine", "realtime factor")
    return f"""\
{ENGINES_HEAD}
{table(columns, rows)}
A physics step takes {told(steps[locked])} µs on {locked} and {told(steps[other])} µs on {other}:
**{told(figures["step_over_other"])} times** as long. The locked engine is {locked}, since other
packages need it beside ours; [how to take the other
one](install.md#beside-other-packages-of-the-engine).
"""


def agreement(figures: Figures) -> str:
    """How far engines and instructions disagree on the same trials."""
    names = list(next(iter(figures["ways"].values())))
    ways = [
        (way, *(f"{of[n]['successes']}, {of[n]['time_s']} s" for n in names))
        for way, of in figures["ways"].items()
    ]
    pairs = [
        (
            one["controller"],
            *one["ways"],
            one["other_end"],
            f"{one['difference_s']:+} ({one['difference_95'][0]} to {one['difference_95'][1]})",
        )
        for one in figures["pairs"]
    ]
    most = max(one["other_end"] for one in figures["pairs"])
    widest = max(figures["pairs"], key=lambda one: abs(one["difference_s"]))
    return f"""\
{AGREEMENT_HEAD}
{figures["trials"]} trials of the default `tunnel`, seed {figures["seed"]}: successes and
restricted mean time of the `closed` of then, now `closed-1`. *Old instructions*: NumPy without
{figures["old_instructions"]}.

{table(("way", *names), ways)}
{table(("controller", "first", "second", "other end", "difference of time, 95 % [s]"), pairs)}
No two ways give the same numbers: the last bits of a sum differ, and each collision amplifies that.
The largest difference of restricted mean times is {abs(widest["difference_s"])} s, the most trials
that end in another way are {most} of {figures["trials"]}.
**A difference between controllers that is not larger than this is a tie.**
"""


ENGINES_HEAD = "## Two engines\n"
AGREEMENT_HEAD = """\
## How far engines and processors disagree
"""
SECTIONS = {
    "trial": (trial, "## A trial beside its physics\n"),
    "tick": (tick, "## A control tick\n"),
    "engines": (engines, ENGINES_HEAD),
    "agreement": (agreement, AGREEMENT_HEAD),
    "growth": (growth, "## How the cost grows\n"),
    "cores": (cores, "## Two cores: processes or threads\n"),
    "whole": (whole, "## The main job\n"),
    "dask": (dask, "## Dask beside local processes\n"),
    "start": (start, "## Start\n"),
    "peers": (peers, "## Beside other simulators\n"),
    "gpu": (gpu, GPU_HEAD),
}


def page() -> str:
    """The content of the page."""
    parts = json.loads(RESULT.read_text(encoding="utf-8")) if RESULT.exists() else {}
    sections = [HEAD, aims(parts)]
    for name, (make, head) in SECTIONS.items():
        if name in parts:
            sections.append(make(parts[name]["figures"]))
        else:
            sections.append(f"{head}\nNot measured yet: `{COMMAND} --parts {name}`.\n")
    return "\n".join(part.rstrip("\n") + "\n" for part in [*sections, machines(parts)])


def main() -> None:
    """Write the page, or check it."""
    finish(__file__, page(), source="`docs/performance.json`")


if __name__ == "__main__":
    main()
