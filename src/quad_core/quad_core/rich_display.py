"""What a notebook shows of a flight: its path from above and from the side, and a table."""

from collections.abc import Mapping
from html import escape

import numpy as np
from numpy.typing import NDArray

Path = NDArray[np.float64]
_SIZE, _EDGE = 260, 14  # pixels of a view and around it
_POINTS = 400  # of a line


def flight_html(rows: Mapping[str, str], flown: Path, reference: Path) -> str:
    """Return HTML of ``rows`` as a table, and of paths (n, 3) in m, the reference grey and broad below the flown."""
    cells = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows.items())
    paths = [path[np.isfinite(path).all(axis=1)] for path in (reference, flown)]
    views = ((0, 1, "from above: x, y"), (0, 2, "from the side: x, z")) if any(map(len, paths)) else ()
    drawn = "".join(_view(paths, *view) for view in views)
    return f'<div style="display:flex;flex-wrap:wrap;gap:1em"><table>{cells}</table>{drawn}</div>'


def _view(paths: list[Path], across: int, up: int, title: str) -> str:
    """Return SVG of two axes of paths, at one scale."""
    both = np.concatenate(paths)[:, [across, up]]
    low, extent = both.min(axis=0), max(float(np.ptp(both, axis=0).max()), 1e-3)
    offset = 0.5 * (extent - np.ptp(both, axis=0))
    lines = []
    for path, style in zip(paths, ('stroke="#7f8994" stroke-width="4" opacity="0.5"', 'stroke="#1f83c8"'), strict=True):
        chosen = path[np.linspace(0, len(path) - 1, min(len(path), _POINTS)).astype(int)] if len(path) else path
        x, y = (_EDGE + _SIZE * (chosen[:, [across, up]] - low + offset) / extent).T
        points = " ".join(f"{a:.1f},{2 * _EDGE + _SIZE - b:.1f}" for a, b in zip(x, y, strict=True))
        lines.append(f'<polyline fill="none" {style} points="{points}"/>')
    wide = _SIZE + 2 * _EDGE
    label = f'<text x="4" y="12" font-size="11" fill="#7f8994">{title}, {extent:.3g} m wide</text>'
    return f'<svg width="{wide}" height="{wide}" viewBox="0 0 {wide} {wide}">{label}{"".join(lines)}</svg>'
