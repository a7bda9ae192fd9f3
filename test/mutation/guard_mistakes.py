"""Mistakes of guard, backup law and commander, by function: (rule, what stands there, what it becomes)."""

GUARD = {
    "quad_guard.checks.command_refusal": [
        ("finite", "wrench.thrust + torque.x + torque.y + torque.z", "wrench.thrust + torque.x + torque.y"),
        ("newer", "command.step <= last_step", "command.step < last_step"),
        ("ahead", "command.step > newest", "command.step > newest + 1"),
        ("old", "> limits.too_old", "> 10.0 * limits.too_old"),
        ("stamp", "command.stamp != command.step * period", "command.stamp < command.step * period"),
    ],
    "quad_guard.checks.largest_torque": [
        ("8", "2.0 * DIAGONAL * tilting", "DIAGONAL * tilting"),
        ("8", "2.0 * rotor", "rotor"),
    ],
    "quad_guard.checks.must_differ": [
        ("frozen", "norm(last.omega_b) >= least", "norm(last.omega_b) < least"),
        ("frozen", "flown.thrust - held.thrust", "flown.thrust"),
        ("frozen", "if not still:", "if still:"),
    ],
    "quad_guard.checks.is_on_ground": [
        ("ground", "height <= rule.stop_height", "height >= rule.stop_height"),
        ("ground", "thrust < rule.thrust", "thrust > rule.thrust"),
    ],
    "quad_guard.guard.answered_until": [("late", "return now", "return command_step")],
    "quad_guard.checks.position_change": [("jump", "gap * last.v_w.x", "gap * last.v_w.y")],
    "quad_guard.checks.is_surely_within": [("jump", "20.0 *", "2.0 *")],
    "quad_guard.checks.half_cosine": [("jump", "abs(", "(")],
    "quad_guard.state.expired": [("window", "<= limits.refused_window", ">= limits.refused_window")],
    "quad_guard.state.counted": [("window", "refusals.recent + 1", "refusals.recent + 2")],
    "quad_guard.guard.condition": [
        ("wrench lost", "command_age > parameters.command.lost_age", "command_age > parameters.command.warn_age"),
        ("state lost", "state_age > parameters.state.lost_age", "state_age > parameters.state.gone_age"),
        ("tilt", "height < tilt.low_height", "height > tilt.low_height"),
    ],
    "quad_guard.state.is_gone": [("state gone", "belief.step >= 0", "belief.step < 0")],
    "quad_guard.state.observe": [("stale rate", "not repeats", "repeats")],
    "quad_guard.guard.watch": [("contact", "timers.on_ground + dt if stands", "timers.on_ground + dt if not stands")],
    "quad_guard.guard.fly": [("state gone", "rate_age <= parameters", "state_age <= parameters")],
    "quad_guard.guard.next_mode": [
        ("kill", "wrong >= STATE_GONE", "wrong > STATE_GONE"),
        ("severity", "asked > memory.mode", "asked != memory.mode"),
        ("release", "timers.good >= parameters.settle_time", "timers.good >= 0.0"),
    ],
    "quad_guard.backup.level_torque": [
        ("attitude", "stiffness * y", "stiffness * x"),
        ("attitude", "- damping * p", "+ damping * p"),
        ("yaw", "-zz * law.yaw_rate_bandwidth", "zz * law.yaw_rate_bandwidth"),
    ],
    "quad_guard.backup.desired_direction": [
        ("brake", "-law.velocity_bandwidth * state.v_w.x", "law.velocity_bandwidth * state.v_w.x")
    ],
    "quad_guard.backup.descent_thrust": [("sink", "-sinking - vertical_speed", "sinking - vertical_speed")],
    "quad_guard.backup.contact": [("stop", "low and ramp <= 0.0", "ramp <= RESTING_RAMP")],
    "quad_guard.unknown_torque.estimated": [("sees", "memory.begun and sees", "memory.begun")],
    "quad_guard.unknown_torque.advanced": [("1", "(yy - zz) * q * r", "(zz - yy) * q * r")],
    "quad_guard.unknown_torque.thrust_for": [("8", "2.0 * DIAGONAL", "DIAGONAL")],
    "quad_guard.unknown_torque.within_thrust": [("weight", "thrust > least", "thrust < least")],
    "quad_guard.backup.without_unknown": [("unknown", "torque.x - unknown.x", "torque.x + unknown.x")],
    "quad_guard.backup.predicted_rates": [("1", "(xx - yy) * p * q", "(yy - xx) * p * q")],
}

COMMANDER = {
    "quad_commander.modes.step": [
        ("progress", "raised & FLAGS[condition] and TABLE[mode][condition] != mode", "raised & FLAGS[condition]"),
        ("lasting", "0 if mode == DISARMED else lasting(raised)", "lasting(raised)"),
        ("mission", "memory.in_mission and (reason != ON_REQUEST)", "memory.in_mission"),
        ("release", "if memory.mode == DESCEND", "if memory.mode != DESCEND"),
    ],
    "quad_commander.modes.asked": [
        ("blocked", "target < mode or target == ARMING", "target < mode"),
        ("pilot", "not raised & FLAGS[CONTACT]", "raised & FLAGS[CONTACT]"),
    ],
    "quad_commander.modes.most_severe": [("severity", "following > worst", "following < worst")],
    "quad_commander.modes.faults_of_inputs": [("guard", "wrong or unseen", "wrong and unseen")],
    "quad_commander.modes.guard_request": [("release", "release > 0.0", "release >= 0.0")],
    "quad_commander.references.stopped": [
        ("stop", "a * abs(a)", "a * a"),
        ("stop", "0.5 * (a - peak) * first", "0.5 * (a + peak) * first"),
    ],
    "quad_commander.references.rest_to_rest": [("move", "4.0 * way", "2.0 * way")],
    "quad_commander.references.plan_mode": [("land", "z.end > ground_height", "z.end < ground_height")],
    "quad_commander.missions.next_request": [("hold", "memory.time + dt >= item.value", "memory.time + dt >= 0.0")],
    "quad_commander.arming.outside": [("fence", "not all(", "not any(")],
}
