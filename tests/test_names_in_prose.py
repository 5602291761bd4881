"""Names in prose: a module, attribute or file that a page or a docstring names is there."""

from __future__ import annotations

import ast
import builtins
import functools
import importlib
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

import mujoco
import pytest
from pages import made_pages

from antennate.errors import MissingPackageError

ROOT = Path(__file__).parents[1]
PACKAGES = [*ROOT.glob("packages/*/src/*")]
OURS = [package.name for package in PACKAGES]
PAGES = [
    *(p for p in sorted((ROOT / "docs").rglob("*.md")) if p.name != "changelog.md"),
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *ROOT.glob("packages/*/README.md"),
]
"""Pages that tell how things are; the changelog tells how they were."""
FOLDERS = (
    "packages",
    "docs",
    "tests",
    "firmware",
    "examples",
    "entries",
    "studies",
    "benchmarks",
)
BASES = (ROOT, *PACKAGES, ROOT / "docs", ROOT / "docs" / "science")
"""Where the path of a file may begin."""
FOREIGN = ("cloudpickle", "concurrent", "gc", "gymnasium", "numpy", "scipy", "sys", "websockets")
"""Packages of others that are named with their attributes."""
SHORT = {"gym": "gymnasium", "np": "numpy"}
ELSEWHERE = {
    "antennate.controllers": "group of entry points",
    "antennate.scenes": "group of entry points",
    "frame.FLAG_": "begin of names",
    "share.forward": "example of a key",
    "time.ticks_us": "MicroPython",
    "touches.force": "argument of compiled code, without a type",
    "wilcox.test": "R",
    "antenna_datagram.py": "a file on the board",
    "antenna_frame.py": "a file on the board",
    **dict.fromkeys(("walk.parquet", "gap.parquet", "push.parquet"), "made of a kind and its end"),
    "BrokenProcessPool": "concurrent.futures",
    "DynamixelMotorsBus": "LeRobot",
    "HistGradientBoostingClassifier": "scikit-learn",
    "MUJOCO_LOG.TXT": "MuJoCo",
    "PPO": "Stable-Baselines3",
    "HttpOnly": "cookies",
    "TimeLimit": "Gymnasium",
}
"""Names that nothing here defines, and whose they are."""
CODE = re.compile(r"^( *)```.*?^ *```$", re.MULTILINE | re.DOTALL)
SPAN = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
DOTTED = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)+")
FILE = re.compile(
    r"(?:[\w*.-]+/)*[\w*.-]+\.(?:csv|html|json|jsonl|lock|mcap|md|npz|py|toml|txt|xml)"
)
CLASS = re.compile(r"[A-Z]\w*[a-z][A-Z]\w*")


def trees() -> Iterator[tuple[Path, ast.Module]]:
    for path in [p for package in PACKAGES for p in package.rglob("*.py")]:
        yield path, ast.parse(path.read_text(encoding="utf-8"))


def defined(node: ast.AST) -> list[str]:
    """Names that a statement defines."""
    match node:
        case ast.FunctionDef() | ast.ClassDef():
            return [node.name]
        case ast.Import() | ast.ImportFrom():
            return [alias.asname or alias.name for alias in node.names]
        case ast.Assign() | ast.AnnAssign():
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = [name for target in targets for name in ast.walk(target)]
            return [name.id for name in names if isinstance(name, ast.Name)]
        case _:
            return []


def kinds(*notes: ast.AST | None) -> set[str]:
    """Names within annotations or base classes."""
    nodes = [node for note in notes if note is not None for node in ast.walk(note)]
    return {n.id for n in nodes if isinstance(n, ast.Name)} | {
        n.attr for n in nodes if isinstance(n, ast.Attribute)
    }


