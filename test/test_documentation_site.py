"""The documentation site: every page has a place, docstrings arrive as they are meant."""

import re

import documentation_site
import mode_pages
import pytest

from quad_commander.mode_table import FAULTS
from quad_core.enumerations import Mode

pytestmark = pytest.mark.unit


def test_every_page_and_package_has_a_place():
    assert documentation_site.missing() == []


def test_modules_of_the_api_need_no_ros():
    for package in documentation_site.PURE:
        for name in documentation_site.modules(package):
            path = documentation_site.ROOT / "src" / package / (name.replace(".", "/") + ".py")
            text = path.read_text(encoding="utf-8")
            assert "import rclpy" not in text, name
            assert "from quad_msgs" not in text, name


def test_a_docstring_is_plain_text_with_equations():
    lines = ["The law, |s| * tanh_(x) of ``a * b``:", "    u = -K * s", "", "    s = e' + c e", "where e is small.", ""]
    documentation_site.plain_to_rst(lines)
    assert lines[0] == r"The law, \|s\| \* tanh\_(x) of ``a * b``:"
    assert lines[1:5] == ["", "::", "", "    u = -K * s"]
    assert lines[6:9] == ["    s = e' + c e", "", "where e is small."]


def test_equations_that_are_announced_are_announced_once():
    lines = ["It reads::", "", "    a = b", "", "that is all."]
    documentation_site.plain_to_rst(lines)
    assert lines.count("::") == 0


def test_every_decision_has_a_date_and_a_row_in_the_index():
    folder = documentation_site.ROOT / "docs" / "decisions"
    index = (folder / "README.md").read_text(encoding="utf-8")
    for path in sorted(folder.glob("0*.md")):
        number = int(path.name[:4])
        row = next((line for line in index.splitlines() if line.startswith(f"| [{number}]({path.name}) |")), "")
        assert row, f"{path.name}: no row in docs/decisions/README.md"
        assert row.count("|") == 4
        lines = path.read_text(encoding="utf-8").splitlines()
        assert lines[0].startswith(f"# {number}. ")
        assert re.search(r"Date: \d{4}-\d{2}-\d{2}", lines[2]), f"{path.name}: no date"
    assert index.count("\n| [") == len(list(folder.glob("0*.md")))


def test_limits_are_shown_as_people_read_them():
    table = mode_pages.fault_table()
    assert "position error above 1.5 m" in table
    assert "battery below 20%" in table
    assert "mission reference older than 0.2 s" in table
    assert "{" not in mode_pages.page()


def test_each_fault_has_its_line_and_each_cell_is_a_mode():
    lines = mode_pages.fault_table().splitlines()
    assert len(lines) == 2 + len(FAULTS)
    cells = {cell.strip() for line in lines[2:] for cell in line.split("|")[2:-1]}
    assert cells <= {"", *(mode.name for mode in Mode)}
