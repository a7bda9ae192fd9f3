"""The mistakes that unit tests must notice.

Snippets are written as ``ast.unparse`` writes code and must stand exactly once in the function.
"""

from attitude_mistakes import ATTITUDE
from baseline_mistakes import ATTITUDE_BASELINES, POSITION_BASELINES
from bridge_mistakes import AUTOPILOT, CRAZYFLIE, MAVLINK, PX4
from campaign_mistakes import CAMPAIGN
from flight_mistakes import FLIGHT
from guard_mistakes import COMMANDER, GUARD
from hil_mistakes import HIL
from log_mistakes import LOG
from mutation_engine import Mutation
from plant_mistakes import PLANTS, ROTATIONS
from position_mistakes import POSITION
from prediction_mistakes import PREDICTION
from trajectory_mistakes import TRAJECTORIES

MUTATIONS = [
    Mutation(f"eq. {equation}" if equation[0].isdigit() else equation, function, old, new)
    for family in (
        POSITION,
        ATTITUDE,
        PLANTS,
        ROTATIONS,
        TRAJECTORIES,
        POSITION_BASELINES,
        ATTITUDE_BASELINES,
        FLIGHT,
        PREDICTION,
        GUARD,
        COMMANDER,
        LOG,
        CAMPAIGN,
        AUTOPILOT,
        PX4,
        MAVLINK,
        CRAZYFLIE,
        HIL,
    )
    for function, mistakes in family.items()
    for equation, old, new in mistakes
]
