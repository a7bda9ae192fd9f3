"""Each combination of mode before, mode, ground and who flies leads to the act that a person wrote down."""

import itertools

from quad_commander.mode_reference import ACTS, Act
from quad_core.enumerations import Mode

ON_GROUND = "DISARMED", "ARMING"
OTHERS_FLY = "DESCEND", "PILOT", "KILL"


def expected(before, mode, on_ground, laws_fly):
    """Return the act in words of what each mode is for."""
    if mode in ON_GROUND:
        return "carry on" if before == mode else "from the state"
    if laws_fly and before == mode:
        return "carry on"
    if mode in ("TAKEOFF", "MISSION"):
        return {"TAKEOFF": "rise", "MISSION": "hand over"}[mode]
    slides = before == "TAKEOFF" and mode == "LAND" and on_ground
    return "from the state" if not laws_fly or slides or before in (*ON_GROUND, *OTHERS_FLY) else "from the reference"


def test_the_table_is_the_one_on_paper():
    names = {
        Act.CARRY_ON: "carry on",
        Act.FROM_STATE: "from the state",
        Act.FROM_REFERENCE: "from the reference",
        Act.RISE: "rise",
        Act.HAND_OVER: "hand over",
    }
    keys = set(itertools.product(Mode, Mode, (False, True), (False, True)))
    assert set(ACTS) == keys
    for before, mode, on_ground, laws_fly in keys:
        found = names[ACTS[before, mode, on_ground, laws_fly]]
        assert found == expected(before.name, mode.name, on_ground, laws_fly), (before, mode, on_ground, laws_fly)
