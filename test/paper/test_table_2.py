"""The presets ``minimal`` and ``printed`` hold Table 2, typed in from the paper, and what had to be assumed."""

import pytest

from quad_attitude_ctrl import abfnitsm
from quad_core.parameters import build
from quad_position_ctrl import aibs

pytestmark = pytest.mark.unit

PRESETS = ("minimal", "printed")


@pytest.mark.parametrize("preset", PRESETS)
def test_table_2_position_law(preset):
    law = build(aibs.Parameters, aibs.PRESETS[preset])
    for axis in (law.x, law.y, law.z):
        assert (axis.integral_gain, axis.position_gain, axis.adaptation_rate) == (0.01, 4.25, 2.5)
        assert axis.initial_gain == 1.0
        assert axis.adaptation_leak == 0.0


@pytest.mark.parametrize("preset", PRESETS)
def test_table_2_attitude_law(preset):
    law = build(abfnitsm.Parameters, abfnitsm.PRESETS[preset])
    assert [axis.angle_gain for axis in (law.roll, law.pitch, law.yaw)] == [28.5, 50.0, 28.5]
    assert [axis.rate_gain for axis in (law.roll, law.pitch, law.yaw)] == [6.0, 6.0, 12.0]
    for axis in (law.roll, law.pitch, law.yaw):
        assert (axis.linear_gain, axis.power_gain, axis.power, axis.dead_zone) == (3.0, 2.5, 1.7, 0.3)
        assert (axis.surface_width, axis.reaching_width) == (1.0, 1.0)
        assert (axis.initial_constant, axis.initial_angle, axis.initial_rate) == (0.0, 0.0, 0.0)
        assert (axis.adaptation_constant, axis.adaptation_angle, axis.adaptation_rate) == (1.0, 1.0, 1.0)
