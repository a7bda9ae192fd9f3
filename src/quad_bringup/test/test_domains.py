"""Domains: no two flights share one unless both ask for it."""

import os
import stat

import pytest

from quad_bringup import domains
from quad_bringup.domains import reserved_domain
from quad_core.parameters import ParameterError


@pytest.fixture(autouse=True)
def own_locks(tmp_path, monkeypatch):
    """Locks where no real flight looks for them."""
    monkeypatch.setattr(domains.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(domains, "_RUNTIME", tmp_path / "run")
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def test_flights_that_do_not_ask_get_domains_of_their_own():
    with reserved_domain(None) as one, reserved_domain(None) as two, reserved_domain(None) as three:
        assert len({one, two, three}) == 3
        assert {one, two, three} <= set(range(1, 102))


def test_a_domain_may_be_shared_by_those_who_ask_for_it_only():
    with reserved_domain(7) as one, reserved_domain(7) as two:
        assert one == two == 7
    with reserved_domain(None) as reserved, pytest.raises(ParameterError, match=f"domain {reserved} is reserved"):
        reserved_domain(reserved).__enter__()


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


@pytest.mark.parametrize("asked", [-1, 233])
def test_a_bad_wanted_domain_is_refused(asked):
    with pytest.raises(ParameterError, match=f"found {asked}, expected 0 to 232"):
        reserved_domain(asked).__enter__()


def test_a_domain_is_free_again_after_the_flight():
    with reserved_domain(None) as reserved:
        pass
    with reserved_domain(reserved) as again:
        assert again == reserved


def test_domains_with_ports_of_others_come_last(tmp_path, monkeypatch):
    table = tmp_path / "udp"
    ports = [7400 + 250 * domain + 11 for domain in range(1, 101)]
    lines = [f"  12: 0100007F:{port:04X} 00000000:0000 07" for port in ports]
    table.write_text("\n".join(["  sl  local_address rem_address   st", *lines]) + "\n")
    monkeypatch.setattr(domains, "_UDP_SOCKETS", table)
    with reserved_domain(None) as found:
        assert found == 101


def lock_folder(top):
    return top / f"quad-{os.geteuid()}"


def test_locks_lie_in_a_folder_of_the_user_alone(tmp_path):
    with reserved_domain(7):
        assert stat.S_IMODE(lock_folder(tmp_path).stat().st_mode) == 0o700
        assert [path.name for path in lock_folder(tmp_path).iterdir()] == ["domain-7.lock"]


def test_the_session_s_folder_is_taken_where_there_is_one(tmp_path):
    session = tmp_path / "run" / str(os.geteuid())
    session.mkdir(parents=True)
    with reserved_domain(7):
        assert (session / "quad" / "domain-7.lock").is_file()


def test_a_lock_follows_no_link(tmp_path):
    lock_folder(tmp_path).mkdir(mode=0o700)
    (lock_folder(tmp_path) / "domain-7.lock").symlink_to(tmp_path / "made-for-somebody-else")
    with pytest.raises(OSError, match=r"domain-7\.lock"):
        reserved_domain(7).__enter__()
    assert not (tmp_path / "made-for-somebody-else").exists()


def test_a_lock_folder_that_others_write_is_refused(tmp_path):
    lock_folder(tmp_path).mkdir()
    lock_folder(tmp_path).chmod(0o777)
    with pytest.raises(OSError, match="found mode 0777"):
        reserved_domain(7).__enter__()
