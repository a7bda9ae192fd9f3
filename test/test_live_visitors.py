"""A flight that is watched: the markers node starts and ends at any time; the bag shows the vehicle by itself."""

import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from flying import flown, in_domain, stranger, wait_until

from quad_bringup.domains import reserved_domain

pytestmark = pytest.mark.flight

MARKERS = Path(get_package_prefix("quad_flight_log"), "lib", "quad_flight_log", "markers")


def test_markers_come_and_go_and_the_bag_holds_pose_and_transforms(tmp_path):
    with reserved_domain(None) as domain:
        pass
    markers = subprocess.Popen(
        [MARKERS], env=in_domain(domain), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        with stranger(domain, "onlooker") as node:
            wait_until(lambda: "markers" in node.get_node_names(), 60.0, "the markers node is there")
        bag = flown("hover", "--duration", "2", "--domain", str(domain), "--out", tmp_path / "bag")
        markers.send_signal(signal.SIGINT)
        out, err = markers.communicate(timeout=30)
        assert markers.returncode == 0, out + err
    finally:
        if markers.poll() is None:
            markers.kill()
            markers.communicate()
    truth, poses, transforms = bag.array("truth"), bag.array("pose"), bag.array("/tf")
    assert len(poses) == len(transforms) == len(truth[::10])
    rows = np.searchsorted(truth["stamp_ns"], poses["stamp_ns"])
    np.testing.assert_array_equal(truth["stamp_ns"][rows], poses["stamp_ns"])
    for axis, letter in enumerate("xyz"):
        np.testing.assert_array_equal(truth["p_w"][rows, axis], poses["pose"]["position"][letter])
    last = transforms["transforms"][-1][0]
    assert (last["header"]["frame_id"], last["child_frame_id"]) == ("map", "base_link")
    assert last["transform"]["translation"]["z"] == truth["p_w"][rows[-1], 2]
