"""Domains: no two flights share one unless both ask for it."""

from contextlib import ExitStack

import pytest

from quad_bringup import domains
from quad_bringup.domains import reserved_domain
from quad_core.parameters import ParameterError


@pytest.fixture(autouse=True)
def no_wish(monkeypatch):
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def test_flights_that_do_not_ask_get_domains_of_their_own():
    with reserved_domain(None) as one, reserved_domain(None) as two, reserved_domain(None) as three:
        assert len({one, two, three}) == 3
        assert {one, two, three} <= set(range(1, 102))


def test_a_domain_may_be_shared_by_flights_that_ask_for_it():
    with reserved_domain(7) as one, reserved_domain(7) as two:
        assert one == two == 7


def test_the_environment_s_domain_is_taken_unless_another_is_asked_for(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "150")
    with reserved_domain(None) as first, reserved_domain(None) as second, reserved_domain(7) as third:
        assert (first, second, third) == (150, 150, 7)


def test_a_domain_is_free_again_after_the_flight(monkeypatch):
    monkeypatch.setattr(domains, "_candidates", lambda: [151])
    for _ in range(2):
        with pytest.raises(OSError, match="of the flight"), reserved_domain(None) as found:
            assert found == 151
            raise OSError("an error of the flight itself")


def test_a_machine_without_a_free_domain_is_refused(monkeypatch):
    monkeypatch.setattr(domains, "_candidates", lambda: [152] * 200)
    with ExitStack() as held:
        held.enter_context(reserved_domain(None))
        with pytest.raises(ParameterError, match="every domain reserved"):
            held.enter_context(reserved_domain(None))


def test_domains_with_ports_of_others_come_last(tmp_path, monkeypatch):
    table = tmp_path / "udp"
    ports = [7400 + 250 * domain + 11 for domain in range(1, 101)]
    lines = [f"  12: 0100007F:{port:04X} 00000000:0000 07" for port in ports]
    table.write_text("\n".join(["  sl  local_address rem_address   st", *lines]) + "\n")
    monkeypatch.setattr(domains, "_UDP_SOCKETS", table)
    assert domains._candidates()[0] == 101
