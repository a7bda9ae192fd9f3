"""What a command line asks for is known before there is a node."""

import pytest

from quad_node.parameters import check_arguments

FILE = "{pattern}:\n  ros__parameters:\n    flight.mode: {mode}\n"


@pytest.mark.parametrize(
    ("words", "is_realtime"),
    [
        ([], False),
        (["-p", "flight.mode:=realtime"], True),
        (["--param", "simulator:flight.mode:='realtime'"], True),
        (["-p", "flight.mode:=lockstep"], False),
        (["-p", "flight.mode:=realtime", "-p", "flight.mode:=lockstep"], False),
        (["-p", "flight.run_id:=realtime"], False),
    ],
)
def test_the_mode_is_that_of_the_last_word(words, is_realtime):
    assert check_arguments(["simulator", "--ros-args", *words]) is is_realtime


@pytest.mark.parametrize("pattern", ["/**", "/uav1/simulator", "simulator"])
def test_the_mode_of_a_file_holds_unless_a_word_says_otherwise(tmp_path, pattern):
    path = tmp_path / "flight.yaml"
    path.write_text(FILE.format(pattern=pattern, mode="realtime"))
    given = ["simulator", "--ros-args", "--params-file", str(path)]
    assert check_arguments(given)
    assert not check_arguments([*given, "-p", "flight.mode:=lockstep"])
    later = tmp_path / "later.yaml"
    later.write_text(FILE.format(pattern="/**", mode="lockstep"))
    assert not check_arguments([*given, "--params-file", str(later)])
