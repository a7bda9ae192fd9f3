"""scripts/trace finds its way through the loop and through a node, and neither way has grown."""

import re
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "trace"


def test_both_ways_are_traced_from_their_first_file_to_their_last():
    found = subprocess.run(
        [sys.executable, SCRIPT, "--max", "24", "9"], capture_output=True, text=True, timeout=240, check=False
    )
    assert found.returncode == 0, found.stdout + found.stderr
    step, gain, node, *_ = re.split(r"\n(?=aibs\.|one thrust)", found.stdout)
    assert "quad_dynamics/rigid_body.py" in step
    assert "quad_attitude_ctrl/abfnitsm.py" in step
    for way in (gain, node):
        assert "quad_core/parameter_files.py" in way
        assert "quad_position_ctrl/aibs.py" in way
    assert "quad_node/law_node.py" in node
    counted = [int(number) for number in re.findall(r": (\d+) files, ", found.stdout)]
    assert len(counted) == 5  # the step, the gain without ROS and over it, the thrust without ROS and over it
    assert all(5 <= number <= 40 for number in counted)
    without, over = counted[3:]
    assert without <= 16
    assert over <= 23
