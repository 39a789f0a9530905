"""The confusion matrix as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

RIGHT = {"no effect": "no_gap"}


def draw_confusion(
    rows: Sequence[str], columns: Sequence[str], counts: np.ndarray, outside: set[str], path: Path
) -> None:
    """Draw what was said first against what was hidden; what is right has a frame."""
    width, height = 3.2 + 0.32 * len(columns), 2.6 + 0.26 * len(rows)
    figure, axes = plt.subplots(figsize=(width, height), layout="constrained")
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in np.argwhere(counts > 0):
        axes.text(
            j, i, str(counts[i, j]), ha="center", va="center", color="white" if share[i, j] > 0.5 else "black", size=8
        )
    for i, truth in enumerate(rows):
        right = "unknown_effect" if truth in outside else RIGHT.get(truth, truth)
        if right in columns:
            frame = plt.Rectangle((list(columns).index(right) - 0.5, i - 0.5), 1, 1, fill=False, edgecolor="tab:red")
            axes.add_patch(frame)
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", rotation_mode="anchor", size=8)
    axes.set_yticks(range(len(rows)), rows, size=8)
    axes.set_xlabel("said first")
    axes.set_ylabel("hidden")
    figure.savefig(path, dpi=150)
    plt.close(figure)
