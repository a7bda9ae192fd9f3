"""What the commander registers of itself: an optional node of a flight."""

from quad_commander.parameters import CommanderParameters
from quad_core.roles import Role

ROLE = Role("quad_commander", CommanderParameters, {})
