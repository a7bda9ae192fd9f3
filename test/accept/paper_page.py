"""A page for a paper: figure and table of two flights in LaTeX; fonts embedded, width as asked; CSV in Octave.

Needs ``pdflatex``, ``pdffonts``, ``pdfinfo`` and ``octave`` (Debian: texlive-latex-base, poppler-utils, octave).
"""

import re
import shutil
import subprocess

from flying import ROOT
from flying import fly as fly_nodes

from quad_flight_log.reader import open_flight

NEEDED = ("pdflatex", "pdffonts", "pdfinfo", "octave")
WIDTH = 88.0  # mm
PAGE = r"""
\documentclass{article}
\usepackage{graphicx}
\begin{document}
\begin{figure}\includegraphics{error.pdf}\end{figure}
\begin{table}\input{table.tex}\end{table}
\end{document}
"""
OCTAVE = """
lines = fopen("flight.csv"); head = strsplit(fgetl(lines), ","); fclose(lines);
d = dlmread("flight.csv", ",", 1, 0);
printf("%.17g\\n", d(end, strcmp(head, "truth.p_w[2]")));
"""


def run(figures):
    for tool in NEEDED:
        if shutil.which(tool) is None:
            raise SystemExit(f"paper_page: found no {tool}, expected {', '.join(NEEDED)}")
    bags = [figures.folder / name for name in ("ours_1", "pid & co")]
    for bag, laws in zip(bags, ([], ["--position", "pid", "--attitude", "pid"]), strict=True):
        flown = fly_nodes("case2", "--duration", "5", "--limits", "position_rmse=5", *laws, "--out", bag)
        figures.check(flown.returncode == 0, f"flown: {bag.name}")
    said(figures, "scripts/log", "figure", *bags, "--out", figures.folder / "error.pdf", "--width", f"{WIDTH:g}mm")
    table = said(figures, "scripts/log", "metrics", *bags, "--latex")
    (figures.folder / "table.tex").write_text(table, encoding="utf-8")
    (figures.folder / "page.tex").write_text(PAGE, encoding="utf-8")
    told = said(figures, "pdflatex", "-interaction=nonstopmode", "-halt-on-error", "page.tex", cwd=figures.folder)
    figures.check("Overfull" not in told, "LaTeX compiles the page, nothing sticks out")
    size = re.search(r"Page size:\s+([\d.]+) x", said(figures, "pdfinfo", figures.folder / "error.pdf"))
    figures.at_most("width, off by", abs(float(size[1]) / 72.0 * 25.4 - WIDTH), 0.05, "mm")
    fonts = said(figures, "pdffonts", figures.folder / "error.pdf").splitlines()[2:]
    embedded = [line.split()[-5] for line in fonts]
    figures.check(embedded and set(embedded) == {"yes"}, f"fonts embedded: {len(embedded)} of {len(fonts)}")
    in_octave(figures, bags[0])


def in_octave(figures, bag):
    said(figures, "scripts/log", "export", bag, "--one-table", "--out", figures.folder)
    csv = next(figures.folder.glob("*.csv"))
    csv.rename(figures.folder / "flight.csv")
    words = said(figures, "octave", "--no-gui", "--quiet", "--eval", OCTAVE, cwd=figures.folder)
    last = open_flight(bag).array("truth")["p_w"][-1, 2]
    figures.check(float(words.split()[-1]) == last, f"Octave reads the last height to the bit: {words.split()[-1]}")


def said(figures, *words, cwd=ROOT):
    """Return what a command prints; one that fails is a failure of the run."""
    done = subprocess.run([*map(str, words)], cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        figures.check(False, f"{words[0]}: exit code {done.returncode}: {(done.stderr or done.stdout)[-300:]}")
    return done.stdout
