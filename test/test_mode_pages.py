"""The page for people is made from the table, and says what the table says."""

import ast
import inspect

import mode_pages

from quad_commander import commander_core, modes
from quad_commander.mode_table import FAULTS, Mode


def test_limits_are_shown_as_people_read_them():
    table = mode_pages.fault_table()
    assert "position error above 1.5 m" in table
    assert "battery below 20 %" in table
    assert "mission reference older than 0.2 s" in table
    assert "{" not in mode_pages.page()


def test_each_fault_has_its_line_and_each_cell_is_a_mode():
    lines = mode_pages.fault_table().splitlines()
    assert len(lines) == 2 + len(FAULTS)
    cells = {cell.strip() for line in lines[2:] for cell in line.split("|")[2:-1]}
    assert cells <= {"", *(mode.name for mode in Mode)}


def test_the_commander_is_told_every_condition():
    calls = [node for node in ast.walk(ast.parse(inspect.getsource(commander_core))) if isinstance(node, ast.Call)]
    (health,) = [call for call in calls if isinstance(call.func, ast.Attribute) and call.func.attr == "Health"]
    given = {keyword.arg for keyword in health.keywords}
    assert given == {*modes.Health._fields}
