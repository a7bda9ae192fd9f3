"""Every bench once, each as small as it can be asked for: it runs to its end. The figures are not judged."""

import subprocess
import sys
import time

from flying import ROOT

ROUNDS = {
    **{name: [f"run.py {name} --rounds 1"] for name in ("ros_loop", "batch", "laws", "guard_cost", "peers")},
    "against": [f"against.py {ROOT} --rounds 1"],
    "edit_and_fly": [f"edit_and_fly.py {ROOT} --rounds 1"],
    "law_ablation": ["law_ablation.py worth --seeds 1", "law_ablation.py smallest --seeds 1"],
    "law_as_printed": ["law_as_printed.py flights --seeds 1", "law_as_printed.py seconds --seeds 1"],
    "law_lemniscate": ["law_lemniscate.py --speed 5 --seeds 1"],
    "law_margins": ["law_margins.py table --pair aibs+abfnitsm", "law_margins.py linear --pair pid+pid"],
    "law_prediction": [f"law_prediction.py {what}" for what in ("ages", "methods", "noise")],
    "law_real": ["law_real.py paper --preset paper_real --seeds 1"],
    "law_stability": [f"law_stability.py {what} --seeds 1" for what in ("rates", "integral", "adaptation", "surface")],
    "nanodrone": ["nanodrone.py .cache/nanodrone"],
    "plant_step": ["plant_step.py 1"],
    "tuned_gains": ["tuned_gains.py 2"],
}
"""{bench: its smallest rounds}; those of ``run.py`` by their name there."""
PARTS = {"run", "relay", "peer_crazyflow", "peer_mujoco", "peer_nmpc", "peer_rotorpy", "peer_rotorpy_batched"}
"""Programs that benches start."""
NEEDS = {name: ROOT / ".cache" / name for name in ("peers", "nanodrone")}
"""What is made on demand and may take long: without it the bench is left out, by name."""
LONGEST = 900.0  # s


def programs():
    """Return the modules of bench/ that have a main() or a measure()."""
    texts = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "bench").glob("*.py")}
    return {name for name, text in texts.items() if "\ndef main(" in text or "\ndef measure(" in text}


def attempt(words):
    """Return the exit code, 124 if it took too long, and the last line that a round said."""
    command = ["timeout", f"{LONGEST:g}", sys.executable, *f"bench/{words}".split()]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    said = (done.stderr if done.returncode else done.stdout).strip().splitlines()
    return done.returncode, said[-1] if said else ""


def run(figures):
    unknown = sorted(programs() - set(ROUNDS) - PARTS)
    figures.check(not unknown, f"benches without a smallest round here: {', '.join(unknown) or 'none'}")
    for name, rounds in ROUNDS.items():
        for words in filter(figures.wants, rounds):
            if name in NEEDS and not NEEDS[name].is_dir():
                figures.show(f"{words}: left out, {NEEDS[name]} is not there")
                continue
            began = time.monotonic()
            code, last = attempt(words)
            figures.check(code == 0, f"{words}: exit code {code} after {time.monotonic() - began:.0f} s: {last[:150]}")
