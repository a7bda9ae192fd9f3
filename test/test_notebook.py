"""The example notebook runs from top to bottom, and its flights show table and path."""

import ast
import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
pytestmark = pytest.mark.unit


def shown(code, names):
    """Run a cell and return the value of its last expression, None without one."""
    tree = ast.parse(code)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names) if last else None


def test_every_cell_runs_and_shows_what_it_says(tmp_path, monkeypatch, capsys):
    pytest.importorskip("plotly")
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    names = {}
    cells = json.loads((ROOT / "examples" / "notebook.ipynb").read_text())["cells"]
    values = [shown("".join(cell["source"]), names) for cell in cells if cell["cell_type"] == "code"]
    assert re.fullmatch(r"Result\(ended, \d+ of \d+ steps, RMSE [\d.e-]+ m, \{.*truth: \d+ rows.*\}\)", repr(values[0]))
    html = values[0]._repr_html_()
    assert "<td>ended</td>" in html
    assert f"{1e3 * names['flown'].rmse:.3g} mm" in html
    assert html.count("<polyline") == 4
    assert capsys.readouterr().out.endswith(" mm\n")
    assert {trace.name for trace in values[2].data} == {"aibs", "pid"}
    assert (tmp_path / "error.pdf").read_bytes().startswith(b"%PDF")
