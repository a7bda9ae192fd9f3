"""The directory of a campaign: parts that appear whole or not at all, so that a killed campaign can go on."""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from quad_core.parameters import ParameterError

ABOUT = "campaign.json"
FLIGHTS = "flights.parquet"


class Parts:
    """Parts of ``size`` flights each in ``directory/parts``; part i holds flights i * size to (i + 1) * size - 1."""

    def __init__(self, directory: Path, flights: int, size: int) -> None:
        self.directory, self.flights, self.size = directory, flights, size

    def open(self, about: dict[str, Any], resume: bool) -> None:
        """Make the directory, or check that it holds the same campaign; raises ParameterError if it does not."""
        path = self.directory / ABOUT
        if not resume and self.directory.exists() and any(self.directory.iterdir()):
            raise ParameterError(f"--out: {self.directory} exists; go on with --resume or choose another directory")
        if resume and path.exists():
            try:
                before = dict(json.loads(path.read_text("utf-8"))["identity"])
            except (ValueError, KeyError, TypeError) as error:
                raise ParameterError(f"--resume: {path}: found no identity of a campaign ({error!r})") from error
            for key, value in about["identity"].items():
                if before.get(key) != value:
                    found = f"found {key} {value!r}, expected {before.get(key)!r} as it was begun with"
                    raise ParameterError(f"--resume: {path}: {found}")
            return
        (self.directory / "parts").mkdir(parents=True, exist_ok=True)
        temporary = path.with_suffix(".tmp")
        temporary.write_text(json.dumps(about, indent=2), "utf-8")
        temporary.replace(path)

    def missing(self) -> list[int]:
        """Return the numbers of the parts that are not there."""
        return [part for part in range(-(-self.flights // self.size)) if not self._path(part).exists()]

    def numbers(self, part: int) -> range:
        """Return the numbers of the flights of a part."""
        return range(part * self.size, min((part + 1) * self.size, self.flights))

    def write(self, part: int, rows: Sequence[dict[str, Any]]) -> None:
        """Store a part."""
        path = self._path(part)
        temporary = path.with_suffix(f".{os.getpid()}.tmp")
        pd.DataFrame(rows).to_parquet(temporary, index=False)
        temporary.replace(path)

    def joined(self) -> pd.DataFrame:
        """Return all flights in order, and store them as one file; raises ValueError if one is missing or twice."""
        frame = pd.concat([pd.read_parquet(self._path(part)) for part in range(-(-self.flights // self.size))])
        if list(frame["flight"]) != list(range(self.flights)):
            raise ValueError(f"{self.directory}: the parts do not hold each of {self.flights} flights once")
        temporary = self.directory / f"{FLIGHTS}.tmp"
        frame.to_parquet(temporary, index=False)
        temporary.replace(self.directory / FLIGHTS)
        return frame.reset_index(drop=True)

    def _path(self, part: int) -> Path:
        return self.directory / "parts" / f"part-{part:06d}.parquet"
