"""The progress line: what it says, and how often."""

import io

import pytest

from quad_bringup import progress
from quad_bringup.progress import Progress, describe
from quad_node.watch import ENDED, FLYING, WAITING, Sighting


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (None, "starting"),
        (Sighting(WAITING, "waiting for recorder", 0, 0, 0.0, 0.0), "waiting for recorder"),
        (Sighting(FLYING, "", 250, 0, 0.5, 1.0), "0.5 s"),
        (Sighting(FLYING, "", 500, 1000, 1.0, 0.5), "[############............] 1.0 of 2.0 s, 2.0 x real time"),
        (Sighting(ENDED, "", 1000, 1000, 2.0, 4.0), "[########################] 2.0 of 2.0 s, 0.5 x real time"),
    ],
)
def test_line(state, text):
    assert describe(state) == text


@pytest.mark.parametrize(("out", "every"), [(io.StringIO, 5.0), (Terminal, 0.2)])
def test_lines_come_now_and_then(monkeypatch, out, every):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    stream = out()
    shown = Progress("case1", stream)
    for _ in range(3):
        shown.show(None)
    assert stream.getvalue().count("case1: starting") == 1
    now[0] += every + 0.01
    shown.show(None)
    assert stream.getvalue().count("case1: starting") == 2
    shown.tell(3.25, "HOLD to LAND: asked for by mission")
    assert stream.getvalue().endswith("case1: 3.2 s: HOLD to LAND: asked for by mission\n")
    shown.show(None)
    now[0] += every + 0.01
    shown.show(None)
    shown.close()
    assert stream.getvalue().endswith("\r\033[K" if stream.isatty() else "starting\n")
