"""Read docs/reference/paper_map.md: which function and which test stand beside each equation, table and figure."""

import ast
import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "paper_map.md"
LINK = re.compile(r"\[`([\w.]+)`\]\(([^)#]+)\)")
FIGURE = re.compile(r"^Figure (\d+)$")


class MapError(ValueError):
    """The page cannot be read; the text says which row and why."""


class Link(NamedTuple):
    """One link of the page: what it is called there, and the file that it leads to."""

    text: str
    file: Path

    @property
    def dotted(self) -> str:
        """The importable name of a linked function: package, module, function."""
        folders = [folder.name for folder in self.file.parents if (folder / "__init__.py").is_file()]
        return ".".join([*reversed(folders), self.text])

    @property
    def node_id(self) -> str:
        """The name under which pytest knows a linked test."""
        return f"{self.file.relative_to(ROOT)}::{self.text}"


class Row(NamedTuple):
    """One row of the page."""

    name: str
    code: list[Link]
    tests: list[Link]
    finding: str

    @property
    def equation(self) -> int:
        """Number of the equation, 0 if the row is about a table or a figure."""
        return int(self.name) if self.name.isdigit() else 0


def rows(page: Path = PAGE) -> list[Row]:
    """Return the rows about equations, tables and figures, in order; raises MapError if one lacks a column."""
    found = []
    for line in page.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not line.startswith("|") or not (cells[0].isdigit() or cells[0].startswith(("Table ", "Figure "))):
            continue
        if len(cells) < 3:
            raise MapError(f"{page.name}: {cells[0]}: found {len(cells)} columns, expected at least 3")
        links = [Link(text, (page.parent / place).resolve()) for text, place in LINK.findall(line)]
        tests = [link for link in links if link.file.name.startswith("test_")]
        found.append(Row(cells[0], [link for link in links if link not in tests], tests, cells[-1]))
    return found


def functions_in(file: Path) -> set[str]:
    """Return the names of the functions at the top of ``file``."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
