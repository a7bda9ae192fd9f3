"""The link is lost on the real wire: PX4's own messages time it, and fly names what was lost."""

import subprocess
import sys

import pytest
from flying import LONGEST, wait_until
from px4_flights import AIRFRAME, HERE, environment

from quad_bringup.surroundings import reserved_domain

pytestmark = [pytest.mark.flight, pytest.mark.wall_clock, pytest.mark.timeout(600)]


def test_a_killed_bridge_is_timed_and_named(tmp_path):
    (tmp_path / "airframe.yaml").write_text(AIRFRAME)
    with reserved_domain(None) as domain, (tmp_path / "fake.log").open("w+") as log:
        given = {**environment(), "ROS_DOMAIN_ID": str(domain)}
        words = [sys.executable, HERE / "fake_px4.py", "0", tmp_path / "report.json", "{}"]
        fake = subprocess.Popen(list(map(str, words)), env=given, stdout=log)
        wait_until(lambda: "up" in (tmp_path / "fake.log").read_text().split(), LONGEST, "an autopilot")
        command = [sys.executable, "-m", "quad_px4.check_link", str(tmp_path / "airframe.yaml"), "--vehicle", "x500"]
        command += ["--domain", str(domain), "--mode", "offboard", "--only", "bridge killed", "--height", "1"]
        command += ["--out", str(tmp_path / "out")]
        try:
            done = subprocess.run(command, env=given, capture_output=True, text=True, timeout=500, check=False)
        finally:
            fake.kill()
            fake.wait()
    head, row = done.stdout.splitlines()
    assert head.startswith("mode      lost by")
    assert row.startswith("offboard  bridge killed"), done.stdout + done.stderr
    assert "AUTO_LAND" in row, row
    took = float(row[28:38].split()[0])
    assert 0.05 < took < 1.0  # 0.1 s after the last heartbeat, said at most 0.2 s later
    assert done.returncode == int(took > 0.25)
    assert "px4_bridge was killed by SIGKILL" in row
