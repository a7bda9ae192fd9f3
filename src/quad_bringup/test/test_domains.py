"""Domains: no two flights share one unless both ask for it."""

import pytest

from quad_bringup import domains
from quad_bringup.domains import reserved_domain
from quad_core.parameters import ParameterError


@pytest.fixture(autouse=True)
def own_locks(tmp_path, monkeypatch):
    """Locks where no real flight looks for them."""
    monkeypatch.setattr(domains.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def test_flights_that_do_not_ask_get_domains_of_their_own():
    with reserved_domain(None) as one, reserved_domain(None) as two, reserved_domain(None) as three:
        assert len({one, two, three}) == 3
        assert {one, two, three} <= set(range(1, 102))


def test_a_domain_may_be_shared_by_those_who_ask_for_it_only():
    with reserved_domain(7) as one, reserved_domain(7) as two:
        assert one == two == 7
    with reserved_domain(None) as held, pytest.raises(ParameterError, match=f"domain {held} is held"):
        reserved_domain(held).__enter__()


def test_the_environment_s_domain_is_taken_if_it_is_free(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "150")
    with reserved_domain(None) as first, reserved_domain(None) as second:
        assert first == 150
        assert second != 150


@pytest.mark.parametrize("text", ["many", "233", "-1"])
def test_a_bad_domain_in_the_environment_is_refused(monkeypatch, text):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(ParameterError, match="ROS_DOMAIN_ID"):
        reserved_domain(None).__enter__()


@pytest.mark.parametrize("wanted", [-1, 233])
def test_a_bad_wanted_domain_is_refused(wanted):
    with pytest.raises(ParameterError, match=f"found {wanted}, expected 0 to 232"):
        reserved_domain(wanted).__enter__()


def test_a_domain_is_free_again_after_the_flight():
    with reserved_domain(None) as held:
        pass
    with reserved_domain(held) as again:
        assert again == held


def test_domains_with_ports_in_shared_memory_come_last(tmp_path, monkeypatch):
    for domain in range(1, 101):
        (tmp_path / f"fastrtps_port{7400 + 250 * domain + 11}").touch()
    monkeypatch.setattr(domains, "_SHARED_MEMORY", tmp_path)
    with reserved_domain(None) as found:
        assert found == 101
