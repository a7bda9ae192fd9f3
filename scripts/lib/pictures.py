"""Pictures of docs/images from three recorded flights: the paths in space, a film, and the report."""

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from headless_browser import Browser

from quad_flight_log.errors import FlightLogError
from quad_flight_log.reader import open_flight
from quad_report.figures import PALETTE, REFERENCE_COLOUR
from quad_report.flight_figures import Run, playback, run_from_flight
from quad_report.page import Page, report_page, write_page

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
TITLES = {"case1": "Case 1", "case2": "Case 2"}
LARGEST = 300_000  # bytes of a picture
COLOURS = 128
FRAMES = 72
LARGEST_FILM = 3_000_000  # bytes


def main() -> int:
    """Draw what was asked for."""
    parser = argparse.ArgumentParser(
        prog="scripts/pictures",
        description=__doc__,
        epilog="examples:\n  scripts/fly case1 --out flights/a && scripts/fly case2 --out flights/b\n"
        "  scripts/fly case2 --position pid --attitude pid --out flights/c\n"
        "  scripts/pictures flights/a flights/b flights/c\n\nFilm and report need Chromium.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    help_text = "a flight of case1, one of case2, and one of case2 by other laws"
    parser.add_argument("bags", nargs=3, type=Path, metavar="BAG", help=help_text)
    parser.add_argument("--only", choices=("paths", "film", "report"), help="one of the pictures")
    options = parser.parse_args()
    IMAGES.mkdir(parents=True, exist_ok=True)
    try:
        flights = [open_flight(bag) for bag in options.bags]
        runs = [run_from_flight(flight, flight.name) for flight in flights]
        if options.only in (None, "paths"):
            draw_paths(runs[:2], IMAGES / "flights.png")
        if options.only in (None, "film"):
            film(flights[1:], IMAGES / "case2.gif")
        if options.only in (None, "report"):
            shoot_report(flights[1], IMAGES / "report.png")
    except FlightLogError as error:
        print(f"scripts/pictures: {error}", file=sys.stderr)
        return 2
    return 0


def draw_paths(runs: list[Run], path: Path) -> None:
    """Draw the flown path and the reference of each run side by side."""
    import matplotlib as mpl
    import numpy as np
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    with mpl.rc_context({"font.size": 8.0, "grid.color": "#d9dde2", "grid.linewidth": 0.5}):
        canvas = Figure(figsize=(8.6, 4.6), layout="constrained")
        for place, run in enumerate(runs):
            ax = canvas.add_subplot(1, len(runs), place + 1, projection="3d")
            reference, flown = (run.tables[topic]["p_w"].T for topic in ("reference", "truth"))
            ax.plot(*reference, color=REFERENCE_COLOUR, linewidth=3.0, alpha=0.5, label="reference")
            ax.plot(*flown, color=PALETTE[0], linewidth=1.0, label="flown")
            ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
            ax.set_box_aspect(np.ptp(np.concatenate([flown, reference], axis=1), axis=1).clip(3.0), zoom=0.85)
            for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
                axis.set_major_locator(MaxNLocator(4))
            rmse = run.metrics.position_rmse or 0.0
            ax.set_title(f"{TITLES.get(run.trajectory, run.trajectory)}: RMSE {1000 * rmse:.1f} mm", y=1.02)
        canvas.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
        canvas.savefig(path, dpi=120)
    smaller(path)


def film(flights: list[Any], path: Path) -> None:
    """Take a film of the playback of Case 2, the other flight as its ghost."""
    import io

    from PIL import Image

    runs = [run_from_flight(flight, flight.name) for flight in flights]
    frames = []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page = write_page(Page("", "", (), playback(runs)), Path(folder, "page.html"))
        with Browser(Path(folder, "profile"), (760, 760)) as browser:
            browser.open(page.as_uri())
            browser.wait("document.body.dataset.drawn")
            box = browser.value(
                "(r => [r.left, r.top, r.right, r.bottom])(document.querySelector('.stage').getBoundingClientRect())"
            )
            for at in range(FRAMES):
                view = "flightViewers[0].look('follow')" if at == 0 else "0"
                move = f"Object.assign(v.camera, {{distance: 26, pitch: 0.35, yaw: {-2.4 + 0.02 * at}}})"
                shown = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
                browser.value(f"(v => {{ {view}; {move}; v.seek({0.5 * at}); return {shown}; }})(flightViewers[0])")
                picture = Image.open(io.BytesIO(browser.screenshot())).convert("RGB").crop(box)
                frames.append(picture.quantize(48, dither=Image.Dither.NONE))
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=100, loop=0, optimize=True)
    size = path.stat().st_size
    if size > LARGEST_FILM:
        raise FlightLogError(f"{path}: {size} bytes, expected at most {LARGEST_FILM}")
    print(f"{path.relative_to(ROOT)}: {size} bytes")


def shoot_report(flight: Any, path: Path) -> None:
    """Take a picture of the page that `log report` writes of Case 2."""
    with tempfile.TemporaryDirectory() as folder:
        page = write_page(report_page([flight], [TITLES["case2"]], "log report"), Path(folder, "page.html"))
        with Browser(Path(folder, "profile"), (1150, 1250)) as browser:
            browser.open(page.as_uri())
            browser.wait("document.body.dataset.drawn")
            browser.value("flightViewers[0].seek(30)")
            time.sleep(3.0)
            browser.screenshot(path)
    smaller(path)


def smaller(path: Path) -> None:
    """Write the picture again with few colours; raises FlightLogError if it stays too large."""
    from PIL import Image

    Image.open(path).convert("RGB").quantize(COLOURS).save(path, optimize=True)
    size = path.stat().st_size
    if size > LARGEST:
        raise FlightLogError(f"{path}: {size} bytes, expected at most {LARGEST}")
    print(f"{path.relative_to(ROOT)}: {size} bytes")


if __name__ == "__main__":
    sys.exit(main())
