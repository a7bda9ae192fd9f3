"""What is said: nothing that a terminal obeys, and nothing that matters once nobody listens."""

import os

from quad_bringup.terminal import complain, say, write


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
