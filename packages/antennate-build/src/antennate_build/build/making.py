"""What a run makes: parts, their checks, files and drawings."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from matplotlib.figure import Figure

from antennate.robots.antenna import N_MM_PER_DEG
from antennate_build import (
    antenna_checks,
    antenna_sheets,
    billing,
    checks,
    fasteners,
    kernel,
    link_sheets,
    robot_assembly,
    robot_files,
    steps,
    weights,
)
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.build.comparing import (
    antenna_grams,
    antenna_masses,
    apart,
    mass_check,
    robot_masses,
)
from antennate_build.build.config import BuildConfig
from antennate_build.build.naming import antenna_of, brackets, links_of, sheet_names
from antennate_build.build.result import (
    BuildResult,
    Checked,
    Compared,
    PartMade,
    SpringMade,
)
from antennate_build.checks import Check, Up
from antennate_build.kernel import Solid
from antennate_build.robot_assembly import RobotSolids
from antennate_build.winding import set_of

OnStep = Callable[[int, int], None]


@dataclass
class Product:
    """What is made, as it grows.

    Attributes:
        parts: Printed parts by name.
        counts: How many of each.
        ups: Which direction of each points up while it is printed.
        placed: Solids of the assembly, each with its item of the bill.
        checks: What was checked.
        masses: What was compared.
        steps: Steps of the assembly, under their titles.
        items: The bill.
        screws: Its screws and bolts.
        files: Files with which the robot is simulated as it is built.
        figures: Drawings by name.
        apart: Where it is not what is simulated.
    """

    parts: dict[str, Solid] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    ups: dict[str, Up] = field(default_factory=dict)
    placed: list[tuple[str, Solid]] = field(default_factory=list)
    checks: list[Check] = field(default_factory=list)
    masses: dict[str, Compared] = field(default_factory=dict)
    steps: dict[str, tuple[str, ...]] = field(default_factory=dict)
    items: list[billing.Item] = field(default_factory=list)
    screws: list[fasteners.Fastener] = field(default_factory=list)
    files: dict[str, str | bytes] = field(default_factory=dict)
    figures: dict[str, Figure] = field(default_factory=dict)
    apart: list[str] = field(default_factory=list)


def made(
    config: BuildConfig, on_step: OnStep
) -> tuple[BuildResult, Mapping[str, str | bytes], Mapping[str, Figure]]:
    """Result, files and figures of a configuration."""
    product, springs = Product(), list[SpringMade]()
    found = antenna_of(config)
    done = 0

    def tick() -> None:
        nonlocal done
        done += 1
        on_step(done, max(done + 1, 40))

    antenna = None
    if found is not None:
        layout, mount = found
        antenna = AntennaSolids(layout, mount, brackets(config))
        _add_antenna(product, config, antenna, tick)
        springs = _springs(antenna)
    if (links := links_of(config)) is not None:
        layout, horn = links
        robot = RobotSolids(layout, None if found is None else found[1], horn)
        _add_links(product, config, robot, antenna, tick)
    prints, files = _printed(product, config, tick)
    files |= product.files
    product.checks.append(fasteners.check(product.screws, product.parts))
    result = BuildResult(
        parts=prints,
        springs=springs,
        checks=[
            Checked(name=c.name, found=c.found, good=c.good, warn=c.warn) for c in product.checks
        ],
        masses=product.masses,
        apart=[*apart(config), *product.apart],
    )
    files["step/assembly.step"] = kernel.step(product.placed)
    files["assembly.md"] = "\n".join(
        steps.as_markdown(title, said) for title, said in product.steps.items()
    )
    files["bom.csv"] = billing.as_csv(product.items)
    for name in sheet_names(config):
        files[f"drawings/{name}.pdf"] = _pdf(product.figures[name])
    on_step(1, 1)
    return result, files, product.figures


def _add_antenna(
    product: Product, config: BuildConfig, antenna: AntennaSolids, tick: Callable[[], None]
) -> None:
    layout, mount = antenna.layout, antenna.mount
    pair = len(antenna.sides)
    for name, solid in antenna.printed.items():
        product.parts[name] = solid
        product.counts[name] = antenna.counts[name] * (1 if name.startswith("bracket") else pair)
        product.ups[name] = antenna_checks.up_of(name)
        tick()
    if config.what == "antenna":
        product.placed = [(part.part, part.solid) for part in antenna.placed()]
    product.checks.append(antenna_checks.assembly_check(antenna, tick))
    product.checks += antenna_checks.spring_checks(antenna)
    product.masses |= antenna_masses(antenna)
    product.checks.append(mass_check(product.masses))
    said = steps.antenna_steps(layout, mount)
    product.steps["Antenna"] = said
    product.figures |= {
        "antenna": antenna_sheets.antenna_sheet(antenna),
        "assembly": antenna_sheets.exploded_sheet(antenna, said),
        "bracket": antenna_sheets.bracket_sheet(antenna),
        "antenna_bent": antenna_sheets.shaded(antenna, _bent(antenna.hinges, layout.hinge.stop)),
    }
    grams = {name: layout.print.density * kernel.volume(s) for name, s in antenna.printed.items()}
    counts = {name: product.counts[name] for name in antenna.printed}
    product.items += billing.printed_items(counts, grams, layout.print.material)
    product.items += billing.spring_items(layout, config.springs, pair)
    product.items += billing.sensor_items(layout) if pair == 1 else []
    screws = fasteners.of_antenna(antenna, pair)
    product.items += billing.fastener_items(screws)
    product.screws += screws


def _add_links(
    product: Product,
    config: BuildConfig,
    robot: RobotSolids,
    antenna: AntennaSolids | None,
    tick: Callable[[], None],
) -> None:
    whole, masses, limit, stops = robot.whole(), dict[str, float](), None, tuple[float, ...]()
    if antenna is not None:
        whole += robot_assembly.at_head(robot, antenna)
        check, told, limit = robot_assembly.base_check(robot, antenna)
        product.checks.append(check)
        product.apart += [told] if told else []
        stops = tuple(spring.stop for spring in antenna.layout.springs)
        masses = antenna_grams(antenna, product.masses)
    for name, solid in robot.printed.items():
        product.parts[name] = solid
        product.counts[name] = robot.counts[name]
        product.ups[name] = robot_assembly.up_of(name)
        tick()
    product.placed = [(billing.item_of(config.robot, name), solid) for name, solid in whole]
    product.checks += robot_assembly.robot_checks(robot, tick)
    grams = {name: config.print.density * kernel.volume(s) for name, s in robot.printed.items()}
    screws = fasteners.of_links(robot)
    product.items += billing.fastener_items(screws)
    product.screws += screws
    values = weights.robot_values(robot, product.screws, masses, limit, stops)
    product.files |= robot_files.files(robot, antenna, values)
    product.masses = robot_masses(config.robot, values) | product.masses
    product.steps["Links"] = steps.link_steps(robot.layout, robot.base)
    product.figures |= {
        "link": link_sheets.link_sheet(robot),
        "robot": link_sheets.shaded(whole),
    }
    product.items += billing.printed_items(robot.counts, grams, config.print.material)
    product.items += billing.bought_items(config.robot)


def _bent(hinges: int, stop: float) -> tuple[float, ...]:
    """Angles that show that hinges bend."""
    most = min(0.45, stop)
    return tuple(most * math.sin(2.2 * math.pi * (n + 1) / (hinges + 1)) for n in range(hinges))


def _springs(antenna: AntennaSolids) -> list[SpringMade]:
    return [
        SpringMade(
            count=count,
            turns=spring.turns,
            wire_mm=spring.wire,
            coil_mm=spring.coil,
            inner_mm=spring.inner,
            leg_mm=spring.leg,
            stiffness_n_mm_per_deg=spring.stiffness / N_MM_PER_DEG,
            wanted_n_mm_per_deg=spring.wanted / N_MM_PER_DEG,
            error=spring.error,
            loose_error=spring.loose_stiffness / spring.wanted - 1.0,
            yields_deg=math.degrees(spring.yields),
        )
        for spring, count in set_of(antenna.layout.springs).items()
    ]


def _printed(
    product: Product, config: BuildConfig, tick: Callable[[], None]
) -> tuple[dict[str, PartMade], dict[str, str | bytes]]:
    """Each part as it is printed, and its files; the check that all meshes are closed."""
    found: dict[str, PartMade] = {}
    files: dict[str, str | bytes] = {}
    prints: dict[str, checks.Print] = {}
    for name, solid in product.parts.items():
        part = checks.printed(solid, product.ups[name], config.print.wall_mm)
        prints[name] = part
        low, high = kernel.bounds(part.solid)
        found[name] = PartMade(
            count=product.counts[name],
            mass_g=config.print.density * kernel.volume(solid),
            size_mm=[b - a for a, b in zip(low, high, strict=True)],
            wall_mm=part.wall,
            thin_at=part.thin,
            closed=part.closed,
            supports=[
                f"support at {each.height:.1f} mm, {each.area:.0f} mm²" for each in part.overhangs
            ],
        )
        files[f"stl/{name}.stl"] = checks.stl(part.mesh)
        files[f"step/{name}.step"] = kernel.step([(name, solid)])
        tick()
    holes = [name for name, part in found.items() if not part.closed]
    told = (
        f"open or in pieces: {', '.join(holes)}"
        if holes
        else f"{len(found)} meshes, each one closed body"
    )
    product.checks.append(Check("meshes", told, not holes))
    product.checks.append(checks.walls_check(prints, config.print.wall_mm))
    product.checks.append(checks.layers_check(prints))
    return found, files


def _pdf(figure: Figure) -> bytes:
    file = io.BytesIO()
    figure.savefig(file, format="pdf", metadata={"CreationDate": None})
    return file.getvalue()
