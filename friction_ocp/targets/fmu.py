"""FMU for co-simulation, FMI 2.0: model description, sources, and a binary of the local compiler."""

from __future__ import annotations

import hashlib
import platform
import subprocess
import sys
import tempfile
import zipfile
from importlib.resources import files
from pathlib import Path
from xml.sax.saxutils import quoteattr

from friction_ocp.drive.units import signal_unit, unit_of
from friction_ocp.drive.values import drive_leaves
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.simulation.compiled import compiler
from friction_ocp.targets.c_source import CSource, c_source
from friction_ocp.targets.fitted import Fitted

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden")
_TOO_MANY = 1000
_ENDINGS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib")}


def write_fmu(fitted: Fitted, path: Path) -> None:
    """Write an FMU; raises FrictionOcpError where no C compiler works."""
    source = c_source(fitted)
    text = _whole_source(fitted, source)
    guid = hashlib.sha256(text.encode()).hexdigest()
    text = f'#define GUID "{guid}"\n{text}'
    system, ending = _ENDINGS.get(sys.platform, ("linux", ".so"))
    bits = "64" if platform.architecture()[0] == "64bit" else "32"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", _description(fitted, source.name, guid))
        archive.writestr(f"sources/{source.name}.c", text)
        archive.writestr(f"binaries/{system}{bits}/{source.name}{ending}", _binary(text))


def _binary(text: str) -> bytes:
    program = compiler()
    if program is None:
        raise FrictionOcpError(Finding("export", "there is no C compiler", remedy="install cc, gcc or clang"))
    with tempfile.TemporaryDirectory() as folder:
        code, library = Path(folder) / "fmu.c", Path(folder) / "fmu.so"
        code.write_text(text, encoding="utf-8")
        command = [program, *FLAGS, "-o", str(library), str(code), "-lm"]
        made = subprocess.run(command, capture_output=True, text=True, check=False)
        if made.returncode:
            what = f"the C compiler failed ({' '.join(made.stderr.split())[:300]})"
            raise FrictionOcpError(Finding("export", what, remedy="set CC to another compiler"))
        return library.read_bytes()


def _whole_source(fitted: Fitted, source: CSource) -> str:
    drive, name = fitted.model.drive, source.name
    sizes = (
        ("NX", len(drive.state_names)),
        ("NU", len(drive.input_names)),
        ("NY", len(drive.output_names)),
        ("NP", len(drive.parameter_names)),
    )
    if max(size for _, size in sizes) >= _TOO_MANY:
        raise FrictionOcpError(Finding("export", "the drive has too many numbers", f"fewer than {_TOO_MANY}"))
    defines = [f"#define {key} {size}" for key, size in sizes]
    defines += [f"#define MAX_STEP {fitted.model.max_step!r}", f"#define IDENTIFIED {name}_identified"]
    defines += [f"#define MODEL_{key.upper()} {name}_{key}" for key in ("step", "output")]
    controller = fitted.drive.controller
    if drive.tick is not None:
        assert controller is not None and controller.sample_time is not None
        defines += [f"#define MODEL_TICK {name}_tick", f"#define SAMPLE_TIME {controller.sample_time!r}"]
        defines += [f"#define DELAY {float(controller.delay)!r}"]
    wrapper = files("friction_ocp.targets").joinpath("fmu.c").read_text(encoding="utf-8")
    return "\n".join((source.whole, *defines, wrapper))


def _description(fitted: Fitted, name: str, guid: str) -> str:
    drive = fitted.model.drive
    numbers = fitted.numbers(fitted.model.problem.fitted[0].name)
    number_units = {leaf.path: unit_of(leaf, fitted.drive) for leaf in drive_leaves(fitted.drive)}
    channels = {item.name: signal_unit(fitted.drive, item.measures) for item in fitted.drive.channels}
    rows = [
        _scalar(item, 1000 + k, "input", "continuous", channels.get(item, ""), 0.0)
        for k, item in enumerate(drive.input_names)
    ]
    rows += [
        _scalar(item, 2000 + k, "output", "continuous", channels.get(item, ""), None)
        for k, item in enumerate(drive.output_names)
    ]
    rows += [
        _scalar(item, 3000 + k, "parameter", "tunable", number_units.get(item, ""), float(numbers[k]))
        for k, item in enumerate(drive.parameter_names)
    ]
    for k, item in enumerate(drive.state_names):
        rows.append(_scalar(f"start of {item}", 4000 + k, "parameter", "fixed", "", 0.0))
        rows.append(_scalar(f"state {item}", 5000 + k, "local", "continuous", "", None))
    if drive.tick is not None:
        rows.append(_scalar("controller has acted at the start", 6000, "parameter", "fixed", "", 0.0))
    units = sorted({*channels.values(), *number_units.values()} - {"", "1"})
    first = len(drive.input_names) + 1
    structure = [f'<Unknown index="{first + k}"/>' for k in range(len(drive.output_names))]
    title = quoteattr(fitted.model.problem.title or name)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<fmiModelDescription fmiVersion="2.0" modelName={title} guid="{guid}"',
        '    generationTool="friction_ocp" variableNamingConvention="flat"',
        f"    description={quoteattr(_told(fitted))}>",
        f'  <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true"',
        '      canInterpolateInputs="true" canGetAndSetFMUstate="true" maxOutputDerivativeOrder="0">',
        f'    <SourceFiles><File name="{name}.c"/></SourceFiles>',
        "  </CoSimulation>",
        f"  <UnitDefinitions>{''.join(f'<Unit name={quoteattr(unit)}/>' for unit in units)}</UnitDefinitions>"
        if units
        else "",
        f'  <DefaultExperiment startTime="0" stepSize="{fitted.model.max_step!r}"/>',
        "  <ModelVariables>",
        *rows,
        "  </ModelVariables>",
        f"  <ModelStructure><Outputs>{''.join(structure)}</Outputs>"
        f"<InitialUnknowns>{''.join(structure)}</InitialUnknowns></ModelStructure>",
        "</fmiModelDescription>",
    ]
    return "\n".join(line for line in lines if line) + "\n"


def _told(fitted: Fitted) -> str:
    doubts = "".join(f" Doubtful: {doubt}." for doubt in fitted.doubts)
    return f"A drive identified from recordings.{doubts}"


def _scalar(name: str, reference: int, causality: str, variability: str, unit: str, start: float | None) -> str:
    real = (f" unit={quoteattr(unit)}" if unit not in ("", "1") else "") + (
        "" if start is None else f' start="{start!r}"'
    )
    return (
        f'    <ScalarVariable name={quoteattr(name)} valueReference="{reference}" causality="{causality}" '
        f'variability="{variability}"{_initial(causality)}><Real{real}/></ScalarVariable>'
    )


def _initial(causality: str) -> str:
    return {"parameter": ' initial="exact"', "output": ' initial="calculated"', "local": ' initial="calculated"'}.get(
        causality, ""
    )
