"""The bits of short flights are those of every machine on which they were flown (scripts/accept arm64)."""

import json

import pytest
from digests import FILE, SHORT, WHOLE, digest_of

pytestmark = pytest.mark.unit


@pytest.mark.parametrize("name", SHORT)
def test_a_flight_s_bits_are_those_of_other_machines(name):
    wanted = json.loads(FILE.read_text(encoding="utf-8"))
    assert set(wanted) == {*SHORT, *WHOLE}
    assert digest_of(SHORT[name]) == wanted[name], "meant? python test/digests.py --write, then scripts/accept arm64"
