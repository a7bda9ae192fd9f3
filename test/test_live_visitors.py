"""A flight that is watched: the live view records what it sees and leaves with the flight; markers come and go."""

import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from flying import flown, in_domain, stranger, wait_until

from quad_bringup.domains import reserved_domain

pytestmark = pytest.mark.flight

chunk = pytest.importorskip("rerun.chunk")
FOLDER = Path(get_package_prefix("quad_flight_log"), "lib", "quad_flight_log")


def visitor(domain, name, *arguments):
    command = [str(FOLDER / name), *map(str, arguments)]
    return subprocess.Popen(command, env=in_domain(domain), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_the_live_view_records_the_flight_and_leaves_with_it(tmp_path):
    with reserved_domain(None) as domain:
        pass
    recording = tmp_path / "live.rrd"
    view = visitor(domain, "log", "view", "--live", "--save", recording)
    markers = visitor(domain, "markers")
    try:
        with stranger(domain, "onlooker") as node:
            wait_until(lambda: {"live_view", "markers"} <= {*node.get_node_names()}, 60.0, "both visitors are there")
        # Simulated seconds pass in a fraction of a real one, and nobody waits for visitors to have found the flight.
        flight = flown("hover", "--duration", "30", "--domain", str(domain), "--out", tmp_path / "bag")
        out, err = view.communicate(timeout=30)
        assert view.returncode == 0, out + err
        markers.send_signal(signal.SIGINT)
        out, err = markers.communicate(timeout=30)
        assert markers.returncode == 0, out + err
    finally:
        for process in (view, markers):
            if process.poll() is None:
                process.kill()
                process.communicate()
    truth = flight.array("truth")
    times, places = poses(recording)
    assert len(times) > 20
    assert np.diff(times).min() > 0.0
    rows = np.searchsorted(truth["stamp_ns"], np.round(times * 1e9).astype(np.int64))
    assert np.allclose(truth["stamp_ns"][rows] * 1e-9, times, rtol=0, atol=1e-9)
    assert np.allclose(truth["p_w"][rows], places, rtol=0, atol=1e-6)


def poses(path):
    """Return the times in s and the positions of the vehicle of a recording, in order."""
    found = []
    for part in chunk.RrdReader(str(path)).stream():
        if part.entity_path == "/world/vehicle":
            batch = part.to_record_batch()
            stamps = [stamp.total_seconds() for stamp in batch.column("flight").to_pylist()]
            found += zip(stamps, batch.column("Transform3D:translation").to_pylist(), strict=True)
    found.sort(key=lambda pair: pair[0])
    return np.array([time for time, _ in found]), np.array([place[0] for _, place in found])
