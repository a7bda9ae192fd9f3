"""The page for people is made from the table, and says what the table says."""

import mode_pages

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
