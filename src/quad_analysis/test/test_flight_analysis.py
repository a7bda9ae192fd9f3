"""Arrays and data frames of a flight."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest


def test_reading_needs_neither_ros_nor_extras(flown_bag):
    blocked = ("rclpy", "quad_msgs", "pandas", "scipy", "matplotlib", "numba", "plotly")
    text = (
        f"import sys\nfor name in {blocked!r}: sys.modules[name] = None\n"
        "from quad_report import cli\n"
        "sys.exit(max(cli.main([verb, sys.argv[1]]) for verb in ('metrics', 'info', 'replay')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", text, str(flown_bag)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "position_rmse" in done.stdout


def test_the_example_of_the_documentation_runs(flown, flown_bag, tmp_path, monkeypatch):
    page = (Path(__file__).parents[3] / "docs" / "how_to" / "flight_log.md").read_text(encoding="utf-8")
    example, of_others = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (tmp_path / "flights").mkdir()
    (tmp_path / "flights" / "case1-1-1").symlink_to(flown_bag)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(example, names)
    assert names["measured"](names["flight"]).position_rmse == pytest.approx(flown.result.rmse, rel=1e-12)
    wrench = flown.result.topics["wrench_setpoint"]
    np.testing.assert_array_equal(names["frame"]["wrench.torque.z"], wrench["torque_b"][:, 2])
    np.testing.assert_array_equal(names["frame"].index, wrench["stamp_ns"])
    others: dict = {}
    exec(of_others, others)
    heights = flown.result.topics["truth"]["p_w"][:, 2]
    np.testing.assert_array_equal(others["heights"], heights)
    assert others["truth"].p_w[2] == heights[-1]
