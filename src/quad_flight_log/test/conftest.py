"""A short flight, flown once per session by the loop without ROS and recorded by our writer."""

from pathlib import Path

import pytest
from loop_flight import FlownFlight, fly_short, write_flight


@pytest.fixture(scope="session")
def flown() -> FlownFlight:
    """Case 1 from the origin with its limits met, 1 s, and what its nodes would say of their parameters."""
    return fly_short()


@pytest.fixture(scope="session")
def flown_bag(flown, tmp_path_factory) -> Path:
    """The bag directory of ``flown``."""
    return write_flight(tmp_path_factory.mktemp("flown") / "flight", flown)
