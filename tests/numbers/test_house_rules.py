"""The limits of CONTRIBUTING.md, on every module of the package."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import towtank

PACKAGE = Path(towtank.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))
ROOT = PACKAGE.parents[1]

MODULE_LINES, FUNCTION_LINES = 400, 50
SOURCE_LINE = re.compile(r"^\s*(?:Source|Sources)\s{2,}(?P<text>.*)$")
KEY = re.compile(r"\b[a-z][a-z]+\d{4}[a-z]?\b|\bittc\d+\b")


def _name(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


def _functions(tree: ast.AST) -> list[ast.FunctionDef]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


def _code_lines(function: ast.FunctionDef) -> int:
    """Lines from ``def`` to the end, without the docstring."""
    total = (function.end_lineno or function.lineno) - function.lineno + 1
    first = function.body[0]
    if ast.get_docstring(function, clean=False) is not None:
        total -= (first.end_lineno or first.lineno) - first.lineno + 1
    return total


def _docstrings(tree: ast.Module) -> list[str]:
    """Every text of a module that stands alone: docstrings, and strings below an assignment."""
    return [
        node.value.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    ]


def _cited(text: str) -> set[str]:
    """Source keys in the ``Source`` blocks of a docstring: the line and what is indented below its text."""
    keys: set[str] = set()
    inside = False
    for line in text.splitlines():
        start = SOURCE_LINE.match(line)
        if start or (inside and re.match(r"^\s{6,}\S", line)):
            inside = True
            keys |= set(KEY.findall(start["text"] if start else line))
        else:
            inside = False
    return keys


@pytest.fixture(scope="module")
def references() -> set[str]:
    return set(re.findall(r"^@\w+\{([^,\s]+),", (PACKAGE / "references.bib").read_text("utf-8"), flags=re.M))


def test_the_package_is_found():
    assert len(MODULES) > 30


def test_no_module_is_longer_than_the_limit():
    lengths = {_name(path): len(path.read_text("utf-8").splitlines()) for path in MODULES}
    assert {name: n for name, n in lengths.items() if n > MODULE_LINES} == {}


def test_no_function_is_longer_than_the_limit():
    long = {
        f"{_name(path)}:{function.name}": _code_lines(function)
        for path in MODULES
        for function in _functions(ast.parse(path.read_text("utf-8")))
        if _code_lines(function) > FUNCTION_LINES
    }
    assert long == {}


def test_every_cited_source_is_in_the_bibliography(references: set[str]):
    unknown = {
        (_name(path), key)
        for path in MODULES
        for text in _docstrings(ast.parse(path.read_text("utf-8")))
        for key in _cited(text) - references
    }
    assert unknown == set()


def test_citations_are_recognised(references: set[str]):
    """The search above finds what it should: a known key, an unknown one on a continued line, none elsewhere."""
    source = "    Source     roddy1990, table 4; perron\n               nobody1234 eq. 2\n"
    text = f"Words 1999.\n\n{source}    Valid      lamb1932\n"
    assert _cited(text) == {"roddy1990", "nobody1234"}
    assert {"roddy1990", "perron"} <= references


def test_keys_of_the_bibliography_are_unique():
    keys = re.findall(r"^@\w+\{([^,\s]+),", (PACKAGE / "references.bib").read_text("utf-8"), flags=re.M)
    assert len(keys) == len(set(keys))


def test_the_library_does_not_print_or_exit():
    offending = {
        (_name(path), node.lineno)
        for path in MODULES
        if "cli" not in path.relative_to(PACKAGE).parts and path.name != "__main__.py"
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in {"print", "exit", "quit", "sys.exit", "os._exit"}
    }
    assert offending == set()


def test_nothing_is_left_to_be_written():
    """No NotImplementedError, no bare ``except:``, no ``pass``-only except."""
    found = []
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Raise) and node.exc is not None and "NotImplemented" in ast.unparse(node.exc):
                found.append((_name(path), node.lineno))
            if isinstance(node, ast.ExceptHandler) and (node.type is None or isinstance(node.body[0], ast.Pass)):
                found.append((_name(path), node.lineno))
    assert found == []


def test_every_public_name_can_be_loaded():
    for name in towtank.__all__:
        assert getattr(towtank, name) is not None


def test_contributing_is_short_and_decisions_are_numbered():
    assert len((ROOT / "CONTRIBUTING.md").read_text("utf-8").splitlines()) < 80
    notes = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    numbers = [int(path.name[:4]) for path in notes]
    assert numbers == list(range(1, len(notes) + 1))
    assert {path.name: n for path in notes if (n := len(path.read_text("utf-8").splitlines())) > 40} == {}
