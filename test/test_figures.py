"""What an acceptance run ends with: nothing flown is not all kept."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

FIGURES = Path(__file__).parent / "accept" / "figures.py"
RUN = """
def run(figures):
    for name, value in {"hover": 1.0, "Case 2": 3.0}.items():
        if figures.wants(name):
            figures.at_most(name, value, 2.0, "m")
"""


@pytest.mark.parametrize(
    ("only", "code", "said"),
    [
        ("", 1, "FAIL Case 2: 3 m, limit 2 m"),
        ("hover", 0, "ok   hover: 1 m, limit 2 m"),
        ("Case 2", 1, "FAIL Case 2: 3 m, limit 2 m"),
        ("case2", 2, "--only: found 'case2', expected part of one of hover; Case 2"),
    ],
)
def test_a_name_that_no_kind_has_is_bad_usage_and_passes_nothing(only, code, said, tmp_path):
    (tmp_path / "made.py").write_text(RUN)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "QUAD_ACCEPT_ONLY": only}
    words = [sys.executable, FIGURES, "made"]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, said in done.stdout + done.stderr) == (code, True)
