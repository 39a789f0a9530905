"""The targets of `export`: what each writes, what it loses, and how its price is measured."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.targets.c_source import CompiledModel, c_source
from friction_ocp.targets.fitted import Fitted, load_fitted
from friction_ocp.targets.fmu import write_fmu
from friction_ocp.targets.fmu_run import loaded_fmu
from friction_ocp.targets.joints import Loss, joint_drive
from friction_ocp.targets.mjcf import STEP, STIFF, mjcf_text
from friction_ocp.targets.mujoco_run import MuJoCoRun
from friction_ocp.targets.price import PriceRow, price_table
from friction_ocp.targets.table import table_text
from friction_ocp.targets.urdf import urdf_losses, urdf_text
from friction_ocp.whole_file import whole_file


@dataclass(frozen=True)
class Exported:
    """What an export left behind."""

    files: tuple[Path, ...]
    losses: tuple[Loss, ...] = ()
    """What the target cannot express."""
    price: Callable[[], tuple[PriceRow, ...]] | None = None
    """Measures what the export costs; None for a target that simulates nothing."""
    simulator: str = ""
    doubts: tuple[str, ...] = ()
    """Why the numbers may be no answer."""
    no_price: str = ""
    """Why it is not measured, where recordings could be run."""


Target = Callable[[Fitted, Path], Exported]


def export(result: Fitted | str | Path, to: str, path: str | Path) -> Exported:
    """Write a fitted drive, or that of a result on disk, for a target; raises FrictionOcpError for an unknown one."""
    target = TARGETS.get(to)
    if target is None:
        raise FrictionOcpError(Finding("export", f"unknown target '{to}'", f"available: {', '.join(TARGETS)}"))
    if Path(path).is_dir():
        raise FrictionOcpError(Finding(str(path), "this is a folder", "a file to write"))
    fitted = result if isinstance(result, Fitted) else load_fitted(result)
    return replace(target(fitted, Path(path)), doubts=fitted.doubts)


def _mjcf(fitted: Fitted, path: Path) -> Exported:
    drive = joint_drive(fitted)
    text = mjcf_text(drive, fitted.name, doubts=fitted.doubts)
    _write(path, text)
    return Exported(
        (path,), drive.losses, lambda: price_table(fitted, MuJoCoRun(fitted, drive, text, False).simulate), "MuJoCo"
    )


def _urdf(fitted: Fitted, path: Path) -> Exported:
    drive = joint_drive(fitted, elastic=False)
    text = urdf_text(drive, fitted.name, fitted.doubts)
    _write(path, text)

    def price() -> tuple[PriceRow, ...]:
        run = MuJoCoRun(fitted, drive, text, True)
        run.model.opt.timestep = STEP
        run.model.dof_solref[:] = (2.0 * STEP, 1.0)
        run.model.dof_solimp[:] = (STIFF, STIFF, 0.001, 0.5, 2.0)
        return price_table(fitted, run.simulate)

    losses = urdf_losses(drive)
    if len(fitted.model.drive.mechanism.topology.roots) > 1:
        why = "what is seen on one side of a spring has no counterpart in a drive without it"
        return Exported((path,), losses, no_price=why)
    return Exported((path,), losses, price, "MuJoCo")


def _fmu(fitted: Fitted, path: Path) -> Exported:
    with whole_file(path) as staged:
        write_fmu(fitted, staged)

    def price() -> tuple[PriceRow, ...]:
        with loaded_fmu(fitted, path) as run:
            return price_table(fitted, run.simulate)

    return Exported((path,), (), price, "the FMU")


def _c(fitted: Fitted, path: Path) -> Exported:
    if path.suffix == ".h" or '"' in path.name:
        raise FrictionOcpError(Finding(str(path), "this cannot be the name of a source file", "NAME.c"))
    header = path.with_suffix(".h")
    source = c_source(fitted, header.name)
    _write(path, source.body)
    _write(header, source.header)

    def price() -> tuple[PriceRow, ...]:
        with tempfile.TemporaryDirectory() as folder:
            return price_table(fitted, CompiledModel(fitted, source, Path(folder)).simulate)

    return Exported((path, header), (), price, "C")


def _table(fitted: Fitted, path: Path) -> Exported:
    _write(path, table_text(fitted))
    return Exported((path,))


def _write(path: Path, text: str) -> None:
    with whole_file(path) as staged:
        staged.write_text(text, encoding="utf-8")


TARGETS: Mapping[str, Target] = {"mjcf": _mjcf, "urdf": _urdf, "fmu": _fmu, "c": _c, "table": _table}
