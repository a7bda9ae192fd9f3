"""The line drawings of docs/images as SVG: packages, nodes, frames, rotors, a step in both clocks, modes, a bag.

Each picture has its colours for a light and a dark page in itself, so it reads on the site and on a Git host.
"""

import ast
import math
from collections.abc import Callable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STYLE = """<style>
text{font:16px system-ui,"Segoe UI",Helvetica,Arial,sans-serif;fill:#1f2328}
.small{font-size:13px}.bold{font-weight:600}.mid{text-anchor:middle}.end{text-anchor:end}
.over{paint-order:stroke;stroke:#fff;stroke-width:6px;stroke-linejoin:round}
.box{fill:#f6f8fa;stroke:#59636e}.main{fill:#ddf4ff;stroke:#0969da}.note{fill:#fff8c5;stroke:#9a6700}
.line{stroke:#59636e;fill:none;stroke-width:1.4}.blue{stroke:#0969da;fill:none;stroke-width:2}
.red{stroke:#cf222e;fill:none;stroke-width:2}.green{stroke:#1a7f37;fill:none;stroke-width:2}.dash{stroke-dasharray:5 4}
.tip{fill:#59636e;stroke:none}.tblue{fill:#0969da}.tred{fill:#cf222e}.tgreen{fill:#1a7f37}
@media (prefers-color-scheme:dark){text{fill:#f0f6fc}.over{stroke:#0d1117}
.box{fill:#212830;stroke:#9198a1}.main{fill:#0c2d5e;stroke:#4493f8}
.note{fill:#3a2d06;stroke:#d29922}.line{stroke:#9198a1}.blue{stroke:#4493f8}.red{stroke:#f85149}.green{stroke:#3fb950}
.tip{fill:#9198a1}.tblue{fill:#4493f8}.tred{fill:#f85149}.tgreen{fill:#3fb950}}
</style>"""
TIPS = {"line": "tip", "line dash": "tip", "blue": "tblue", "red": "tred", "green": "tgreen"}


