"""One roll axis alone under ABFNITSM, without disturbance: how fast its surface brings an error to zero."""

from quad_attitude_ctrl.sliding_control import (
    AdaptationForm,
    AxisGains,
    AxisMemory,
    AxisState,
    Estimates,
    angle_exponent,
    axis_control,
    next_axis_memory,
)

DT = 0.002
SECONDS = 60.0
START = 0.5
BANDS = (0.1, 0.01, 0.001)
SLIDING_BAND = 0.01


def convergence(width, linear_gain):
    """Return cells: times in s from which abs(e) stays within each band, overshoot in rad, time until s stays small.

    From 0.5 rad at rest, torque unlimited and constant over 2 ms, Table 2 but for ``width`` and ``linear_gain``.
    """
    gains = AxisGains(surface_width=width, linear_gain=linear_gain)
    memory = AxisMemory(0.0, Estimates(0.0, 0.0, 0.0))
    angle, rate, lowest = START, 0.0, START
    last = dict.fromkeys((*BANDS, "s"), 0.0)
    for k in range(int(SECONDS / DT)):
        state = AxisState(angle=angle, rate=rate, error=angle, error_rate=rate, desired_acceleration=0.0, model=0.0)
        control = axis_control(gains, memory, state, angle_exponent(state.error), AdaptationForm.ABS)
        for band in BANDS:
            if abs(angle) > band:
                last[band] = (k + 1) * DT
        if abs(control.sliding) > SLIDING_BAND:
            last["s"] = (k + 1) * DT
        lowest = min(lowest, angle)
        memory = next_axis_memory(gains, memory, control, False, DT)
        angle += DT * rate + 0.5 * DT * DT * control.control
        rate += DT * control.control
    times = [shown(last[band]) for band in BANDS]
    return [*times, f"{max(0.0, -lowest):.3f} rad", shown(last["s"])]


def shown(time):
    """Return a time as a cell."""
    return f"{time:.2f} s" if time < SECONDS - DT else f"> {SECONDS:.0f} s"
