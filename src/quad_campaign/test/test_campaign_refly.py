"""What --refly tells scripts/fly: the flight of that number, held to what the campaign calls a success."""

from quad_bringup import fly
from quad_campaign.campaign_cli import main

FILE = """
flight: {case: hover, duration: 0.1}
success: {rmse: 0.5, largest_error: 2.0}
seed: 5
vary:
  vehicle.mass: {uniform: [0.5, 0.6]}
"""


def test_a_flight_is_flown_again_under_the_campaign_s_own_limits(tmp_path, monkeypatch, capsys):
    path = tmp_path / "small.yaml"
    path.write_text(FILE, encoding="utf-8")
    passed = []
    monkeypatch.setattr(fly, "main", lambda words: passed.extend(words) or 1)
    assert main([str(path), "--refly", "3", "--out", str(tmp_path / "bag")]) == 1, "fly's own exit code"
    limits = [passed[index + 1] for index, word in enumerate(passed) if word == "--limits"]
    assert limits == ["position_rmse=0.5", "position_max=2"]
    assert passed[passed.index("--out") + 1] == str(tmp_path / "bag")
    assert capsys.readouterr().out.startswith("scripts/fly hover ")
