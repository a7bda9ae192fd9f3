"""What is run or locked lies where only we can change it; the cache of compiled code is such a folder."""

import os
import stat

import pytest

from quad_core.ownership import NotOursError, private_folder


@pytest.fixture
def own(tmp_path):
    tmp_path.chmod(0o700)
    return tmp_path


def test_a_folder_is_made_for_us_alone(own):
    made = private_folder(own / "a" / "b")
    assert stat.S_IMODE(made.stat().st_mode) == 0o700
    assert private_folder(own / "a" / "b") == made


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o757, 0o1777])
def test_a_folder_that_others_write_is_refused(own, mode):
    (own / "cache").mkdir()
    (own / "cache").chmod(mode)
    with pytest.raises(NotOursError, match=f"cache: found mode {mode:04o}, expected"):
        private_folder(own / "cache")


def test_a_folder_below_one_that_all_write_is_refused_and_not_made(own):
    (own / "open").mkdir()
    (own / "open").chmod(0o777)
    with pytest.raises(NotOursError, match="others cannot replace ours"):
        private_folder(own / "open" / "cache")
    assert list((own / "open").iterdir()) == []


def test_a_sticky_folder_may_hold_ours(own):
    (own / "tmp").mkdir()
    (own / "tmp").chmod(0o1777)
    assert private_folder(own / "tmp" / "cache").is_dir()


def test_a_link_leads_to_the_checks_of_what_it_names(own):
    (own / "there").mkdir()
    (own / "there").chmod(0o777)
    (own / "here").symlink_to(own / "there")
    with pytest.raises(NotOursError, match="there"):
        private_folder(own / "here")


def test_a_folder_of_another_user_is_refused(own, monkeypatch):
    (own / "cache").mkdir(mode=0o755)
    other = os.geteuid() + 1
    if own.stat().st_uid == 0:
        os.chown(own / "cache", other, -1)
    else:  # only root can give folders away: be another user instead
        monkeypatch.setattr(os, "geteuid", lambda: other)
    with pytest.raises(NotOursError, match="user"):
        private_folder(own / "cache")