class Drawing:
    """A picture that grows line by line; lengths in pixels, y downwards."""

    def __init__(self, width: float, height: float, title: str) -> None:
        """Begin an empty picture; ``title`` is read aloud by screen readers."""
        self.lines = [
            '<svg xmlns="http://www.w3.org/2000/svg" role="img" '  # noqa: ISC004
            f'viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}">',
            f"<title>{title}</title>",
            STYLE,
        ]

    def add(self, line: str) -> None:
        """Add one element as it is."""
        self.lines.append(line)

    def text(self, x: float, y: float, words: str, kind: str = "mid") -> None:
        """Write ``words``; ``kind`` are classes of the style."""
        words = words.replace("&", "&amp;").replace("<", "&lt;")
        self.add(f'<text x="{x:g}" y="{y:g}" class="{kind}">{words}</text>')

    def box(self, x: float, y: float, width: float, height: float, words: Sequence[str], kind: str = "box") -> None:
        """Draw a box with centred lines of text."""
        self.add(f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="6" class="{kind}"/>')
        first = y + height / 2 + 5 - 8.5 * (len(words) - 1)
        for number, line in enumerate(words):
            self.text(x + width / 2, first + 17 * number, line, "mid bold" if number == 0 else "mid small")

    def arrow(self, points: Sequence[tuple[float, float]], kind: str = "line") -> None:
        """Draw a line through ``points`` with a tip at its end."""
        path = " ".join(f"{x:g},{y:g}" for x, y in points)
        self.add(f'<polyline points="{path}" class="{kind}"/>')
        (x0, y0), (x1, y1) = points[-2], points[-1]
        turn = math.atan2(y1 - y0, x1 - x0)
        corners = [(x1, y1)] + [(x1 - 9 * math.cos(turn + a), y1 - 9 * math.sin(turn + a)) for a in (0.4, -0.4)]
        self.add(f'<polygon points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in corners)}" class="{TIPS[kind]}"/>')

    def done(self) -> str:
        """Return the picture."""
        return "\n".join([*self.lines, "</svg>", ""])


def imports_of(package: str) -> set[str]:
    """Return the packages of this repository that the sources of ``package`` import."""
    found: set[str] = set()
    for path in ROOT.glob(f"src/{package}/{package}/**/*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            found |= {name.partition(".")[0] for name in names if name.startswith("quad_")}
    return found - {package}


def packages() -> str:
    """Return the packages in rows; each imports from rows below it only."""
    names = sorted(path.name for path in ROOT.glob("src/quad_*"))
    needs = {name: imports_of(name) & set(names) for name in names}
    row: dict[str, int] = {}

    def height(name: str, above: tuple[str, ...] = ()) -> int:
        if name not in row and name not in above:
            row[name] = 1 + max((height(other, (*above, name)) for other in needs[name]), default=-1)
        return row.get(name, 0)

    for name in names:
        height(name)
    levels: list[list[str]] = []
    for height_of_row in range(max(row.values()), -1, -1):
        same = [name for name in names if row[name] == height_of_row]
        levels += [same[first : first + 4] for first in range(0, len(same), 4)]
    drawing = Drawing(860, 58 * len(levels) + 40, "The packages in rows; each imports from rows below it")
    for number, level in enumerate(levels):
        for place, name in enumerate(level):
            kind = "main" if name in ("quad_core", "quad_flight", "quad_position_ctrl", "quad_attitude_ctrl") else "box"
            left = 430 + 210 * (place - len(level) / 2) + 5
            drawing.box(left, 58 * number + 10, 200, 40, [name], kind)
    drawing.text(430, 58 * len(levels) + 28, "A package imports only from rows below its own.", "mid small")
    return drawing.done()


def nodes() -> str:
    """Return the nodes of a flight and their topics."""
    drawing = Drawing(860, 330, "The nodes of a flight and the topics between them")
    boxes = (["trajectory", "100 Hz"], ["position_controller", "100 Hz"], ["attitude_controller", "500 Hz"])
    for place, words in enumerate((*boxes, ["simulator", "or your vehicle, 500 Hz"])):
        x = 2 + 220 * place
        drawing.box(x, 90, 186, 54, words, "main")
    for x, signal in ((205, "reference"), (425, "setpoint"), (645, "wrench")):
        drawing.arrow([(x - 16, 117), (x + 16, 117)], "blue")
        drawing.text(x, 84, signal, "mid small")
    drawing.arrow([(755, 90), (755, 40), (95, 40), (95, 90)], "green")
    for x in (315, 535):
        drawing.arrow([(x, 40), (x, 90)], "green")
    drawing.text(430, 30, "state and actuation, at every step", "mid small")
    drawing.box(340, 240, 180, 54, ["recorder", "one MCAP bag"])
    for x in (95, 315, 535, 755):
        drawing.arrow([(x, 144), (x, 200), (430 + (x - 430) / 8, 240)], "line dash")
    drawing.box(10, 240, 210, 54, ["commander", "with --mission: modes, landing"])
    drawing.box(640, 240, 210, 54, ["shadow controllers", "optional: recorded, not used"])
    drawing.text(430, 318, "Every topic goes to the recorder; in lockstep the simulator waits for it.", "mid small")
    return drawing.done()


def axes(drawing: Drawing, x: float, y: float, named: Sequence[tuple[str, float, float, str]]) -> None:
    """Draw axes from (x, y): name, direction in pixels, colour."""
    for name, right, down, kind in named:
        drawing.arrow([(x, y), (x + right, y + down)], kind)
        away = 26 / math.hypot(right, down)
        drawing.text(x + right * (1 + away * 1.3), y + down * (1 + away * 0.7) + 5, name, "mid small")


def frames() -> str:
    """Return world and body axes of this stack and of PX4."""
    drawing = Drawing(860, 330, "World and body frames: ENU and FLU here, NED and FRD in PX4")
    for x, title, world, body in (
        (215, "this stack: ENU world, FLU body",
         (("x east", 60, 0, "red"), ("y north", 45, -45, "green"), ("z up", 0, -90, "blue")),
         (("x forward", 60, -50, "red"), ("y left", -60, -9, "green"), ("z up", 0, -85, "blue"))),
        (645, "PX4: NED world, FRD body",
         (("x north", 45, -45, "red"), ("y east", 60, 0, "green"), ("z down", 0, 90, "blue")),
         (("x forward", 60, -50, "red"), ("y right", 60, 9, "green"), ("z down", 0, 85, "blue"))),
    ):  # fmt: skip
        drawing.text(x, 24, title, "mid bold")
        axes(drawing, x - 150, 170, world)
        drawing.text(x - 110, 312, "world", "mid bold")
        axes(drawing, x + 90, 170, body)
        drawing.add(f'<path d="M {x + 50} 185 L {x + 150} 130 M {x + 60} 135 L {x + 135} 185" class="line dash"/>')
        drawing.text(x + 90, 312, "body", "mid bold")
    drawing.add('<path d="M 430 10 L 430 320" class="line dash"/>')
    return drawing.done()


def rotors() -> str:
    """Return rotor numbers and spin, seen from above, nose up."""
    drawing = Drawing(860, 330, "Rotor numbers and spin of layouts plus and x, and of PX4")
    plus = ((1, 0, 1, True), (2, 1, 0, False), (3, 0, -1, True), (4, -1, 0, False))
    cross = ((1, 0.75, 0.75, True), (2, 0.75, -0.75, False), (3, -0.75, -0.75, True), (4, -0.75, 0.75, False))
    px4 = ((0, 0.75, -0.75, False), (1, -0.75, 0.75, False), (2, -0.75, -0.75, True), (3, 0.75, 0.75, True))
    for x, title, places in ((145, "layout plus", plus), (430, "layout x", cross), (715, "PX4, CA_ROTORn", px4)):
        drawing.text(x, 24, title, "mid bold")
        y, arm = 180, 88
        for number, right, down, clockwise in places:
            px, py = x + arm * right, y + arm * down
            drawing.add(f'<path d="M {x} {y} L {px:g} {py:g}" class="line"/>')
            drawing.add(f'<circle cx="{px:g}" cy="{py:g}" r="30" class="box"/>')
            side = 1 if clockwise else -1
            kind = "blue" if clockwise else "red"
            turns = [side * a for a in (-2.0, -1.4, -0.8, -0.2, 0.4, 1.0, 1.5)]
            bend = [(px + 23 * math.sin(a), py - 23 * math.cos(a)) for a in turns]
            drawing.arrow(bend, kind)
            drawing.text(px, py + 5, str(number), "mid bold")
        drawing.arrow([(x, y - 14), (x, y - 46)], "green")
    drawing.text(430, 318, "Seen from above, nose up. Blue: clockwise. Red: counter-clockwise.", "mid small")
    return drawing.done()


def sequence(title: str, actors: Sequence[str], steps: Sequence[tuple[int, int, str]]) -> str:
    """Return a sequence diagram; a step is (from, to, words); from == to is a note at that actor."""
    gap, top = 860 / len(actors), 70
    drawing = Drawing(860, top + 38 * len(steps) + 30, title)
    middle = [gap * (place + 0.5) for place in range(len(actors))]
    for x, name in zip(middle, actors, strict=True):
        drawing.box(x - gap / 2 + 6, 10, gap - 12, 36, [name], "main")
        drawing.add(f'<path d="M {x:g} 46 L {x:g} {top + 38 * len(steps) + 10:g}" class="line dash"/>')
    for number, (start, goal, words) in enumerate(steps):
        y = top + 38 * number + 14
        if start == goal:
            width = 7.2 * len(words) + 16
            x = min(max(middle[start] - width / 2, 4), 856 - width)
            drawing.add(f'<rect x="{x:g}" y="{y - 18:g}" width="{width:g}" height="26" rx="4" class="note"/>')
            drawing.text(x + width / 2, y, words, "mid small")
        else:
            drawing.text((middle[start] + middle[goal]) / 2, y - 6, words, "mid small over")
            drawing.arrow([(middle[start], y), (middle[goal], y)], "blue")
    return drawing.done()


def step_lockstep() -> str:
    """Return one step in lockstep."""
    actors = ("simulator", "trajectory", "position law", "attitude law", "recorder")
    steps = (
        (0, 3, "state[k], actuation[k-1] to all three"),
        (1, 2, "reference[k], every 5th step"),
        (2, 3, "attitude_setpoint[k], every 5th step"),
        (3, 0, "wrench_setpoint[k]"),
        (0, 0, "waits for exactly this stamp, then integrates 2 ms"),
        (0, 4, "truth[k], disturbance[k]"),
        (4, 0, "flight/recorded: at most simulator.window steps behind"),
        (0, 3, "state[k+1]"),
    )
    return sequence("One step in lockstep: the simulator owns time", actors, steps)


def step_realtime() -> str:
    """Return one step in real time."""
    actors = ("clock", "simulator", "trajectory", "position law", "attitude law")
    steps = (
        (0, 1, "period begins"),
        (1, 4, "state[k] to all three"),
        (4, 1, "wrench_setpoint[k], with the setpoint at hand"),
        (2, 3, "reference[k]"),
        (3, 4, "attitude_setpoint[k]: used from step k+1 on"),
        (0, 1, "next period: newest wrench acts"),
        (1, 1, "guard: no good wrench for 50 ms: land"),
    )
    return sequence("One step in real time: the clock owns time", actors, steps)


def modes() -> str:
    """Return the modes with what leads from one to the next."""
    drawing = Drawing(860, 330, "Modes of a flight with a commander")
    place = {"DISARMED": (10, 60), "ARMING": (185, 60), "TAKEOFF": (360, 60), "HOLD": (535, 60), "MISSION": (710, 60),
             "LAND": (535, 180), "DESCEND": (360, 180), "PILOT": (185, 180), "KILL": (10, 180)}  # fmt: skip
    for name, (x, y) in place.items():
        drawing.box(x, y, 130, 40, [name], "main" if y == 60 else "box")
    for x, words in ((140, "arm"), (315, "ready"), (490, "height"), (665, "mission")):
        drawing.arrow([(x, 74), (x + 45, 74)], "blue")
        drawing.text(x + 22, 50, words, "mid small")
    drawing.arrow([(710, 90), (665, 90)], "line")
    drawing.text(687, 116, "end", "mid small")
    drawing.arrow([(600, 100), (600, 180)], "line")
    drawing.text(640, 146, "land", "mid small")
    drawing.arrow([(535, 200), (490, 200)], "red")
    drawing.arrow([(560, 220), (560, 264), (5, 264), (5, 80), (10, 80)], "line")
    drawing.arrow([(400, 220), (400, 264)], "line")
    drawing.text(200, 256, "contact with the ground: DISARMED", "mid small")
    faults = "A fault leads to a more severe mode: HOLD, LAND, DESCEND, PILOT, KILL. Only a request leads back."
    drawing.text(430, 296, faults, "mid small")
    drawing.text(
        430, 318, "DESCEND: the guard flies. PILOT: another controls the vehicle. KILL: motors off.", "mid small"
    )
    return drawing.done()


def bag() -> str:
    """Return what a bag holds."""
    drawing = Drawing(860, 250, "What a bag holds")
    drawing.add('<rect x="10" y="34" width="840" height="206" rx="8" class="line"/>')
    drawing.text(20, 24, "flights/case2-1-1/", "bold")
    drawing.box(30, 60, 500, 160, [""], "main")
    drawing.text(280, 82, "case2-1-1_0.mcap", "mid bold")
    for number, (name, detail) in enumerate((
        ("step topics", "one message per step: hashed"), ("flight topics", "plan, state, guard, events"),
        ("parameters", "what each node resolved"), ("record", "command, seed, commit"),
    )):  # fmt: skip
        drawing.box(46 + 240 * (number % 2), 98 + 58 * (number // 2), 228, 48, [name, detail])
    files = (("metadata.yaml", "rosbag2 reads it"), ("report.html", "by log report"), ("logs/", "what nodes printed"))
    for number, (name, detail) in enumerate(files):
        drawing.box(560, 60 + 56 * number, 270, 46, [name, detail])
    return drawing.done()


PICTURES: dict[str, Callable[[], str]] = {
    "packages": packages, "nodes": nodes, "frames": frames, "rotors": rotors, "step_lockstep": step_lockstep,
    "step_realtime": step_realtime, "modes": modes, "bag": bag,
}  # fmt: skip


def pictures() -> dict[str, str]:
    """Return {file name in docs/images: SVG}."""
    return {f"{name}.svg": draw() for name, draw in PICTURES.items()}
