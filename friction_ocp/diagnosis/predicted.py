"""Additions that short predictions find where simulations have gone astray, and where these go on from them."""

from __future__ import annotations

from dataclasses import replace

from friction_ocp.diagnosis.bench import Bench, open_predicting
from friction_ocp.diagnosis.benchmark import Benchmark
from friction_ocp.diagnosis.excess import excess
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.polishing import polished
from friction_ocp.diagnosis.refit import MOST_OF, completed
from friction_ocp.diagnosis.rival import Rival, is_another
from friction_ocp.diagnosis.search import Search
from friction_ocp.diagnosis.select import Choice, Round
from friction_ocp.diagnosis.worth import innovations
from friction_ocp.effects.effect import Key
from friction_ocp.estimation.model import with_drive
from friction_ocp.statistics.execution import Execution

LEAST_SHARE = 0.25
"""Of the effort, for another search where the one before took more than the rest."""
FOR_PREDICTIONS = 0.5
"""The same for a search by predictions, which goes through what an answer needs: an addition, and then its shape."""


def led_by_predictions(search: Search, run: Execution) -> Search:
    """Look for additions by short predictions where a search lost its way; return the search that found some.

    Where simulations have found something and stay far off, what predictions say instead counts if it takes most of
    what they miss, of lost free runs, or more than what was found, fitted to predictions, takes of it. Simulations that
    come back to the recordings with these additions show what predictions cannot, which begin with the noise of what
    they begin at, and the search goes on with them.
    """
    patience = search.patience * max(1.0 - search.allowance.taken, FOR_PREDICTIONS)
    other = Search(open_predicting(search.bench, run), run, search.meant, search.level, search.tell, patience)
    other.go()
    if not other.accepted or (search.accepted and not _tells_otherwise(search, other)):
        return search
    again = _carried_back(search, other, run) if search.bench.base.lost or _leads_back(search, other) else None
    return other if again is None else again


def _leads_back(search: Search, other: Search) -> bool:
    """Whether segments that torque noise joins come back to the recordings from where predictions have led."""
    base, current = search.bench.base, other.bench.current
    model = with_drive(base.model, current.model.problem.drive)
    found = polished(model, base.footing, model.space.with_known(current.values), None)
    return found.holds and not found.astray


def _tells_otherwise(search: Search, other: Search) -> bool:
    """Whether predictions name something else, and miss less: than half of what they had missed, where free runs were
    lost, else than with what segments that torque noise joins have named.
    """
    if set(search.accepted) & set(other.accepted):
        return False
    known, base, current = search.bench.current, other.bench.base, other.bench.current
    if known.lost:
        before, after = (innovations(model).ratio - 1.0 for model in (base, current))
        return after < MOST_OF * before
    return current.cost < _by_predictions(known, base).cost


def _by_predictions(fitted: FittedModel, base: FittedModel) -> FittedModel:
    """Fit a model to predictions, from where it stands and from where those have led the base model."""
    begins = [fitted.values, {**fitted.values, **base.values}]
    starts = [fitted.model.space.with_known(values) for values in begins]
    ends = [polished(fitted.model, base.footing, theta, None) for theta in starts]
    return min(ends, key=lambda end: end.objective)


def _carried_back(search: Search, other: Search, run: Execution) -> Search | None:
    """Go on with simulations from what predictions have found; None where these stay astray.

    A more general shape that does nothing there is left out.
    """
    bench, rounds, accepted = search.bench.at(search.bench.base), list[Round](), list[Key]()
    for item in other.rounds:
        if item.accepted is None or item.accepted.key not in other.accepted:
            continue
        done = _in_simulations(bench, item)
        if done is None or done.accepted is None:
            if item.accepted.key in accepted:
                continue
            return None
        bench, rounds, accepted = bench.at(done.accepted.fitted), [*rounds, done], [*accepted, done.accepted.key]
    patience = search.patience * max(1.0 - search.allowance.taken - other.allowance.taken, LEAST_SHARE)
    again = Search(bench, run, search.meant, search.level, search.tell, patience, rounds=rounds, accepted=accepted)
    again.go()
    return again if again.accepted and not again.bench.current.astray else None


def _in_simulations(bench: Bench, item: Round) -> Round | None:
    """Return a round as simulations see it, from where predictions have left it; None where they come no closer."""
    current, rival = bench.current, item.accepted
    assert rival is not None
    model = with_drive(current.model, rival.screened.augmentation.drive)
    start = model.space.with_known({**current.values, **rival.standing.values})
    fitted = completed(polished(model, current.footing, start, None), thorough=False)
    if not fitted.holds or fitted.cost >= current.cost or is_another(rival.screened, fitted):
        return None
    own = Rival.of(rival.screened, fitted, -Benchmark(current).dearer(fitted))
    chance = item.choice.chances[rival.key]
    choice = Choice((own,), (chance,), 1.0 - chance, True, (own,), (own,))
    return replace(
        item,
        screened=(),
        choice=choice,
        before=current,
        excess=excess(current.linear.rows, current.blocks),
        accepted=own,
    )
