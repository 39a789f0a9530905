"""Make problems/effects/README.md: every effect of the catalogue, named where a drive has it and a model lacks it.

python problems/effect_gallery.py [--only NAME] [--out FOLDER]

The drives are those of the tests (tests/diagnosis/effect_cases.py): the plant simulates them, and a diagnosis names
what it hides, among what resembles it. A section is written as soon as it is done; `--only` renews one effect and keeps
the others. `--out` writes page and pictures into another folder.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PIL import Image

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "diagnosis"))

from effect_cases import CASES
from gallery import sections_of

from friction_ocp.cli import main as friction_ocp
from friction_ocp.effects.registry import effects
from friction_ocp.report.diagnosis_words import diagnosis_sentence

FOLDER = Path(__file__).resolve().parent / "effects"
OPENING = """# Effects

What the catalogue knows, each hidden in a drive that is simulated by other code, and named by a diagnosis of a model
that lacks it. Left, where a torque on a shaft was missing: that torque over what explains most of it, and what of it
the effect takes; of a joint what it carries over its twist. Right: what free runs of a recording that took no part
missed before and after.
`python problems/effect_gallery.py` makes this page.
"""
WIDTH, COLOURS = 620, 64
"""Pixels of each of the two pictures side by side, and their colours."""


def section(name: str, out: Path) -> str:
    """Return the section of an effect; draws its picture below the folder of the page."""
    case = CASES[name]
    with tempfile.TemporaryDirectory() as place:
        problem, folder = case.write(name, Path(place)), Path(place) / "result"
        if friction_ocp(["diagnose", str(problem), "--out", str(folder)]) != 0:
            raise RuntimeError(f"the diagnosis of {name} failed")
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        drawn = folder / "figures"
        figures = [drawn / "shape.png", drawn / "joint.png", *sorted(drawn.glob("before-after-*.png"))]
        out.mkdir(parents=True, exist_ok=True)
        side_by_side([path for path in figures if path.is_file()], out / f"{name}.png")
    rivals = ", ".join(f"`{rival}`" for rival in case.rivals)
    hidden = f"{effects()[name].sentence}. Hidden at `{case.place}`; beside it {rivals} competed."
    picture = f"![{name.replace('_', ' ')}: what was missing, before and after]({name}.png)"
    told = f"{diagnosis_sentence(result)}{_found(result)}"
    return f"## {name}\n\n{hidden[:1].upper()}{hidden[1:]}\n\n{picture}\n\n{told}\n"


def _found(result: dict[str, Any]) -> str:
    """Return the numbers of what was accepted."""
    values = [(key, item) for one in result["accepted"] for key, item in one["parameters"].items()]
    words = [f"`{key}` {item['value']:.4g} {item['unit']}".removesuffix(" 1") for key, item in values]
    return f"\n\nFound: {', '.join(words)}." if words else ""


def side_by_side(pictures: Sequence[Path], path: Path) -> None:
    """Join pictures, each as wide as the others, into one with few colours."""
    small = list[Image.Image]()
    for picture in pictures:
        with Image.open(picture) as opened:
            height = round(opened.height * WIDTH / opened.width)
            small.append(opened.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS))
    whole = Image.new("RGB", (WIDTH * len(small), max(item.height for item in small)), "white")
    for k, item in enumerate(small):
        whole.paste(item, (k * WIDTH, 0))
    whole.quantize(COLOURS).save(path, optimize=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Renew the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=list(CASES), metavar="NAME", help="only this effect")
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="FOLDER", help="where the page is, or is to be")
    asked = parser.parse_args(arguments)
    page = asked.out / "README.md"
    kept = sections_of(page.read_text(encoding="utf-8")) if page.is_file() else {}
    for name in [asked.only] if asked.only else list(CASES):
        kept[name] = section(name, asked.out)
        print(name, flush=True)
        page.write_text("\n".join([OPENING, *(kept[one] for one in CASES if one in kept)]), encoding="utf-8")


if __name__ == "__main__":
    main()
