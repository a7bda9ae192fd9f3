"""Mistakes of the prediction of late states, by function: (rule, what stands there, what it becomes)."""

PREDICTION = {
    "quad_core.prediction.predict": [
        ("rates", "scale(ages.z, mean)", "scale(-ages.z, mean)"),
        ("rates", "2.0 / window", "1.0 / window"),
        ("window", "ages.y if ages.y > ages.z else ages.z", "ages.z"),
        ("attitude", "0.5 * ages.y", "-0.5 * ages.y"),
        ("attitude", "scale(ages.y, subtract", "scale(ages.x, subtract"),
        ("velocity", "add(state.v_w, scale(ages.x, acceleration))", "state.v_w"),
        ("smoothing", "turned(before.q_wb, scale(0.5 * dt", "turned(before.q_wb, scale(dt"),
        ("bounded", "known_age.x + held.x > parameters.max_age", "held.x > parameters.max_age"),
    ],
    "quad_core.prediction._smoothed": [
        ("smoothing", "1.0 - z * z", "1.0 - z"),
        ("smoothing", "(1.0 - z) * (1.0 - z) / dt", "(1.0 - z) / dt"),
        ("smoothing", "add(acceleration, known.disturbance_w)", "acceleration"),
        ("smoothing", "scale(1.0 - slow, residual)", "scale(1.0 - z, residual)"),
    ],
    "quad_core.prediction.held_for": [
        ("held", "held.x + dt", "dt"),
        ("held", "before.v_w.x == state.v_w.x", "True"),
        ("held", "held.y + dt if same_attitude", "held.y + dt if same_rates"),
    ],
    "quad_core.prediction.angular_acceleration": [
        ("1", "(torque.x - turning.x) / xx", "(torque.x + turning.x) / xx"),
        ("1", "(torque.y - turning.y) / yy", "(torque.y - turning.y) / xx"),
    ],
    "quad_core.prediction.explained": [("1", "- vehicle.gravity", "+ vehicle.gravity")],
    "quad_core.prediction.ahead": [("motion", "0.5 * time * time", "time * time")],
    "quad_core.prediction.turned_towards": [
        ("smoothing", "2.0 * (1.0", "1.0 * (1.0"),
        ("smoothing", "share = -share", "share = share"),
        ("smoothing", "relative_attitude(q, target)", "relative_attitude(target, q)"),
    ],
    "quad_core.prediction.moved_towards": [("lag", "-rate * dt", "-dt")],
    "quad_core.rotor_lead.ahead_of_rotors": [
        ("lag", "share / -math.expm1(-dt / lag)", "share * -math.expm1(-dt / lag)"),
        ("lag", "lag <= parameters.remaining_lag", "lag >= parameters.remaining_lag"),
        ("lag", "add(given.torque_b, scale(share, missing))", "wrench.torque_b"),
    ],
    "quad_core.cycle.distance_behind": [
        ("infeasible", "or internals.thrust_limited", ""),
        ("infeasible", "INFEASIBLE_ERROR * INFEASIBLE_ERROR", "0.0"),
    ],
    "quad_core.cycle.followed": [
        ("behind_cycle", "distance == 0.0", "distance < 0.0"),
        ("behind_cycle", "behind.least - PROGRESS", "behind.least"),
        ("behind_cycle", "infeasible < 0 and", ""),
    ],
}
