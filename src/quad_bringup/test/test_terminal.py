"""What is said: nothing that a terminal obeys, and nothing that matters once nobody listens."""

import io
import os

import pytest

from quad_bringup import terminal
from quad_bringup.terminal import Progress, busy, complain, describe, say, write
from quad_msgs.msg import FlightState
from quad_node.codec import set_stamp


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_obeys_nothing_that_a_node_said(capsys):
    complain("hover: asked for by \x1b[31mred\nand two lines")
    say("hover: \x1b[2J")
    said = capsys.readouterr()
    assert said.err == "fly: hover: asked for by \\x1b[31mred and two lines\n"
    assert said.out == "hover: \\x1b[2J\n"


def test_words_that_nobody_reads_any_more_are_lost_and_harm_nobody():
    listener, mouth = os.pipe()
    with os.fdopen(mouth, "w", encoding="utf-8") as out:
        write("first\n", out)
        assert os.read(listener, 100) == b"first\n"
        os.close(listener)
        write("second\n", out)
        write("third\n", out)


def flight_state(phase, step, end_step, wall_time):
    state = FlightState(state=phase, reason="waiting for recorder", step=step, end_step=end_step, wall_time=wall_time)
    set_stamp(state.stamp, step * 2_000_000)
    return state


FLYING, ENDED = FlightState.FLYING, FlightState.ENDED


@pytest.mark.parametrize(("state", "text"), [
    (None, "starting"),
    (flight_state(FlightState.WAITING, 0, 0, 0.0), "waiting for recorder"),
    (flight_state(FLYING, 250, 0, 1.0), "0.5 s"),
    (flight_state(FLYING, 500, 1000, 0.5), "1.0 of 2.0 s, 2.0 x real time"),
    (flight_state(ENDED, 1000, 1000, 4.0), "2.0 of 2.0 s, 0.5 x real time"),
])  # fmt: skip
def test_line(state, text):
    assert describe(state) == text


@pytest.mark.parametrize(("out", "every"), [(io.StringIO, 5.0), (Terminal, 0.2)])
def test_lines_come_now_and_then(monkeypatch, out, every):
    now = [100.0]
    monkeypatch.setattr(terminal.time, "monotonic", lambda: now[0])
    stream = out()
    shown = Progress("case1", stream)
    for _ in range(3):
        shown.show(None)
    assert stream.getvalue().count("case1: starting") == 1
    now[0] += every + 0.01
    shown.show(None)
    assert stream.getvalue().count("case1: starting") == (2 if stream.isatty() else 1), "a line that says nothing new"
    shown.tell(3.25, "HOLD to LAND: asked for by mission")
    said = "case1: 3.2 s: HOLD to LAND: asked for by mission\n"
    assert stream.getvalue().endswith(said)
    now[0] += every + 0.01
    shown.show(flight_state(FLYING, 1500, 0, 1.0))  # 3.0 s: time does not go back
    assert stream.getvalue().endswith(said)
    now[0] += every + 0.01
    shown.show(flight_state(FLYING, 2000, 0, 1.0))
    shown.close()
    assert stream.getvalue().endswith("4.0 s\r\033[K" if stream.isatty() else "4.0 s\n")


def test_a_terminal_shows_what_it_waits_for_and_a_pipe_does_not(monkeypatch):
    for out, said in ((Terminal(), "\r\033[Khover: reading the bag ...\r\033[K"), (io.StringIO(), "")):
        monkeypatch.setattr(terminal.sys, "stderr", out)
        with busy("hover: reading the bag"):
            pass
        assert out.getvalue() == said
