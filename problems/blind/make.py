"""Make cases of the blind suite.

python problems/blind/make.py --seed N [--cases M] [--out DIR]

DIR/cases/<name> gets problem.yaml and its recordings, DIR/answers/<name>.json what is hidden: only score.py opens it.
The same seed makes the same cases; what exists is kept.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind.draw import make


def main() -> None:
    """Write the cases, one line each on what took how long; nothing about what is hidden."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--cases", type=int, default=168)
    parser.add_argument("--out", type=Path, default=Path("results/blind"))
    options = parser.parse_args()
    for index in range(options.cases):
        began = time.perf_counter()
        case = make(options.seed, index, options.out)
        print(f"{case.name}  {case.machine:<24} {time.perf_counter() - began:5.1f} s", flush=True)


if __name__ == "__main__":
    main()
