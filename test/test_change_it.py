"""Each change of the table in docs/how_to/change_it.md, made in a copy: it edits those files, and tests pass."""

import re
import shutil
import subprocess
import sys

import pytest
import yaml
from flying import ROOT

CHANGES = yaml.safe_load((ROOT / "test/changes.yaml").read_text(encoding="utf-8"))


def on_page(change):
    """Return the files that the page names for a change."""
    page = (ROOT / "docs/how_to/change_it.md").read_text(encoding="utf-8")
    (row,) = [line for line in page.splitlines() if line.startswith(f"| {change} |")]
    return re.findall(r"`(src/[^`]+)`", row)


def edit(folder, files):
    """Make the edits of ``files``; each replaces what is there once."""
    for name, edits in files.items():
        text = (folder / name).read_text(encoding="utf-8")
        for one in edits:
            assert text.count(one["old"]) == 1, (name, one["old"])
            text = text.replace(one["old"], one["new"])
        (folder / name).write_text(text, encoding="utf-8")


def add_orbit(cases):
    """Add the column of ORBIT to the table of modes of the tests: as HOLD, but for what HOLD waits for."""
    text = cases.read_text(encoding="utf-8")
    for name, cells in re.findall(r"^([A-Z_]+ +)((?:[A-Z] ){8}[A-Z])$", text, re.MULTILINE):
        letters = cells.split()
        own = "O" if letters[4] == "H" or name.startswith("REFERENCE_LOST") else letters[4]
        text = text.replace(name + cells, name + " ".join([*letters[:5], own, *letters[5:]]))
    cases.write_text(text, encoding="utf-8")


@pytest.fixture
def copy(tmp_path):
    """Return a copy of the sources and of what their tests need."""
    for name in ("src", "scripts/lib"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    (tmp_path / "test").mkdir()
    for name in ("conftest.py", "pyproject.toml", "test/allowed_skips.txt", "test/long_tests.txt"):
        shutil.copy(ROOT / name, tmp_path / name)
    shutil.copy(ROOT / "examples/my_law/my_law.py", tmp_path / "src/quad_position_ctrl/quad_position_ctrl/plain.py")
    return tmp_path


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_edits_the_files_of_the_page_and_its_tests_pass(copy, change):
    made = CHANGES[change]
    assert sorted(on_page(change)) == sorted(made["files"])
    edit(copy, made["files"])
    edit(copy, made.get("tests", {}))
    if "tests" in made:
        add_orbit(copy / "src/quad_commander/test/mode_cases.py")
    own = copy / "src" / made["package"] / "test" / "test_change.py"
    own.write_text(made["test"], encoding="utf-8")
    words = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", str(own)]
    words += [str(copy / "src" / name) for name in made["passing"]]
    found = subprocess.run(words, cwd=copy, capture_output=True, text=True, timeout=240, check=False)
    assert found.returncode == 0, found.stdout + found.stderr


def test_no_list_outside_a_bridge_names_it():
    for name in ("pyproject.toml", "conftest.py", "scripts/lib/mypy.ini", "scripts/lib/documentation_site.py"):
        assert "quad_crazyflie" not in (ROOT / name).read_text(encoding="utf-8"), name
