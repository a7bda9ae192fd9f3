"""Arrays and data frames of a flight."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from quad_flight_log.analysis.frames import frame
from quad_flight_log.bag.reader import open_flight


def test_a_frame_has_a_column_per_number(flown, flown_bag):
    table = frame(open_flight(flown_bag), "wrench_setpoint")
    wrench = flown.result.topics["wrench_setpoint"]
    np.testing.assert_array_equal(table["wrench.torque.z"], wrench["torque_b"][:, 2])
    np.testing.assert_allclose(table.index, wrench["stamp_ns"] * 1e-9, rtol=0, atol=1e-12)
    assert table.index.name == "time"
    assert {"stamp_ns", "header.frame_id"} <= set(table.columns)
    assert list(frame(open_flight(flown_bag), "flight/parameters").index) == [0.0] * 5  # no stamp: time of recording


def test_reading_needs_neither_ros_nor_extras(flown_bag):
    blocked = ("rclpy", "quad_msgs", "pandas", "scipy", "matplotlib", "numba", "plotly")
    text = (
        f"import sys\nfor name in {blocked!r}: sys.modules[name] = None\n"
        "from quad_flight_log import cli\n"
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
    np.testing.assert_array_equal(names["both"]["p_w[0]"], flown.result.topics["truth"]["p_w"][::5, 0])
    others: dict = {}
    exec(of_others, others)
    heights = flown.result.topics["truth"]["p_w"][:, 2]
    np.testing.assert_array_equal(others["heights"], heights)
    assert others["truth"].p_w[2] == heights[-1]
