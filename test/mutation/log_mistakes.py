"""Mistakes of the metrics of a flight, by function: (what, what stands there, what it becomes)."""

_METRICS = "quad_flight_log.analysis.metrics"
_ESTIMATES = "quad_flight_log.analysis.estimates"
_OVERSHOOT = "quad_flight_log.analysis.overshoot"
_ARRAYS = "quad_flight_log.analysis.arrays"

LOG = {
    f"{_METRICS}.rmse": [
        ("average", "/ len(errors)", "/ errors.size"),
    ],
    f"{_METRICS}.itae": [
        ("window", "times * np.abs(errors)", "(times - times[0]) * np.abs(errors)"),
    ],
    f"{_METRICS}._integral": [
        ("sampling", "0.5 * (values[1:] + values[:-1])", "values[1:]"),
    ],
    f"{_METRICS}.settling_time": [
        ("window", "above[-1] + 1", "above[-1]"),
        ("window", "above[-1] == len(errors) - 1", "above[-1] == len(errors)"),
        ("window", "- times[0]", ""),
        ("window", "~(np.abs(errors) < band)", "np.abs(errors) > band"),
    ],
    f"{_METRICS}.hold_times": [
        ("sampling", "np.append(stamp_ns, end_ns)", "np.append(stamp_ns, stamp_ns[-1])"),
    ],
    f"{_METRICS}.effort": [
        ("axes", "squares.sum(axis=1)", "squares[:, :2].sum(axis=1)"),
        ("sampling", "hold * ", "hold[0] * "),
    ],
    f"{_METRICS}.total_variation": [
        ("axes", "np.diff(commands, axis=0)", "np.diff(commands[:, :2], axis=0)"),
        ("axes", "np.abs(np.diff(commands, axis=0))", "np.abs(np.diff(commands, axis=0).sum(axis=1))"),
        ("axes", "axis=0", "axis=-1"),
    ],
    f"{_METRICS}.band_energy": [
        ("average", " - commands.mean(axis=0)", ""),
        ("average", "commands.mean(axis=0)", "commands.mean()"),
        ("window", "count % 2 == 0", "count % 2 == 1"),
        ("sampling", "* (period / count)", "/ count"),
        ("axes", "spectrum.sum(axis=1)", "spectrum[:, 0]"),
        ("window", "> cutoff", ">= 0.5 * cutoff"),
    ],
    f"{_METRICS}.flight_metrics": [
        ("window", "reference['trajectory_time'] >= 0.0", "reference['trajectory_time'] >= -1.0"),
        ("window", "reference['trajectory_time'] >= 0.0", "reference['trajectory_time'] > 0.0"),
        ("window", "flown['stamp_ns'][0]", "reference['stamp_ns'][0]"),
        ("window", "max((int(table", "min((int(table"),
        ("window", "_since(known['attitude_setpoint'], start_ns)", "known['attitude_setpoint']"),
        ("window", "_since(known[COMMAND], start_ns)", "known[COMMAND]"),
        ("window", "_since(known['actuation'], start_ns)", "known['actuation']"),
        ("truth", "_position(known['truth'], flown)", "_position(known.get('state', known['truth']), flown)"),
    ],
    f"{_METRICS}._since": [
        ("window", "table['stamp_ns'] >= start_ns", "table['stamp_ns'] > start_ns"),
    ],
    f"{_METRICS}._position": [
        ("window", "error[-1]", "error[0]"),
        ("sampling", "reference['p_w'][match.right]", "reference['p_w'][match.left]"),
        ("sampling", "truth['p_w'][match.left]", "truth['p_w'][:len(match.left)]"),
    ],
    f"{_METRICS}._attitude": [
        ("wrap", "wrapped(euler_angles(truth['q_wb'][match.left]) - setpoint['angles'][match.right])",
         "euler_angles(truth['q_wb'][match.left]) - setpoint['angles'][match.right]"),
        ("sampling", "setpoint['angles'][match.right]", "setpoint['angles'][match.left]"),
        ("axes", "{'attitude_rmse': rmse(error)}", "{'attitude_rmse': rmse(error[:, :2])}"),
    ],
    f"{_METRICS}._command": [
        ("sampling", "+ period_ns", ""),
        ("sampling", "np.median(spacing)", "np.max(spacing)"),
        ("sampling", "(spacing == period_ns).all()", "(spacing > 0).all()"),
        ("axes", "total_variation(torque)", "total_variation(thrust[:, None])"),
        ("average", "high / whole if", "high if"),
    ],
    f"{_METRICS}._saturation": [
        ("axes", ", 'yaw_limited'", ""),
        ("axes", "'thrust_low', ", ""),
        ("axes", "np.logical_or", "np.logical_and"),
        ("sampling", "np.sum(hold[limited])", "np.sum(limited)"),
    ],
    f"{_METRICS}.thrust_and_torque": [
        ("axes", "['force']['z']", "['force']['x']"),
        ("axes", "'xyz'", "'xyy'"),
    ],
    f"{_ESTIMATES}.adaptive_bound": [
        ("60", "np.abs(euler_rates(angles, truth['omega_b']))", "np.abs(truth['omega_b'])"),
        ("60", "np.abs(angles)", "angles"),
        ("60", "np.abs(lumped['lumped_angular_acceleration_b'])", "lumped['lumped_angular_acceleration_b']"),
        ("sampling", "truth[second.right]", "truth[:len(second.right)]"),
    ],
    f"{_ESTIMATES}.disturbance_estimate": [
        ("sampling", "lumped['lumped_acceleration_w'][match.right]", "lumped['lumped_acceleration_w'][match.left]"),
    ],
    f"{_ESTIMATES}.reaching_time": [
        ("axes", "np.all(", "np.any("),
        ("window", ">= dwell", "> dwell"),
        ("window", "times[end - 1]", "times[min(end, len(times) - 1)]"),
        ("window", " - times[0]", ""),
        ("window", "np.abs(values) < bound", "np.abs(values) <= bound"),
    ],
    f"{_ESTIMATES}.belief_metrics": [
        ("window", "bound.stamp_ns >= start_ns", "bound.stamp_ns >= 0"),
        ("window", "belief.stamp_ns >= start_ns", "belief.stamp_ns >= 0"),
        ("window", "stamps >= start_ns", "stamps >= 0"),
        ("axes", "np.any(bound.truth[since] > bound.estimate[since], axis=1)",
         "np.all(bound.truth[since] > bound.estimate[since], axis=1)"),
        ("average", "np.sum(error * error) / len(error)", "np.sum(error * error) / error.size"),
    ],
    f"{_OVERSHOOT}.corner_overshoot": [
        ("window", "VELOCITY_STEP) + 1", "VELOCITY_STEP)"),
        ("window", "desired[jump]", "desired[jump - 1]"),
        ("axes", "arrival / speed", "arrival"),
        ("window", "found or 0.0)", "0.0)"),
    ],
    f"{_OVERSHOOT}.yaw_overshoot": [
        ("wrap", "change = wrapped(np.diff(desired))", "change = np.diff(desired)"),
        ("wrap", "wrapped(yaw[jump:end] - desired[jump])", "(yaw[jump:end] - desired[jump])"),
        ("window", "desired[jump])", "desired[jump - 1])"),
        ("window", "np.where(beyond < np.pi / 2.0, beyond, 0.0)", "beyond"),
    ],
    f"{_OVERSHOOT}._windows": [
        ("window", "min(int(following), late)", "int(following)"),
        ("window", "min(int(following), late)", "late"),
    ],
    f"{_ARRAYS}.euler_angles": [
        ("4", "w * x + y * z", "w * x - y * z"),
        ("4", "w * y - z * x", "w * y + z * x"),
        ("4", "1.0 - 2.0 * (y * y + z * z)", "1.0 - 2.0 * (x * x + z * z)"),
    ],
    f"{_ARRAYS}.euler_rates": [
        ("13", "lateral * np.tan(theta)", "lateral * np.sin(theta)"),
        ("13", "lateral / np.cos(theta)", "lateral"),
    ],
    f"{_ARRAYS}.wrapped": [
        ("wrap", "np.pi - np.mod(np.pi - angles, 2.0 * np.pi)", "np.mod(angles + np.pi, 2.0 * np.pi) - np.pi"),
    ],
    f"{_ARRAYS}.by_stamp": [
        ("sampling", "table[index]", "table[np.sort(index)]"),
    ],
}  # fmt: skip
