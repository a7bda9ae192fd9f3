"""Mistakes of the loop without ROS, its score and its log, by function: (what, what stands there, what it becomes)."""

FLIGHT = {
    "quad_flight.score.scored": [
        ("score", "dx * dx + dy * dy + dz * dz", "dx * dx + dy * dy"),
        ("score", "error > score.largest_error", "error < score.largest_error"),
        ("score", "score.samples + 1", "score.samples"),
        ("score", "score.squared_error + squared", "score.squared_error + error"),
        ("score", "largest, error, ", "largest, score.last_error, "),
    ],
    "quad_flight.score.with_torque_change": [
        ("score", " + abs(now.z - before.z)", ""),
        ("score", "abs(now.y - before.y)", "now.y - before.y"),
        ("score", "score.torque_variation + change", "change"),
    ],
    "quad_flight.stages._followed_by": [
        ("schedule", "k % steps == 0", "k % steps == 1"),
        ("schedule", "refused == 0 and ", ""),
        ("schedule", "seconds(steps, setup.schedule.plant_period)", "seconds(1, setup.schedule.plant_period)"),
        ("schedule", "is_finite(output) and ", ""),
        ("schedule", " and is_memory_finite(own)", ""),
        ("schedule", "is_memory_finite(own)", "is_memory_finite(memory[at])"),
        ("schedule", "refused = number", "refused = number - 1"),
        ("schedule", "internals[at])", "memory[at])"),
    ],
    "quad_flight.stages.places": [
        ("schedule", "every[:number - 1]", "every[:number]"),
        ("schedule", "{0: now, 1: before}", "{0: now, 1: before, 2: before}"),
        ("schedule", "{0: now, 1: before}", "{0: now + before, 1: before}"),
        ("schedule", "offered.index(topic)", "offered.index(topic) - 1"),
    ],
    "quad_flight.loop.take_off": [
        ("schedule", "steps_to_cover(duration, setup.schedule.plant_period)", "0"),
        ("schedule", "is_flyable(truth) else DIVERGED", "not is_flyable(truth) else DIVERGED"),
    ],
    "quad_flight.loop.fly": [
        ("schedule", "seconds(1, schedule.plant_period)", "seconds(schedule.trajectory_steps, schedule.plant_period)"),
        ("schedule", "stop > carry.end", "stop < carry.end"),
        ("schedule", "side.plant, before, conditions", "carry.side.plant, before, conditions"),
        ("schedule", "k % schedule.trajectory_steps == 0", "(k + 1) % schedule.trajectory_steps == 0"),
        ("schedule", "reference.trajectory_time >= schedule.score_from", "time >= schedule.score_from"),
        ("score", "score.samples > 0", "score.samples >= 0"),
        ("score", "scored(score, truth, reference)", "scored(score, state, reference)"),
        ("score", "before.torque_b, command.torque_b", "command.torque_b, command.torque_b"),
        ("schedule", "reference, side.actuation, k)", "reference, carry.side.actuation, k)"),
        ("schedule", "side, conditions, flown)", "side, conditions, before)"),
        ("schedule", "conditions, command, k - k % command_steps", "conditions, before, k - k % command_steps"),
        ("schedule", "outcome = REFUSED", "outcome = DIVERGED"),
        ("schedule", "k == carry.end", "k == carry.end - 1"),
    ],
    "quad_core.cycle.seconds": [("sampling", "plant_period / 1000000000.0", "plant_period * 1e-09")],
    "quad_core.cycle.steps_to_cover": [
        ("sampling", "- 1e-06", ""),
        ("sampling", "math.ceil(", "round("),
        ("sampling", "count < 1", "count < 0"),
    ],
    "quad_core.cycle.is_faulty": [
        ("sampling", " or (fault.yaw_offset != 0.0)", ""),
        ("sampling", "offset.z != 0.0", "offset.z > 0.0"),
    ],
    "quad_flight.rows.split": [
        ("log", "-first % period", "first % period"),
        ("log", "stage >= refused", "stage > refused"),
        ("log", "topic == 'actuation' or ", ""),
        ("log", "(first + len(rows) - 1) % period == 0", "(first + len(rows)) % period == 0"),
        ("log", "column = end", "column = end - 1"),
    ],
    "quad_flight.rows.with_steps": [
        ("log", "* period_steps", "* 1"),
        ("log", "full['step'] + period_steps", "full['step'] + 1"),
        ("log", "* plant_period", "* period_steps"),
    ],
}
