"""Messages and identity: each of the twenty findings about what a stranger or a fault did to a flight, by its tests."""

from findings import by_tests, reproduce

NODE, GUARD, LOG, LOOP, COMMANDER, BRINGUP = (
    f"src/{package}/test"
    for package in ("quad_node", "quad_guard", "quad_flight_log", "quad_flight", "quad_commander", "quad_bringup")
)
STRANGERS = "test/test_guard_strangers.py"

by_tests(
    "1. two flights in one domain, seeds 1 and 2",
    "one controller flew both, a vehicle was lost 392 m away, both exit 0 and log verify ok",
    "test/test_same_bits.py::test_two_namespaces_in_one_domain_are_two_lone_flights",
    f"{BRINGUP}/test_surroundings.py::test_whoever_publishes_our_topics_is_named",
    f"{LOG}/test_flight_checks.py::test_messages_of_two_runs_are_refused_and_an_empty_id_is_none",
    f"{LOG}/test_flight_checks.py::test_two_different_messages_with_one_stamp_are_refused_and_a_repeat_is_not",
    also="scripts/accept citizen",
)
by_tests(
    "2. states of step 2^63, in bursts too, and odometry of another time through the relay",
    "every controller deaf for good, rotors off after 0.1 s, attitude_controller blamed",
    f"{NODE}/test_succession.py",
    f"{NODE}/test_responder_strangers.py",
    f"{NODE}/test_responder_steps.py::test_one_absurd_step_is_refused_and_does_not_make_the_node_deaf",
    f"{NODE}/test_odometry_relay.py",
    f"{LOG}/test_steps.py::test_a_stamp_of_the_far_future_does_not_move_it",
    f"{STRANGERS}::test_absurd_steps_and_numbers_of_a_stranger_change_nothing",
)
by_tests(
    "3. payloads that are too short, too long, big-endian or no text",
    "struct.error or RMWError out of the callback killed the node, the bag was unreadable for metrics",
    "test/test_recorder_strangers.py",
    f"{NODE}/test_responder_steps.py::test_a_malformed_message_is_refused_and_does_not_end_the_node",
    f"{LOG}/test_payload_check.py",
    also="scripts/accept fuzz",
)
by_tests(
    "4. flight/plan of a stranger with end_step 1 and 2^63",
    "ended the flight as ENDED; never ended; MemoryError (393 PiB) before the start",
    f"{NODE}/test_handshake.py",
    f"{STRANGERS}::test_wrenches_and_plans_of_a_stranger_change_nothing",
)
by_tests(
    "5. NodeStatus, FlightState and FlightMode of no run",
    "FAILED ended the flight; DISARMED made the trajectory forget its mission",
    f"{NODE}/test_handshake.py::test_an_empty_run_id_belongs_to_nobody",
    f"{NODE}/test_handshake.py::test_a_failure_without_a_run_id_ends_nobodys_flight",
    f"{NODE}/test_command_link.py::test_what_is_malformed_or_of_another_run_is_not_obeyed",
    "src/quad_trajectory/test/test_trajectory_node.py::test_the_mode_of_another_run_or_of_none_is_not_obeyed",
    f"{COMMANDER}/test_preflight.py::test_who_names_no_run_is_nobody",
    f"{STRANGERS}::test_wrenches_and_plans_of_a_stranger_change_nothing",
)
by_tests(
    "6. finite absurd values: setpoint, reference and actuation of 1e300; a wrench of step 0, 1e6 and zero",
    "obeyed, and they fed the watchdog; tilt 131 deg; 12.6 m off",
    f"{GUARD}/test_checks.py",
    f"{GUARD}/test_guard.py::test_refused_commands_do_not_feed_the_watchdog",
    f"{NODE}/test_responder_strangers.py::test_an_absurd_input_is_refused_and_the_law_does_not_see_it",
    STRANGERS,
    also="scripts/accept flood",
)
by_tests(
    "7. recorder frozen for 1 s at 500 Hz, and a soak of 5 min",
    "0.43 to 0.52 s of each topic lost, 1,259 steps lost in the soak, good, dropped 0, steps 0",
    "test/test_frozen_recorder.py",
    f"{LOG}/test_steps.py",
    f"{LOG}/test_gaps.py",
    f"{NODE}/test_vehicle_node.py::test_nobody_has_recorded_a_step_that_is_not_flown",
    also="scripts/accept soak",
)
by_tests(
    "8. recorder killed",
    "flight FAILED 4.8 s later, motors stopped",
    "test/test_recorder_kill.py",
    f"{COMMANDER}/test_commander_node.py::test_a_recorder_that_leaves_is_said_and_lands_the_vehicle_if_asked",
    also="scripts/accept stops --only recorder",
)
by_tests(
    "9. recorder FAULT after ENDED",
    "the simulator waited 20 s, 'hung while it left'",
    f"{NODE}/test_vehicle_node.py::test_a_recorder_that_fails_after_the_end_is_heard",
)
by_tests(
    "10. simulator frozen for 1 s; a foreign wrench in lockstep",
    "attitude_controller or recorder blamed, stale_input with stamp 0",
    f"{NODE}/test_vehicle_guard.py::test_who_is_to_blame_for_a_takeover",
    f"{NODE}/test_command_link.py::test_an_owner_that_slept_does_not_call_the_commander_lost",
    f"{COMMANDER}/test_commander_node.py::test_a_commander_that_slept_holds_it_against_nobody",
    also="scripts/accept stops --only simulator",
)
by_tests(
    "11. one event of 70 MB; a request with a sender of a megabyte",
    "a chunk that the own reader refuses, whole bag lost; 100 MB/s of flight/mode, the controllers fell silent",
    "test/test_recorder_strangers.py",
    f"{LOG}/test_writer.py::test_a_message_that_no_reader_would_unpack_is_refused_when_it_is_written",
    f"{COMMANDER}/test_commander_node.py::test_a_request_that_is_none_is_refused_by_name",
)
by_tests(
    "12. estimator jumps by 4 m or 1 km, or is frozen for 5 s",
    "believed: 4 m; 37 m off in 5 s; good",
    f"{GUARD}/test_checks.py::test_a_position_may_be_a_metre_from_where_the_last_one_led",
    f"{GUARD}/test_guard.py::test_a_frozen_state_is_a_silent_one",
    f"{GUARD}/test_guard.py::test_a_jump_that_stays_is_a_reset_and_ends_the_flight_even_with_a_commander",
    f"{LOOP}/test_guard_in_loop.py::test_a_frozen_state_is_a_descent_on_a_prediction",
    "test/test_px4_bridge.py::test_a_state_that_is_lost_or_jumps_ends_in_a_landing",
    also="scripts/accept faults",
)
by_tests(
    "13. a rotor at 50 %",
    "4.4 m off, no event",
    "test/test_rotor_loss.py::test_with_half_a_rotor_it_lands_softly",
    f"{GUARD}/test_unknown_torque.py",
)
by_tests(
    "14. attitude_controller.period_steps=2 with position 5, and a node whose period is 0",
    "stalled at 0.4 s for 9 minutes and more; ZeroDivisionError",
    f"{NODE}/test_handshake.py",
    f"{NODE}/test_vehicle_node.py::test_a_node_without_a_period_is_refused_by_name_and_divides_nothing",
    f"{COMMANDER}/test_preflight.py::test_a_node_without_a_period_has_no_rate",
)
by_tests(
    "15. states 8 to 12 ms apart with plant_period 2 ms",
    "dt silently clamped to 4 ms, tumbled, ENDED, exit 0",
    f"{COMMANDER}/test_arming.py::test_each_fault_is_refused_by_name",
    "src/quad_autopilot/test/test_state_spacing.py",
    f"{NODE}/test_responder_steps.py::test_in_real_time_the_step_is_the_time_that_passed_within_half_and_twice_the_period",
)
by_tests(
    "16. Case 2 at 2.5 times its speed",
    "orbits 11 to 16 m off, outcome ended",
    "test/test_fly_ends.py::test_a_reference_that_asks_for_too_much_is_said_once_and_refused",
    f"{LOOP}/test_infeasible.py",
)
by_tests(
    "17. live ros2 param set of a gain",
    "bag and flight/parameters kept the old value",
    "test/test_live_parameters.py",
    f"{NODE}/test_law_node_answers.py::test_what_is_published_and_recorded_of_a_live_change_is_what_the_law_runs_with",
)
by_tests(
    "18. a law whose memory is infinite",
    "the loop flew on, the node refused",
    f"{LOOP}/test_order_of_loop.py::test_a_law_whose_memory_is_not_finite_is_refused_as_the_node_does",
    f"{NODE}/test_law_node_answers.py::"
    "test_memory_that_is_not_finite_is_refused_at_the_step_at_which_the_loop_refuses_it",
)
by_tests(
    "19. SIGSTOP of the attitude controller for 100 ms three times, and for 1 s",
    "rotors off after 52 ms: fall",
    "test/test_guard_case2.py",
    f"{GUARD}/test_guard.py::test_a_silent_controller_is_warned_of_after_20_ms_and_replaced_after_50",
    also="scripts/accept stops --only attitude",
)
by_tests(
    "20. trajectory killed; position controller killed",
    "held, then motors stopped after 6.7 s; level without position, 11 m of drift, then motors stopped",
    "test/test_mission_flights.py::test_a_killed_trajectory_becomes_hold_and_then_land",
    f"{COMMANDER}/test_mode_table.py::test_each_condition_in_each_mode",
    f"{BRINGUP}/test_supervisor.py::test_a_node_that_dies_in_real_time_makes_the_owner_land",
    also="scripts/accept kills, stops",
)


def main():
    return reproduce()
