"""Tests know public names alone, so that a rename breaks none; and no imports have a circle."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import antennate
import dynamixel_bus
import geometric_locomotion

TESTS = Path(__file__).parent
PACKAGES = [*TESTS.parent.glob("packages/*/src/*")]
OURS = tuple(package.name for package in PACKAGES)
PRIVATE = re.compile(r"_[A-Za-z]\w*(?<!_)")
"""Names that end with an underscore, too, are those that notebooks ask for."""


def of_the_package() -> set[str]:
    """Private names that occur in the package, or are modules of it."""
    paths = [path for package in PACKAGES for path in package.rglob("*.py")]
    words = (re.findall(r"\b_\w+", path.read_text(encoding="utf-8")) for path in paths)
    names = {word for found in words for word in found} | {path.stem for path in paths}
    return {name for name in names if PRIVATE.fullmatch(name)}


def known_names(tree: ast.Module) -> tuple[set[str], set[str]]:
    """Names of other packages' modules, and of what comes from the package."""
    modules, ours = set[str](), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = {alias.asname or alias.name for alias in node.names}
            from_us = any(name in ast.unparse(node) for name in OURS)
            (ours if from_us else modules).update(names)
    return modules, ours


def own_attributes(tree: ast.Module, package: set[str], ours: set[str]) -> Iterator[ast.AST]:
    """Those of `self` in classes; a class made from one of the package's may share no name."""
    for kind in ast.walk(tree):
        if isinstance(kind, ast.ClassDef):
            shared = package if ours & {ast.unparse(base) for base in kind.bases} else ()
            for node in ast.walk(kind):
                of_self = isinstance(node, ast.Attribute) and ast.unparse(node.value) == "self"
                if of_self and node.attr not in shared:
                    yield node


def words_of(node: ast.AST, package: set[str]) -> list[str]:
    """Names in an import, and in a text that may name an attribute to be set."""
    if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(OURS):
        return [*str(node.module).split("."), *(alias.name for alias in node.names)]
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        words = [node.value, *re.findall(r"\w\.(_[A-Za-z]\w*)", node.value)]
        return [word for word in words if word in package]
    return []


def used(tree: ast.Module, package: set[str]) -> Iterator[ast.AST]:
    """Where private names are used that are not the test's own."""
    modules, ours = known_names(tree)
    own = set(own_attributes(tree, package, ours))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and PRIVATE.fullmatch(node.attr):
            if node not in own and ast.unparse(node.value) not in modules:
                yield node
        elif any(PRIVATE.fullmatch(word) for word in words_of(node, package)):
            yield node


@pytest.mark.parametrize(
    "text",
    [
        "session._hidden",
        "from antennate.control.loop import _hidden",
        "from antennate._hidden import loop",
        "setattr(session, '_hidden', True)",
        "put('antennate.hardware.session.Session._hidden')",
        "def forget(self):\n    self._hidden = False",
        "from antennate.x import A\nclass B(A):\n    def forget(self):\n        self._hidden = 1",
    ],
)
def test_a_private_name_is_found(text: str) -> None:
    assert list(used(ast.parse(text), {"_hidden"}))


@pytest.mark.parametrize(
    "text",
    [
        "import os\nos._hidden(0)",
        "class Mine:\n    def forget(self):\n        self._hidden = False",
        "feed.__enter__()",
        "site = 'left_hinge' + '_hinge5'",
    ],
)
def test_a_name_of_its_own_is_none(text: str) -> None:
    assert not list(used(ast.parse(text), {"_hidden"}))


@pytest.mark.ci
def test_tests_use_no_private_name_of_the_package() -> None:
    package = of_the_package()
    assert [
        f"{path.name}:{node.lineno}: {ast.unparse(node)}"
        for path in [*TESTS.glob("*.py"), *TESTS.parent.glob("packages/*/tests/*.py")]
        for node in used(ast.parse(path.read_text(encoding="utf-8")), package)
    ] == []


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
