"""Mistakes of the attitude law, by function: (equation, what stands there, what it becomes)."""

ATTITUDE = {
    "quad_attitude_ctrl.sliding_control.saturation": [
        ("39", "0.5 * x", "x"),
        ("39", "x / width", "x * width"),
        ("39", "math.tanh", "math.atan"),
    ],
    "quad_attitude_ctrl.sliding_control.angle_exponent": [
        ("46", "abs(error)", "error"),
        ("46", "0.25", "0.2"),
        ("46", "steep = 1.4", "steep = 0.7"),
        ("46", "-outer ** steep - inner", "-outer ** steep + inner"),
        ("46", "+ 0.5", "- 0.5"),
    ],
    "quad_attitude_ctrl.sliding_control.rate_exponent": [
        ("46", "2.0 * exponent", "exponent"),
        ("46", "1.0 + exponent", "1.0 - exponent"),
    ],
    "quad_attitude_ctrl.sliding_control.surface_integrand": [
        ("45", "angle_term + rate_term", "angle_term - rate_term"),
        ("45", "abs(error) ** exponent", "abs(error) ** other"),
        ("45", "abs(error_rate) ** other", "abs(error_rate) ** exponent"),
        ("45", "saturation(error_rate, width)", "saturation(error, width)"),
        ("45", "angle_gain * abs(error)", "rate_gain * abs(error)"),
    ],
    "quad_attitude_ctrl.sliding_control.sliding_variable": [("45", "error_rate + integral", "error_rate - integral")],
    "quad_attitude_ctrl.sliding_control.next_surface_integral": [
        ("45", "integral + dt", "integral - dt"),
        ("45", "-max_integral, max_integral", "0.0, max_integral"),
    ],
    "quad_attitude_ctrl.sliding_control.equivalent_control": [
        ("52", "- model", "+ model"),
        ("52", "- integrand", "+ integrand"),
        ("52", " - error", ""),
        ("52", "- error", "+ error"),
        ("52", "desired_acceleration - ", "-"),
    ],
    "quad_attitude_ctrl.sliding_control.uncertainty_bound": [
        ("60", "abs(angle)", "angle"),
        ("60", "estimates.rate * abs(rate)", "estimates.rate * abs(angle)"),
        ("60", "estimates.constant + ", ""),
    ],
    "quad_attitude_ctrl.sliding_control.reaching_control": [
        ("53", "return -(", "return ("),
        ("53", "abs(sliding) ** power", "abs(sliding)"),
        ("53", "powered * layer", "powered"),
        ("53", "+ bound * layer", "- bound * layer"),
        ("53", "linear_gain * sliding", "linear_gain * layer"),
    ],
    "quad_attitude_ctrl.sliding_control.adaptive_rates": [
        ("55", "size <= dead_zone", "size < dead_zone"),
        ("55", "size <= dead_zone", "sliding <= dead_zone"),
        ("54", "form == AdaptationForm.ABS", "form != AdaptationForm.ABS"),
        ("54", "gains.angle * drive * abs(angle)", "gains.angle * drive * abs(rate)"),
        ("54", "gains.rate * drive * abs(rate)", "gains.rate * drive * rate"),
        ("54", "gains.constant * drive", "gains.constant"),
        ("54", "sliding * saturation", "saturation"),
    ],
    "quad_attitude_ctrl.sliding_control.next_estimate": [
        ("54", "estimate + dt", "estimate - dt"),
        ("54", "0.0, max_estimate", "0.0, rate"),
        ("54", "rate - leak * estimate", "rate + leak * estimate"),
        ("54", "leak * estimate", "leak"),
    ],
    "quad_attitude_ctrl.sliding_control.lyapunov": [
        ("42", "error * error", "error"),
        ("57", "+ sliding * sliding", "- sliding * sliding"),
    ],
    "quad_attitude_ctrl.sliding_control.lyapunov_rate": [
        ("58", "-error * integral", "error * integral"),
        ("58", "- bound * pull", "+ bound * pull"),
        ("58", "- powered * pull", "- powered"),
    ],
    "quad_attitude_ctrl.stability.lyapunov_total": [
        ("57", "known + 0.5", "known - 0.5"),
        ("57", "angle * angle / gains.angle", "angle * angle / gains.rate"),
    ],
    "quad_attitude_ctrl.stability.lyapunov_total_rate": [
        ("58", "total - shortfall * drive", "total + shortfall * drive"),
        ("58", "known_rate + sliding * disturbance", "known_rate - sliding * disturbance"),
        ("58", "size <= dead_zone", "size > dead_zone"),
    ],
    "quad_attitude_ctrl.sliding_control.force_difference": [("56", "/ inverse_inertia", "* inverse_inertia")],
    "quad_attitude_ctrl.torque.coefficients": [
        ("17", "(yy - zz) / xx", "(zz - yy) / xx"),
        ("17", "(zz - xx) / yy", "(zz - xx) / xx"),
        ("17", "(xx - yy) / zz", "(yy - xx) / zz"),
        ("17", "drag / yy", "drag / xx"),
        ("17", "vehicle.arm_length / xx", "vehicle.arm_length / yy"),
        ("17", "vehicle.arm_length / yy", "vehicle.arm_length / xx"),
        ("17", "1.0 / zz", "vehicle.arm_length / zz"),
    ],
    "quad_attitude_ctrl.torque.air_drag": [
        ("9", "-coefficient * abs(rate) * rate", "coefficient * abs(rate) * rate"),
        ("9", "abs(rate) * rate", "rate * rate"),
        ("9", "drag_sign == DragSign.PRINTED", "drag_sign == DragSign.CORRECTED"),
    ],
    "quad_attitude_ctrl.torque.model_acceleration": [
        ("52", "a.a1 * rates.y * rates.z", "a.a1 * rates.x * rates.z"),
        ("52", "a.a3 * rates.x * rates.z", "a.a2 * rates.x * rates.z"),
        ("52", "a.a5 * rates.x * rates.y", "a.a3 * rates.x * rates.y"),
        ("52", "air_drag(a.a6, rates.z", "air_drag(a.a6, rates.y"),
    ],
    "quad_attitude_ctrl.torque.body_acceleration": [
        ("14", "- ctheta * rates.y", "+ ctheta * rates.y"),
        ("14", "- sphi * rates.x * rates.y", "- cphi * rates.x * rates.y"),
        ("14", "- cphi * stheta", "- cphi * ctheta"),
        ("14", "- cphi * rates.x", "+ cphi * rates.x"),
    ],
    "quad_attitude_ctrl.torque.inverse_dynamics": [
        ("1", "(zz - yy)", "(yy - zz)"),
        ("1", "(xx - zz)", "(xx - yy)"),
        ("1", "yy * acceleration_b.y", "xx * acceleration_b.y"),
        ("9", "- air_drag(drag, omega_b.z", "+ air_drag(drag, omega_b.z"),
    ],
    "quad_attitude_ctrl.sliding_control.axis_control": [
        ("53", "state.angle, state.rate)\n    equivalent", "state.rate, state.angle)\n    equivalent"),
        ("53", "sliding, gains.linear_gain, gains.power_gain", "sliding, gains.power_gain, gains.linear_gain"),
        (
            "54",
            "gains.adaptation_constant, gains.adaptation_angle",
            "gains.adaptation_angle, gains.adaptation_constant",
        ),
        ("56", "equivalent + reaching", "equivalent - reaching"),
        ("58", "bound=bound", "bound=0.0"),
    ],
    "quad_attitude_ctrl.sliding_control.next_axis_memory": [
        ("54", "next_estimate(old.angle, rates.angle", "next_estimate(old.angle, rates.rate"),
        ("45", "control.integrand", "control.sliding"),
        ("55", "if frozen:", "if not frozen:"),
    ],
    "quad_attitude_ctrl.command.next_target": [
        ("41", "-max_way, max_way", "0.0, max_way"),
        ("41", "wrap_angle(raw - target)", "raw - target"),
    ],
    "quad_attitude_ctrl.command.next_filter_state": [
        ("41", "state.rate + bandwidth * c0", "state.rate - bandwidth * c0"),
        ("41", "2.0 * c2 - bandwidth * c1", "c2 - bandwidth * c1"),
        ("41", "bandwidth * c1 - 4.0 * c2", "bandwidth * c1 - 2.0 * c2"),
        ("41", "target + shift + offset", "target + offset"),
    ],
    "quad_attitude_ctrl.command.desired": [
        ("41", "source == CommandSource.RAW", "source != CommandSource.RAW"),
        ("41", "source == CommandSource.FEED_FORWARD", "source == CommandSource.RAW"),
        ("41", "roll.rate, pitch.rate, yaw.rate", "roll.rate, roll.rate, yaw.rate"),
    ],
    "quad_attitude_ctrl.command.next_filters": [
        ("41", "filters.yaw, raw.z, yaw.bandwidth", "filters.yaw, raw.z, roll.bandwidth"),
        ("41", "filters.pitch, raw.y", "filters.pitch, raw.x"),
    ],
    "quad_attitude_ctrl.torque.limited_torque": [
        ("limits", "-limits.pitch, limits.pitch", "-limits.roll, limits.pitch"),
        ("limits", "torque.z != command.z", "torque.z == command.z"),
    ],
    "quad_attitude_ctrl.torque.integrals_frozen": [
        ("limits", "limited.y or actuation.pitch_limited", "limited.y"),
        ("limits", "anti_windup and (limited.x", "True and (limited.x"),
    ],
    "quad_attitude_ctrl.abfnitsm._torque": [
        ("56", "arm * force_difference(control.x", "force_difference(control.x"),
        ("56", "force_difference(control.y, b.b2)", "force_difference(control.y, b.b1)"),
        ("56", "force_difference(control.z, b.b3)", "arm * force_difference(control.z, b.b3)"),
        ("14", "parameters.mapping == TorqueMapping.PRINTED", "parameters.mapping != TorqueMapping.PRINTED"),
    ],
    "quad_attitude_ctrl.abfnitsm._axis_states": [
        ("40", "wrap_angle(angles.z - x_d.z)", "angles.z - x_d.z"),
        ("40", "wrap_angle(angles.x - x_d.x)", "angles.x - x_d.x"),
        ("40", "angles.y - x_d.y", "angles.x - x_d.y"),
        ("41", "rates.x - v_d.x", "rates.x + v_d.x"),
        ("52", "a_d.x, model.x", "a_d.x, model.y"),
        ("52", "rates.y - v_d.y, a_d.y", "rates.y - v_d.y, a_d.x"),
    ],
    "quad_attitude_ctrl.abfnitsm.step": [
        ("52", "axis_control(parameters.pitch, memory.pitch", "axis_control(parameters.roll, memory.pitch"),
        ("54", "axis_control(parameters.yaw, memory.yaw", "axis_control(parameters.yaw, memory.roll"),
        ("limits", "rest.y or pitch.dead", "rest.y"),
        ("limits", "parameters.yaw.max_torque)", "parameters.roll.max_torque)"),
    ],
    "quad_attitude_ctrl.command.led": [
        ("41", "3.0 * rate", "2.0 * rate"),
        ("41", "source != CommandSource.LED", "source == CommandSource.LED"),
    ],
    "quad_attitude_ctrl.abfnitsm_so3.doubled": [("40", "2.0 * side * q.y", "side * q.y")],
    "quad_attitude_ctrl.abfnitsm_so3.set_attitude": [
        ("38", "return normalized(q)", "return quaternion_from_euler(setpoint.angles)"),
        ("38", "return normalized(q)", "return q"),
    ],
    "quad_attitude_ctrl.abfnitsm_so3.chosen_side": [
        ("unwinding", "scalar >= 0.0", "scalar < 0.0"),
        ("unwinding", "memory.side * scalar < -margin", "memory.side * scalar < margin"),
    ],
    "quad_attitude_ctrl.abfnitsm_so3.step": [
        ("41", "subtract(omega_b, turned_rates)", "subtract(omega_b, goal.rates)"),
        ("1", "subtract(rotate_inverse(q, goal.accelerations)", "add(rotate_inverse(q, goal.accelerations)"),
    ],
    "quad_attitude_ctrl.rotation_filter.way_to": [
        ("tilt", "q.y * q.w + q.x * q.z", "q.y * q.w - q.x * q.z"),
        ("turn", "2.0 * math.atan2(q.z, q.w)", "math.atan2(q.z, q.w)"),
        ("upside down", "tilt * q.x / swing, tilt * q.y / swing, 0.0", "0.0, 0.0, 0.0"),
    ],
    "quad_attitude_ctrl.abfnitsm_so3.with_heading_near": [
        ("heading gives way", "clamp(turn, -widest, widest) - turn", "turn - clamp(turn, -widest, widest)"),
        ("its axes turn with it", "rotate_inverse(other, goal.rates)", "goal.rates"),
        ("heading gives way", "abs(turn) <= widest", "abs(turn) <= 9.0"),
    ],
    "quad_attitude_ctrl.rotation_filter.next_rotation": [
        ("bounded", "tilt > widest", "tilt < widest"),
        ("a turn does not shorten the tilt", "left.x * left.x + left.y * left.y", "left.x * left.x + left.z * left.z"),
        ("bounded", "clamp(left.z, -widest, widest)", "left.z"),
        ("rate limit", "clamp(way.z, -yaw.max_rate * dt, yaw.max_rate * dt)", "way.z"),
    ],
}
