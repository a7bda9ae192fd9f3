"""What a flight over ROS prints of what others have said in it."""

from quad_bringup import ros_flight


def test_a_terminal_obeys_nothing_that_a_node_said(capsys):
    ros_flight._complain("hover: asked for by \x1b[31mred\nand two lines")
    ros_flight._say("hover: \x1b[2J")
    said = capsys.readouterr()
    assert said.err == "fly: hover: asked for by \\x1b[31mred and two lines\n"
    assert said.out == "hover: \\x1b[2J\n"
