"""Recorder, reader, tools, set-up and launch: findings that tests of the suite reproduce, beside those of `citizen`."""

from findings import by_tests, reproduce

LOG, BRINGUP, SET_UP, NODES = (
    "src/quad_flight_log/test",
    "src/quad_bringup/test",
    "test/test_set_up.py",
    "test/test_nodes.py",
)

# Recorder, reader, tools
by_tests(
    "a recorder over hours",
    "grew by 1.9 MB a minute in a straight line",
    f"{LOG}/test_writer.py::test_memory_grows_by_the_index_of_its_chunks_alone",
    also="scripts/accept soak",
)
by_tests(
    "hostile bags and files of limits",
    "643 bags: 58 tracebacks, 2 hangs; log info over 60 s, a bomb of 2.4 GB over 120 s; escapes printed",
    f"{LOG}/test_hostile_bags.py",
    f"{LOG}/test_bag_damage.py",
    also="scripts/accept fuzz",
)
by_tests(
    "the HTML report",
    "no policy, no verdict, no limits, no meaning of a metric on hover, 5.8 MB for 23 s",
    f"{LOG}/test_report_page.py",
    also="scripts/accept reports",
)
by_tests(
    "metrics of a cut bag",
    "said nothing of the cut",
    f"{LOG}/test_log_cli.py::test_metrics_of_a_cut_bag_say_that_it_is_cut",
)
by_tests(
    "SIGINT of a flight in one process",
    "8 of 20 bags cut beside load; 'recorder stopped before the end' after 1.5 s",
    "test/test_one_process_interrupt.py",
    also="scripts/accept signals",
)
by_tests(
    "SIGINT in the first seconds, and again after the flight",
    "traceback, exit code -2 or -15; three lines 'position_... found not available'",
    "test/test_fly_first_seconds.py",
)
by_tests(
    "approaches from anywhere to curves of any scale",
    "90 of 6,771 outside their limits, the worst 24 times; a lemniscate at 10 m/s never returned",
    "src/quad_trajectory/test/test_run_up.py",
    "src/quad_trajectory/test/test_approach.py",
    also="scripts/accept plans",
)

# Set-up and security
by_tests(
    "set-up: PYTHON=, another checkout's shell, a copied checkout, fly_by_hand.sh, hashes of requirements",
    "PYTHON ignored; rebuilt on the other .venv; pip kept the old path; flew case '--help'; no hashes",
    SET_UP,
    also="scripts/accept pythons, fresh_clone",
)
by_tests(
    "the lock of a domain",
    "in /tmp for all users, followed links; anybody could hold all 101",
    f"{BRINGUP}/test_domains.py::test_locks_lie_in_a_folder_of_the_user_alone",
    f"{BRINGUP}/test_domains.py::test_the_session_s_folder_is_taken_where_there_is_one",
    f"{BRINGUP}/test_domains.py::test_a_lock_follows_no_link",
    f"{BRINGUP}/test_domains.py::test_a_lock_folder_that_others_write_is_refused",
)

# Launch and nodes
by_tests(
    "ros2 launch: default transports, a parameter file that is missing, simulate:=maybe, one node refused",
    "open to other hosts; flew anyway; taken for false; the others waited",
    f"{BRINGUP}/test_launch_file.py",
)
by_tests(
    "a node by hand with unknown words, a missing file, a wrong value in a file",
    "ran with defaults; flew anyway; the file was not named; the trajectory waited 60 s",
    f"{NODES}::test_unknown_words_are_refused",
    f"{NODES}::test_a_wrong_value_is_refused_with_its_file",
    f"{NODES}::test_a_wrong_value_of_the_command_line_is_not_put_down_to_a_file",
    f"{NODES}::test_a_bad_parameter_file_is_refused_by_name",
    "src/quad_core/test/test_parameter_files.py",
)
by_tests(
    "a second controller of a role",
    "real time: both obeyed, no word, exit 0; lockstep: 4,598 ERROR lines, failed only at the end",
    "src/quad_node/test/test_links.py::test_a_second_sender_is_named",
    f"{LOG}/test_flight_checks.py::test_a_second_message_that_the_recorder_refused_counts_too",
    "test/test_guard_strangers.py::test_absurd_steps_and_numbers_of_a_stranger_change_nothing",
)
by_tests(
    "what a stranger writes into a message, on a terminal",
    "fly and log info printed its escapes",
    f"{BRINGUP}/test_terminal.py",
    f"{LOG}/test_hostile_bags.py::test_what_a_bag_holds_is_printed_without_its_escapes",
)


def main():
    return reproduce()
