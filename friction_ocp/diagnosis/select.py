"""Which candidate: held-out gain by blocks, probabilities over candidates, alias sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.blocks import Blocks
from friction_ocp.diagnosis.fitting import FittedModel
from friction_ocp.diagnosis.screen import Screened
from friction_ocp.simulation.grid import FloatArray

RESAMPLES = 2000
ENOUGH_RECORDINGS = 6
"""From which whole recordings are resampled."""


@dataclass(frozen=True)
class Rival:
    """A candidate that was refitted, and what it gains on recordings left out."""

    screened: Screened
    fitted: FittedModel
    gains: FloatArray
    """(blocks,) decrease of the held-out objective against the model without it."""

    @property
    def key(self) -> tuple[str, str]:
        """Effect and component."""
        return self.screened.key


@dataclass(frozen=True)
class Choice:
    """What the held-out gains say about the rivals, best first."""

    rivals: tuple[Rival, ...]
    probabilities: tuple[float, ...]
    """Of each rival to be the best."""
    nothing: float
    """Probability that none is better than no addition at all."""
    significant: bool
    """Whether the held-out gain of the best rival is positive at the level asked for; or, where none stands out by
    itself, that of whichever is best, the level being shared among them (Bonferroni)."""
    aliases: tuple[Rival, ...]
    """The best rival and all whose difference to it is within its own scatter."""


def resamples(blocks: Blocks, rng: np.random.Generator) -> FloatArray:
    """Return (resamples, blocks) how often each block is drawn.

    Whole recordings are drawn where there are enough of them: held-out errors of one share the parameters that it had
    no part in. Otherwise blocks are drawn within their recordings.
    """
    counts = np.zeros((RESAMPLES, blocks.count))
    recordings, place = np.unique(blocks.recording, return_inverse=True)
    if recordings.size >= ENOUGH_RECORDINGS:
        drawn = rng.multinomial(recordings.size, np.full(recordings.size, 1.0 / recordings.size), RESAMPLES)
        return drawn[:, place].astype(float)
    for recording in recordings:
        own = np.flatnonzero(blocks.recording == recording)
        drawn = rng.integers(0, own.size, (RESAMPLES, own.size))
        for k in range(own.size):
            counts[:, own[k]] = np.sum(drawn == k, axis=1)
    return counts


def choose(rivals: Sequence[Rival], blocks: Blocks, level: float, rng: np.random.Generator) -> Choice:
    """Weigh rivals by their held-out gains; `level` is the significance asked for."""
    if not rivals:
        return Choice((), (), 1.0, False, ())
    ordered = sorted(rivals, key=lambda rival: -float(np.sum(rival.gains)))
    draws = resamples(blocks, rng)
    totals = np.column_stack([np.zeros(len(draws)), *(draws @ rival.gains for rival in ordered)])
    wins = np.bincount(np.argmax(totals, axis=1), minlength=len(ordered) + 1) + 1.0 / (len(ordered) + 1)
    shares = wins / wins.sum()
    best = totals[:, 1]
    alone = bool(np.quantile(best, level) > 0)
    some = bool(shares[0] < level / len(ordered))
    aliases = [
        rival
        for k, rival in enumerate(ordered)
        if k == 0 or (np.quantile(best - totals[:, k + 1], level) <= 0 < _least(totals[:, k + 1], level, alone))
    ]
    order = sorted(range(len(ordered)), key=lambda k: -float(shares[k + 1]))
    return Choice(
        tuple(ordered[k] for k in order),
        tuple(float(shares[k + 1]) for k in order),
        float(shares[0]),
        alone or (some and len(aliases) > 1),
        tuple(sorted(aliases, key=lambda rival: -shares[ordered.index(rival) + 1])),
    )


def _least(gains: FloatArray, level: float, alone: bool) -> float:
    """Return the gain of a rival that must be positive for it to be an alias: at the level, or where no rival reaches
    that by itself, on average."""
    return float(np.quantile(gains, level) if alone else np.mean(gains))


def probabilities(choice: Choice, gap: bool) -> Mapping[str, float]:
    """Return the probabilities of no effect and of one outside the catalogue: what no candidate explains, is either."""
    nothing, outside = (0.0, choice.nothing) if gap else (choice.nothing, 0.0)
    return {"no_effect": nothing, "outside_catalogue": outside}
