"""How fast is the estimator, and how does its time grow with the samples?

python problems/benchmarks/speed.py [--samples 10000] [--starts 20] [--long] [--ipopt]

Two-mass telescope axis with polyline and with LuGre friction, data of the plant, starts up to a factor sqrt(10) off:
how many starts reach the best optimum, the median and worst time of a fit, and the floor beside it: one
value-and-sensitivity sweep times the iterations. Compilation is printed apart. `--long` fits 10^4, 10^5 and 10^6
samples, each in a process of its own, and prints time, time per iteration and peak memory with the exponent of growth.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import statistics
import time
from dataclasses import dataclass

import numpy as np
from checks import print_rows
from telescope_axis import make_problem, make_run, truth

from friction_ocp.estimation.fit import fit
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.rounds import Fitted

SAME_OBJECTIVE = 1e-3
LENGTHS = (10_000, 100_000, 1_000_000)
SEED = 5


@dataclass(frozen=True)
class Timed:
    """One fit."""

    build: float
    """Seconds until the model is ready, compilation included."""
    seconds: float
    """Seconds of the fit."""
    sweep: float
    """Seconds of one simulation with sensitivities at the end."""
    fitted: Fitted


def timed(law: str, samples: int, rng: np.random.Generator, **options: str) -> Timed:
    """Fit from one random start."""
    factors = {name: float(10.0 ** rng.uniform(-0.5, 0.5)) for name in truth(law)}
    began = time.perf_counter()
    model = prepare(make_problem(law, make_run(law, samples, 1), factors, **options))
    built = time.perf_counter()
    fitted = fit(model)
    done = time.perf_counter()
    sweeps: list[float] = []
    for _ in range(3):
        start = time.perf_counter()
        fitted.program.simulate_all(fitted.solution.point, derivatives=True)
        sweeps.append(time.perf_counter() - start)
    return Timed(built - began, done - built, min(sweeps), fitted)


@dataclass(frozen=True)
class Row:
    """All starts of one law."""

    law: str
    runs: tuple[Timed, ...]

    @property
    def solved(self) -> int:
        """Starts that converged to the best objective."""
        best = min(run.fitted.solution.objective for run in self.runs)
        return sum(
            run.fitted.solution.converged and run.fitted.solution.objective <= (1.0 + SAME_OBJECTIVE) * best
            for run in self.runs
        )

    @property
    def median(self) -> float:
        """Median time of a fit, s."""
        return statistics.median(run.seconds for run in self.runs)

    @property
    def over_floor(self) -> float:
        """Median of the time over iterations times one sweep."""
        return statistics.median(run.seconds / (run.fitted.solution.iterations * run.sweep) for run in self.runs)

    def cells(self) -> tuple[str, ...]:
        """Return a table row."""
        iterations = statistics.median(run.fitted.solution.iterations for run in self.runs)
        return (
            self.law,
            f"{self.solved}/{len(self.runs)}",
            f"{iterations:.0f}",
            f"{self.median:.3f}",
            f"{max(run.seconds for run in self.runs):.3f}",
            f"{1e3 * statistics.median(run.sweep for run in self.runs):.1f}",
            f"{self.over_floor:.1f}",
            f"{self.runs[0].build:.1f}",
        )


HEADER = ("law", "solved", "iterations", "median s", "worst s", "sweep ms", "over floor", "first build s")


def row(law: str, samples: int, starts: int, **options: str) -> Row:
    """Fit one law from all starts."""
    rng = np.random.default_rng(SEED)
    return Row(law, tuple(timed(law, samples, rng, **options) for _ in range(starts)))


@dataclass(frozen=True)
class Long:
    """One fit of many samples in a process of its own."""

    samples: int
    seconds: float
    iterations: int
    memory: float
    """Peak resident memory of the process, GB."""
    converged: bool


def long_fit(samples: int) -> Long:
    """Fit a long recording and read the peak memory of this process."""
    make_run("polyline", samples, 1)
    before = time.perf_counter()
    run = timed("polyline", samples, np.random.default_rng(SEED))
    seconds = time.perf_counter() - before
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
    return Long(samples, seconds, run.fitted.solution.iterations, peak, run.fitted.solution.converged)


def long_fits() -> list[Long]:
    """Return the fits of all lengths, each in a fresh process."""
    results: list[Long] = []
    for samples in LENGTHS:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            results.append(pool.apply(long_fit, (samples,)))
    return results


def growth(fits: list[Long]) -> float:
    """Return the exponent of time per iteration over samples."""
    sizes = np.log([item.samples for item in fits])
    return float(np.polyfit(sizes, np.log([item.seconds / item.iterations for item in fits]), 1)[0])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--long", action="store_true", help="10^4 to 10^6 samples")
    parser.add_argument("--ipopt", action="store_true", help="the same with solver: ipopt")
    options = parser.parse_args()
    if options.long:
        fits = long_fits()
        header = ("samples", "seconds", "iterations", "s/iteration", "peak GB", "converged")
        print_rows(
            header,
            [
                (
                    str(item.samples),
                    f"{item.seconds:.2f}",
                    str(item.iterations),
                    f"{item.seconds / item.iterations:.4f}",
                    f"{item.memory:.2f}",
                    str(item.converged),
                )
                for item in fits
            ],
        )
        print(f"time per iteration grows as samples^{growth(fits):.3f}")
        return
    solver = {"solver": "ipopt"} if options.ipopt else {}
    print_rows(HEADER, [row(law, options.samples, options.starts, **solver).cells() for law in ("polyline", "lugre")])


if __name__ == "__main__":
    main()
