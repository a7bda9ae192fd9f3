"""Identification of 100 random vehicles with known parameters, its intervals, and what must not be told.

Vehicles of 0.03 to 5 kg, lag 0 to 80 ms, delay 0 to 40 ms, a battery that sags, rotors and centre of gravity a little
off; 70 s of multisines in tilt, thrust and yaw each, with the noise of scenario ``flight``.
"""

import math
import time

import numpy as np
from samples import flight_of, log_of
from simulated import Manoeuvre, Noise, Truth, drawn, flown

from quad_identify.identify import identify

MOST_SECONDS = 30.0  # of processor time for one vehicle
BOUNDS = {
    "specific_thrust": 0.02,
    "roll_torque_per_inertia": 0.05,
    "pitch_torque_per_inertia": 0.05,
    "yaw_torque_per_inertia": 0.05,
}
TIMES = {"rotor_time_constant": 0.003, "command_delay": 0.002}
TRAPS = {
    "hover alone": (Manoeuvre(60.0, 0.0, 0.0, 0.0, 0.0), {}, ("specific_thrust", "rotor_time_constant", "inertia_xx")),
    "all at 50 Hz": (
        Manoeuvre(),
        {"every": 20, "motors_every": 20},
        ("rotor_time_constant", "command_delay", "inertia_xx"),
    ),
    "motors at 50 Hz": (Manoeuvre(), {"motors_every": 20}, ("rotor_time_constant", "roll_torque_per_inertia")),
    "no roll": (Manoeuvre(roll=0.0), {}, ("roll_torque_per_inertia", "inertia_xx")),
    "no yaw": (Manoeuvre(yaw=0.0), {}, ("yaw_torque_per_inertia", "yaw_drag_ratio")),
    "thrust hardly varies": (Manoeuvre(thrust=0.01), {}, ("thrust_square",)),
    "no gyro": (Manoeuvre(), {"without": ("body_rates",)}, ("inertia_xx", "rotor_time_constant")),
    "pushes of 2 s": (Manoeuvre(), {"noise": Noise(push=0.5)}, ()),
}


def truths(truth, voltage_ratio=1.0):
    """Return {name: true value} of what identification names so.

    ``voltage_ratio``: voltage to which the curve is referred over the simulation's mean.
    """
    lever, (x, y, z) = truth.arm * math.sqrt(0.5), truth.inertia
    full = truth.specific_thrust * voltage_ratio**truth.sag
    return {
        "specific_thrust": full,
        "thrust_offset": 0.0,
        "thrust_linear": full * (1.0 - truth.curve),
        "thrust_square": full * truth.curve,
        "thrust_battery": truth.sag,
        "rotor_time_constant": truth.lag,
        "command_delay": truth.delay,
        "linear_drag": truth.drag,
        "roll_torque_per_inertia": truth.mass * lever / x,
        "pitch_torque_per_inertia": truth.mass * lever / y,
        "yaw_torque_per_inertia": truth.mass * truth.yaw_arm / z,
        "inertia_xx": x,
        "inertia_yy": y,
        "inertia_zz": z,
        "yaw_drag_ratio": truth.yaw_arm,
        "rotor_effectiveness": list(truth.effectiveness),
    }


def run(figures):
    """Identify all and judge."""
    count = figures.each(100)
    close, held, longest = dict.fromkeys([*BOUNDS, *TIMES], 0), {}, 0.0
    for seed in range(count):
        truth = drawn(seed)
        lever = truth.arm * math.sqrt(0.5)
        log = flight_of(flown(truth))
        began = time.process_time()
        result = identify([log], truth.mass, (lever, lever), judge=False)
        longest, found = max(longest, time.process_time() - began), result.parameters
        for name, value in truths(truth, result.mean_voltage / float(log.voltage.values.mean())).items():
            one = found[name]
            if one.low is not None:
                inside = np.logical_and(np.less_equal(one.low, value), np.less_equal(value, one.high))
                held.setdefault(name, []).append(float(np.mean(inside)))
            if name in close and one.told:
                limit = TIMES.get(name) or BOUNDS[name] * value
                close[name] += abs(one.value - value) <= limit
    for name, number in close.items():
        figures.check(number >= 0.95 * count, f"{name}: {number} of {count} within its bound, at least 95 %")
    for name, inside in held.items():
        share = 100.0 * float(np.mean(inside))
        line = f"{name}: the interval holds the truth in {share:.1f} % of {len(inside)}, expected 90 to 99"
        figures.check(90.0 <= share <= 99.0 or count < 100, line)
    figures.at_most("longest identification of 70 s at 1 kHz, processor time", longest, MOST_SECONDS, "s")
    for name, (manoeuvre, how, refused) in TRAPS.items():
        lever = Truth().arm * math.sqrt(0.5)
        found = identify([log_of(Truth(), manoeuvre, **how)], Truth().mass, (lever, lever), judge=False).parameters
        told = [each for each in refused if found[each].told]
        wrong = [each for each, value in truths(Truth()).items() if found[each].told and is_missed(found[each], value)]
        figures.check(not told, f"{name}: told although it cannot be: {', '.join(told) or 'nothing'}")
        figures.check(not wrong, f"{name}: told with an interval beside the truth: {', '.join(wrong) or 'nothing'}")


def is_missed(found, value):
    """Return whether an interval misses a value by more than its half width, as one in 10,000 of 95 % does."""
    return bool(np.any(np.abs(np.subtract(found.value, value)) > np.subtract(found.high, found.low)))
