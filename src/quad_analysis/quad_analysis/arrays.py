"""Small functions on arrays of a flight: alignment and gaps by stamp, angles, norms. They know nothing of files."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]


def by_stamp(table: NDArray[np.void]) -> NDArray[np.void]:
    """Return a table (field ``stamp_ns``) sorted by stamp, the first of equal stamps kept."""
    _, index = np.unique(table["stamp_ns"], return_index=True)
    return table[index]


def matched(left: NDArray[np.void], right: NDArray[np.void]) -> tuple[NDArray[np.void], NDArray[np.void]]:
    """Return the rows of two tables, sorted by stamp without repeats, that carry equal stamps."""
    _, here, there = np.intersect1d(left["stamp_ns"], right["stamp_ns"], assume_unique=True, return_indices=True)
    return left[here], right[there]


def norms(vectors: Floats) -> Floats:
    """Return the Euclidean length of each row of an (n, 3) array."""
    squares: Floats = np.einsum("ij,ij->i", vectors, vectors)
    return np.sqrt(squares)


def euler_angles(q_wb: Floats) -> Floats:
    """Return (phi, theta, psi) in rad, shape (n, 3), of unit quaternions xyzw, shape (n, 4) (inverse of Eq. 4)."""
    x, y, z, w = q_wb.T
    phi = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    theta = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    psi = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([phi, theta, psi], axis=1)


def wrapped(angles: Floats) -> Floats:
    """Return angles in rad moved by whole turns into (-pi, pi]."""
    return np.pi - np.mod(np.pi - angles, 2.0 * np.pi)


def missing_messages(tables: Mapping[str, NDArray[np.void]]) -> dict[str, int]:
    """Return {topic: messages missing between the first and the last stamp of all ``tables``}.

    ``tables``: {topic: array with ``stamp_ns``}, sorted, without repeats, not empty. A topic has a message every so
    often as is most frequent in it; what comes up to half of that late, after a late plant, is no gap. Of a topic
    with fewer than three messages nothing can be said: 0.
    """
    stamps = {topic: table["stamp_ns"] for topic, table in tables.items()}
    first = min((int(found[0]) for found in stamps.values()), default=0)
    last = max((int(found[-1]) for found in stamps.values()), default=0)
    return {topic: _missing(found, first, last) for topic, found in stamps.items()}


def _missing(stamps: NDArray[np.int64], first: int, last: int) -> int:
    if len(stamps) < 3:
        return 0
    spacings, counts = np.unique(np.diff(stamps), return_counts=True)
    period = int(spacings[counts.argmax()])
    between = (spacings + period // 2) // period - 1
    ends = [max(0, gap // period - 1) for gap in (int(stamps[0]) - first, last - int(stamps[-1]))]
    return int(np.maximum(between, 0) @ counts) + sum(ends)
