"""Logs of others, 60 of them damaged: each is imported and identified or ends in one line, in time and memory.

The damaged ones are made of the excerpts in the project and of a simulated flight. QUAD_ACCEPT_LOGS names a folder of
whole logs, each of which must be imported too.
"""

import contextlib
import gzip
import io
import os
import signal
import traceback
from pathlib import Path

import numpy as np
import pandas
from flying import ROOT
from simulated import Manoeuvre, Truth, flown

from quad_identify import cli as identify_cli
from quad_report import cli as log_cli

EXCERPTS = ROOT / "src/quad_log_import/test/data"
LONGEST, LARGEST = 60, 1000.0  # s of processor time; MB
COLUMNS = {
    "specific_force": ["ax", "ay", "az"],
    "body_rates": ["gx", "gy", "gz"],
    "attitude": ["qx", "qy", "qz", "qw"],
    "velocity": ["vx", "vy", "vz"],
    "motors": ["m1", "m2", "m3", "m4"],
    "voltage": ["battery"],
}
MAP = "rotors: x\ntime: {column: t}\nsignals:\n" + "".join(
    f"  {name}: {{columns: [{', '.join(columns)}]}}\n" for name, columns in COLUMNS.items()
)


def run(figures):
    folder = figures.folder
    chart = folder / "map.yaml"
    chart.write_text(MAP)
    made, worst, refused = [*broken_bytes(folder), *broken_tables(folder)], (0.0, 0.0), 0
    whole = Path(os.environ.get("QUAD_ACCEPT_LOGS", "nowhere"))
    of_others = [path for path in sorted(whole.rglob("*")) if path.is_file() and path.suffix not in (".md", ".txt", "")]
    of_others += [path for path in sorted(whole.rglob("*log[0-9]*")) if path.suffix == ""]
    for number, path in enumerate([*made, *(path for path in of_others if path.suffix != ".yaml")]):
        shipped = "nanobench" if path in of_others else chart
        options = ["--map", shipped] if {".csv", ".parquet"} & set(path.suffixes) else []
        for main, words in (
            (log_cli.main, ["import", path, *options, "--out", folder / f"bag{number}"]),
            (identify_cli.main, [path, *options, "--mass", "0.5", "--arms", "0.13"]),
        ):
            code, said, seconds, memory = ended(main, words, folder / "said")
            worst = max(worst[0], seconds), max(worst[1], memory)
            refused += code == 2
            good = (code in (0, 1) and "Traceback" not in said) or (code == 2 and said.count("\n") == 1)
            if not good or (path in of_others and words[0] == "import" and code):
                figures.check(False, f"{path.name}: {main.__module__}: exit code {code}: {said[-300:]}")
    total = f"{len(made)} damaged logs and {number + 1 - len(made)} whole ones, imported and identified"
    figures.check(len(made) >= 60, f"{total}: {refused} of {2 * number + 2} refused in one line")
    figures.at_most("the longest, processor time", worst[0], LONGEST, "s")
    figures.at_most("the largest", worst[1], LARGEST, "MB")


def ended(main, words, said):
    """Return exit code, standard error, s of processor time and MB of memory of a command in a process of its own."""
    child = os.fork()
    if not child:
        code = 9
        signal.alarm(10 * LONGEST)
        with said.open("w") as stream, contextlib.redirect_stderr(stream), contextlib.redirect_stdout(io.StringIO()):
            try:
                code = main([str(word) for word in words])
            except BaseException:
                traceback.print_exc()
        os._exit(code)
    _, status, used = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), said.read_text(), used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def made_flight():
    """Return the table of a simulated flight at 250 Hz."""
    signals = flown(Truth(), Manoeuvre(20.0))
    table = {"t": signals["t"][::4]}
    for name, columns in COLUMNS.items():
        table |= dict(zip(columns, signals[name].reshape(len(signals["t"]), -1)[::4].T, strict=True))
    return pandas.DataFrame(table)


def broken_bytes(folder):
    """Yield files whose bytes are damaged, seven of each of six kinds."""
    whole = folder / "whole.csv"
    made_flight().to_csv(whole, index=False)
    made_flight().to_parquet(folder / "whole.parquet")
    words = ["import", whole, "--map", folder / "map.yaml", "--out", folder / "bag"]
    assert ended(log_cli.main, words, folder / "said")[0] < 2
    (bag,) = (folder / "bag").glob("*.mcap")
    sources = {
        "log.usd": gzip.decompress((EXCERPTS / "crazyflie.usd.gz").read_bytes()),
        "log.ulg": gzip.decompress((EXCERPTS / "px4.ulg.gz").read_bytes()),
        "log.csv": whole.read_bytes(),
        "log.csv.gz": gzip.compress(whole.read_bytes()),
        "log.parquet": (folder / "whole.parquet").read_bytes(),
        "log.mcap": bag.read_bytes(),
    }
    for name, content in sources.items():
        for seed in range(7):
            rng, data = np.random.default_rng(seed), bytearray(content)
            if seed == 0:
                del data[len(data) // 3 :]
            elif seed == 1:
                data[1:9] = b"\xff" * 8  # another version, and a count of all ones
            elif seed == 2:
                data[40:400] = b"\xff" * 360  # counts and lengths of all ones
            else:
                for at in rng.integers(0, min(2000 if seed % 2 else len(data), len(data)), 2 + seed):
                    data[int(at)] ^= 1 << int(rng.integers(0, 8))
            path = folder / f"{seed}{name}"
            path.write_bytes(data)
            yield path


def broken_tables(folder):
    """Yield tables whose numbers are damaged."""
    table, motors = made_flight(), COLUMNS["motors"]
    rows, t = np.arange(len(table)), table["t"]
    changes = {
        "NaN in every column": table.where(np.repeat(rows[:, None] % 7 != 0, table.shape[1], axis=1)),
        "NaN in the rates": table.assign(gx=np.nan),
        "infinite force": table.assign(az=np.inf),
        "constant motors": table.assign(**dict.fromkeys(motors, 0.5)),
        "motors at rest": table.assign(**dict.fromkeys(motors, 0.0)),
        "motors in microseconds": table.assign(**{name: 1000.0 + 1000.0 * table[name] for name in motors}),
        "motor spikes": table.assign(m1=np.where(rows == 1000, 6e6, table["m1"])),
        "no motors": table.drop(columns=motors),
        "no gyro": table.drop(columns=COLUMNS["body_rates"]),
        "no force": table.drop(columns=COLUMNS["specific_force"]),
        "no time": table.drop(columns="t"),
        "time that stands": table.assign(t=0.0),
        "time that goes back": table.assign(t=-t),
        "time in ns": table.assign(t=1e9 * t),
        "a gap of an hour": table.assign(t=t + 3600.0 * (t > 10.0)),
        "no quaternion": table.assign(**dict.fromkeys(COLUMNS["attitude"], 0.0)),
        "10 Hz": table[::25],
        "three rows": table[:3],
    }
    for name, changed in changes.items():
        path = folder / f"{name}.csv"
        changed.to_csv(path, index=False)
        yield path
