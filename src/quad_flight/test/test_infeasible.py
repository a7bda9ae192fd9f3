"""A flight whose reference asks for more than the vehicle has did not end well."""

import numpy as np
import pytest

from quad_flight import flight

LITTLE_TILT = "position_controller.aibs.limits.tilt=0.06"  # rad: too little for the turns of Case 2


def test_it_flies_on_to_its_end_and_is_infeasible():
    flown = flight.fly(flight.from_names("case2", duration=6.0, settings=[LITTLE_TILT]))
    assert (flown.outcome, flown.steps) == ("infeasible", flown.end_step)
    internals = flown.topics["position_controller/internals"]
    far = internals["tilt_limited"] & (np.linalg.norm(internals["position_error"], axis=1) > 1.0)
    times = internals["stamp_ns"][far] * 1e-9
    # it lasts, and what counts is that it does
    assert times[-1] - times[0] > 2.0
    assert np.diff(times).max() < 0.011


@pytest.mark.parametrize("preset", ["tuned", "minimal"])
@pytest.mark.parametrize("case", ["case1", "case2"])
def test_the_papers_own_start_is_followed(case, preset):
    """A step of 6 to 13 m: the laws are at their limits for more than 2 s, and come nearer all the time."""
    request = flight.from_names(
        case, preset=preset, start="printed", duration=8.0, settings=["vehicle.thrust_to_weight=4"]
    )
    flown = flight.fly(request)
    assert flown.outcome == "ended"
    assert np.linalg.norm(flown.topics["position_controller/internals"]["position_error"][-1]) < 1.0


@pytest.mark.parametrize("start", ["approach", "printed"])
def test_a_figure_at_five_times_its_speed_is_infeasible(start):
    request = flight.from_names("case2", start=start, duration=10.0, settings=["trajectory.case2.time_scale=0.2"])
    assert flight.fly(request).outcome == "infeasible"
