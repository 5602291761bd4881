"""No circle of imports, those for the type checker and inside functions included."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import antennate
import dynamixel_bus
import geometric_locomotion

ROOTS = [
    Path(str(room.__file__)).parent for room in (antennate, dynamixel_bus, geometric_locomotion)
]
SOURCES = {
    ".".join((root.name, *path.relative_to(root).with_suffix("").parts)).removesuffix(
        ".__init__"
    ): path
    for root in ROOTS
    for path in root.rglob("*.py")
}


def imported(path: Path) -> set[str]:
    """Modules of our packages that a file imports anywhere."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports are not followed here"
            names = (f"{node.module}.{alias.name}" for alias in node.names)
            found |= {name if name in SOURCES else str(node.module) for name in names}
    return found & SOURCES.keys()


def test_imports_have_no_circle() -> None:
    graph = {name: imported(path) - {name} for name, path in SOURCES.items()}
    assert any(graph.values())
    tuple(TopologicalSorter(graph).static_order())  # a circle is an error that names it