class Index:
    """What is under each name of the package: in modules, in classes, and in what has a type."""

    def __init__(self) -> None:
        self.own: dict[str, set[str]] = defaultdict(set)
        self.types: dict[str, set[str]] = defaultdict(set)
        self.words: set[str] = set()
        for path, tree in trees():
            parts = (
                path.relative_to(next(p for p in path.parents if p.name == "src"))
                .with_suffix("")
                .parts
            )
            *above, name = parts[:-1] if parts[-1] == "__init__" else parts
            self.own[above[-1] if above else ""].add(name)
            self.own[name].update(*map(defined, tree.body))
            for node in ast.walk(tree):
                self._add(node)

    def _add(self, node: ast.AST) -> None:
        match node:
            case ast.ClassDef():
                self.own[node.name].update(*map(defined, node.body))
                stored = (n for n in ast.walk(node) if isinstance(n, ast.Attribute))
                self.own[node.name].update(n.attr for n in stored if isinstance(n.ctx, ast.Store))
                self.types[node.name] |= kinds(*node.bases)
            case ast.AnnAssign(target=ast.Name(id=name) | ast.Attribute(attr=name)):
                self.types[name] |= kinds(node.annotation)
            case ast.arg():
                self.types[node.arg] |= kinds(node.annotation)
            case ast.FunctionDef():
                self.types[node.name] |= kinds(node.returns)
            case ast.Constant(value=str(text)) if " " not in text:
                self.words.add(text)
            case _:
                pass

    def under(self, name: str, seen: frozenset[str] = frozenset()) -> set[str]:
        """Members of what has this name, its types and their bases."""
        found = set(self.own.get(name, ()))
        for kind in self.types.get(name, set()) - seen:
            found |= self.under(kind, seen | {name, kind})
        return found

    def has(self, dotted: str) -> bool:
        """Whether a dotted name is that of something."""
        first, *rest = dotted.split(".")
        first = SHORT.get(first, first)
        if first in OURS or first in FOREIGN:
            return imported([first, *rest])
        pairs = zip([first, *rest], rest, strict=False)
        return dotted in self.words or all(name in self.under(owner) for owner, name in pairs)


def imported(parts: list[str]) -> bool:
    """Whether the parts of a name lead to something, from its package on."""
    try:
        value, place = importlib.import_module(parts[0]), parts[0]
    except ModuleNotFoundError:
        if parts[0] not in FOREIGN:
            raise
        return True  # as below; where all extras are, it is looked at
    for part in parts[1:]:
        place += f".{part}"
        if not hasattr(value, part):
            try:
                importlib.import_module(place)
            except MissingPackageError:
                return True  # a part whose package is an extra that is not here
            except ImportError:
                return False
        value = getattr(value, part)
    return True


@functools.cache
def index() -> Index:
    return Index()


@functools.cache
def files() -> set[str]:
    """Names of the files that are here."""
    there = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*")]
    return {path.name for path in [*there, *ROOT.iterdir()]}


@functools.cache
def source() -> str:
    """All that the package says, docstrings too: commands write files by names in it."""
    return "\n".join(path.read_text(encoding="utf-8") for path, _ in trees())


def is_file(name: str, beside: str) -> bool:
    """Whether a file is here, or a command or the code on the same page writes it."""
    *folders, last = name.split("/")
    if folders and any((base / folders[0]).is_dir() for base in BASES):
        return any(True for base in BASES for _ in base.glob(name))
    if last.endswith(".py") or last.isupper():
        return last in files() or Path(last).stem in beside
    return last in files() or last in beside or last in source()


def missing(spans: Iterable[str], beside: str = "") -> list[str]:
    """Names among pieces of code in prose that are those of nothing.

    Args:
        spans: The pieces.
        beside: Code on the same page.
    """
    found = []
    for span in dict.fromkeys(spans):
        name = span.partition("(")[0]
        if name in ELSEWHERE or re.search(r"\b[A-Z]{4,}\b", name):  # as FILE.xml or entries/NAME
            continue
        if FILE.fullmatch(name) and not name.startswith("."):
            known = is_file(name, beside) or index().has(name)
        elif DOTTED.fullmatch(name):
            known = index().has(name) or is_file(name, beside)
        elif CLASS.fullmatch(name):
            own = index().own
            known = name in own or any(name in names for names in own.values())
            known = known or any(hasattr(module, name) for module in (builtins, mujoco))
        else:
            continue
        if not known:
            found.append(span)
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_page_names_what_is_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    code = "".join(match[0] for match in CODE.finditer(text))
    assert missing(SPAN.findall(CODE.sub("", text)), code) == []


@pytest.mark.ci
def test_a_page_that_is_made_names_what_is_there() -> None:
    for path in made_pages().values():
        test_a_page_names_what_is_there(path)


def test_docstrings_name_what_is_there() -> None:
    wrong = {}
    for path, tree in trees():
        texts = [
            n.value.value
            for n in ast.walk(tree)
            if isinstance(n, ast.Expr)
            and isinstance(n.value, ast.Constant)
            and isinstance(n.value.value, str)
        ]
        if found := missing(SPAN.findall("\n".join(texts))):
            wrong[str(path.relative_to(ROOT))] = found
    assert wrong == {}


@pytest.mark.parametrize(
    "name",
    [
        "antennate.control.contact",
        "contact.ContactState",
        "search.SearchRule",
        "Bench.no_such_method()",
        "control.no_such_group",
        "packages/antennate/src/antennate/control/search.py",
        "cli/no_such_file.py",
        "no_such_module.py",
        "no_such_result.json",
        "NoSuchClass",
    ],
)
def test_a_name_of_nothing_is_noticed(name: str) -> None:
    assert missing([name]) == [name]
