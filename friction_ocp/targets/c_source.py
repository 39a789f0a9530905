"""C99 source of a fitted drive: the step that simulations here take, and the torque that cancels its friction."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from friction_ocp.drive.mechanism import column
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.steady import reference_shaft, steady_speeds
from friction_ocp.drive.units import signal_unit, unit_of
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.friction.smoothing import smooth_sign, where
from friction_ocp.friction.static import NoFriction
from friction_ocp.quantities import si_unit
from friction_ocp.simulation.compiled import compiler, load_library
from friction_ocp.simulation.grid import APPLY, COMPUTE, FloatArray
from friction_ocp.targets.compensation_words import left_out
from friction_ocp.targets.fitted import Fitted, Run

FLAGS = ("-std=c99", "-Wall", "-Werror", "-pedantic", "-Wno-unused", "-O2", "-fPIC", "-shared")
WIDTH_SHARE = 0.01
"""Speed below which the compensation goes through zero, as a share of the top speed of the recordings."""


@dataclass(frozen=True)
class CSource:
    """The text of a source file and its header."""

    name: str
    """Prefix of everything in it."""
    header_name: str
    header: str
    body: str

    @property
    def whole(self) -> str:
        """The body with its header inside, to be compiled alone."""
        return self.body.replace(f'#include "{self.header_name}"\n', self.header)


def c_source(fitted: Fitted, header_name: str = "model.h") -> CSource:
    """Return the model and the friction compensation of a fitted drive in C99, its header under the given name."""
    drive, name = fitted.model.drive, fitted.name
    tick = drive.tick is not None
    functions = {"step": drive.step, "output": drive.output, "start": drive.start}
    if drive.tick is not None:
        functions["tick"] = drive.tick
    functions["compensate"] = compensation(fitted)
    generator = ca.CodeGenerator("generated.c", {"with_header": False, "indent": 2, "casadi_int": "int"})
    for key, function in functions.items():
        generator.add(_renamed(function, f"{name}_generated_{key}"))
    numbers = fitted.numbers(fitted.model.problem.fitted[0].name)
    work = {key: (f.sz_arg(), f.sz_res(), f.sz_iw() + 1, f.sz_w() + 1) for key, f in functions.items()}
    body = [
        f"/* {_plain(fitted.model.problem.title)}: see {_plain(header_name)}. */",
        f'#include "{header_name}"',
        "",
        generator.dump(),
        f"const double {name}_identified[] = {{",
        *(f"  {value!r}, /* {path} */" for path, value in _numbered(fitted, numbers)),
        "};",
        "",
        *(_wrapper(name, key, work[key], len(drive.mechanism.topology.roots) + 1) for key in functions),
    ]
    return CSource(name, header_name, _header(fitted, tick), "\n".join(body) + "\n")


def _renamed(function: ca.Function, name: str) -> ca.Function:
    arguments = [ca.SX.sym(f"a{k}", function.size1_in(k), function.size2_in(k)) for k in range(function.n_in())]
    results = [ca.densify(item) for item in function.call(arguments, True, False)]
    return ca.Function(name, arguments, results, {"cse": True})


def _numbered(fitted: Fitted, numbers: FloatArray) -> list[tuple[str, float]]:
    units = {leaf.path: unit_of(leaf, fitted.drive) for leaf in drive_leaves(fitted.drive)}
    names = fitted.model.drive.parameter_names
    return [(f"{k} {path}, {units.get(path, '1')}", float(numbers[k])) for k, path in enumerate(names)]


_SIGNATURES = {
    "step": ("void", "double *x, const double *u, const double *p, double h", "x, u, p, &h, width", "x"),
    "output": (
        "void",
        "const double *x, const double *u, const double *p, double h, double *y",
        "x, u, p, &h, width",
        "y",
    ),
    "start": (
        "void",
        "const double *y, const double *dy, const double *ddy, const double *u, const double *p, double *x",
        "y, dy, ddy, u, p",
        "x",
    ),
    "tick": ("void", "double *x, const double *u, const double *p, int kind", "x, u, p, &which", "x"),
    "compensate": ("double", "double speed, double width, const double *p", "&speed, &width, p", "&torque"),
}


def _wrapper(name: str, key: str, work: tuple[int, int, int, int], widths: int) -> str:
    kind, parameters, arguments, result = _SIGNATURES[key]
    arg, res, iw, w = work
    local = {
        "step": f"  const double width[{widths}] = {{0}};\n",
        "output": f"  const double width[{widths}] = {{0}};\n",
        "tick": "  const double which = kind;\n",
        "compensate": "  double torque = 0;\n",
    }.get(key, "")
    target = f"{name.upper()}_STATES" if result == "x" else ""
    landing = f"  double after[{target}];\n" if result == "x" else ""
    copied = f"  for (int k = 0; k < {target}; ++k) x[k] = after[k];\n" if result == "x" else ""
    returned = "  return torque;\n" if kind == "double" else ""
    places = "\n".join(f"  arg[{k}] = {item};" for k, item in enumerate(arguments.split(", ")))
    return (
        f"{kind} {name}_{key}({parameters}) {{\n{local}{landing}"
        f"  const double *arg[{max(arg, 1)}] = {{0}};\n  double *res[{max(res, 1)}] = {{0}};\n"
        f"  int iw[{iw}];\n  double w[{w}];\n{places}\n  res[0] = {'after' if result == 'x' else result};\n"
        f"  {name}_generated_{key}(arg, res, iw, w, 0);\n{copied}{returned}}}\n"
    )


def _header(fitted: Fitted, tick: bool) -> str:
    drive, name, problem = fitted.model.drive, fitted.name, fitted.model.problem
    upper = name.upper()
    inputs = [f"{k} {item}{_unit(fitted.drive, item)}" for k, item in enumerate(drive.input_names)]
    outputs = [f"{k} {item}{_unit(fitted.drive, item)}" for k, item in enumerate(drive.output_names)]
    states = [f"{k} {item}" for k, item in enumerate(drive.state_names)]
    shaft = reference_shaft(fitted.drive)
    motion = fitted.drive.shaft(shaft).motion
    lines = [
        f"/* {_plain(problem.title)}",
        "   A drive identified from recordings; SI units. Dry friction is set-valued in every step: it truly sticks.",
        *(f"   Doubtful: {_plain(doubt)}." for doubt in fitted.doubts),
        f"   States x: {', '.join(states)}",
        f"   Inputs u: {', '.join(inputs) or 'none'}",
        f"   Outputs y: {', '.join(outputs)}",
        "   Numbers p: as in NAME_identified, or your own in their order.",
        f"   Steps of at most {fitted.model.max_step:.4g} s; inputs u are those in the middle of a step. */".replace(
            "NAME", name
        ),
        f"#ifndef {upper}_H",
        f"#define {upper}_H",
        f"#define {upper}_STATES {len(drive.state_names)}",
        f"#define {upper}_INPUTS {len(drive.input_names)}",
        f"#define {upper}_OUTPUTS {len(drive.output_names)}",
        f"#define {upper}_NUMBERS {len(drive.parameter_names)}",
        f"#define {upper}_MAX_STEP {fitted.model.max_step!r}",
        f"extern const double {name}_identified[];",
        "/* The state that measured outputs y and their first and second time derivatives dy, ddy suggest. */",
        _prototype(name, "start"),
        "/* Advance x by h s. */",
        _prototype(name, "step"),
        "/* Outputs y in state x; h is the length of the steps. */",
        _prototype(name, "output"),
        *(["/* The sampled controller computes (kind 1) or applies (kind 2) a command. */", _prototype(name, "tick")]),
        f"/* What the motors have to deliver at {_plain(shaft)}, {si_unit('torque', motion)}, to cancel the friction",
        f"   of all shafts at its wanted speed, {si_unit('speed', motion)}; it goes through zero within +-width,",
        f"   {compensation_width(fitted):.3g} suits the recordings.",
        *(f"   Left out: {_plain(text)}." for text in left_out(fitted)),
        "   */",
        _prototype(name, "compensate"),
        "#endif",
    ]
    dropped = () if tick else ("_tick(", "The sampled controller")
    return "\n".join(line for line in lines if not any(part in line for part in dropped)) + "\n"


def _prototype(name: str, key: str) -> str:
    kind, parameters, *_ = _SIGNATURES[key]
    return f"{kind} {name}_{key}({parameters});"


def _plain(text: str) -> str:
    return text.replace("*/", "* /").replace("/*", "/ *").replace("\n", " ")


def _unit(drive: Drive, channel: str) -> str:
    measures = [item.measures for item in drive.channels if item.name == channel]
    return f" {signal_unit(drive, measures[0])}" if measures else ""


def compensation(fitted: Fitted) -> ca.Function:
    """Return (speed of the motor's shaft, width, numbers) -> torque there that cancels the friction of all shafts.

    Friction is that of steady motion without load, at its mean over angles, cold.
    """
    drive = fitted.model.problem.drive
    symbols = fitted.model.drive.mechanism.parameters
    bound, speeds = bind_drive(drive, symbols), steady_speeds(fitted.drive)
    speed, width = ca.SX.sym("speed"), ca.SX.sym("width")
    torque: Any = ca.SX(0.0)
    for shaft in bound.shafts:
        ratio = speeds.get(shaft.name)
        if ratio is None or isinstance(shaft.friction.law, NoFriction):
            continue
        size = ca.fabs(speed * ratio)
        positive, negative = (shaft.friction.magnitude(side, size, 0.0) for side in ("positive", "negative"))
        torque = torque + abs(ratio) * where(speed * ratio >= 0, positive, negative)
    value = smooth_sign(speed, width) * torque
    return ca.Function("compensate", [speed, width, column(list(symbols.values()))], [ca.SX(value)])


def compensation_width(fitted: Fitted) -> float:
    """Return a speed, rad/s or m/s, within which the compensation goes through zero."""
    speeds = fitted.model.speeds.get(reference_shaft(fitted.drive))
    return WIDTH_SHARE * (speeds.top if speeds is not None and speeds.top > 0 else 1.0)


class CompiledModel:
    """The exported source, compiled and called."""

    def __init__(self, fitted: Fitted, source: CSource, folder: Path) -> None:
        program = compiler()
        if program is None:
            raise FrictionOcpError(Finding("export", "there is no C compiler", remedy="install cc, gcc or clang"))
        self._library = load_library(source.whole, program, folder, FLAGS)
        self._name, self._fitted = source.name, fitted
        self._function("compensate").restype = ctypes.c_double

    def _function(self, key: str) -> Any:
        return getattr(self._library, f"{self._name}_{key}")

    def compensate(self, speed: float, width: float, numbers: FloatArray) -> float:
        """Return the torque that cancels the friction at a speed."""
        p = np.ascontiguousarray(numbers, dtype=np.float64)
        return float(self._function("compensate")(ctypes.c_double(speed), ctypes.c_double(width), _address(p)))

    def simulate(self, run: Run) -> FloatArray:
        """Return (n, outputs) at the nodes of a recording, each window begun from the state of the free run."""
        grid, y = run.item.grid, np.full_like(run.free.simulated, np.nan)
        p = np.ascontiguousarray(run.numbers, dtype=np.float64)
        x = np.empty(0)
        for k in range(grid.time.size):
            u, steps = np.ascontiguousarray(grid.at_node[k]), int(grid.substeps[k])
            if k in run.first[:-1]:  # states of a free run are those after its controller's ticks
                x = np.array(run.free.states[k], dtype=np.float64)
            else:
                self._ticks(int(grid.ticks[k]), x, u, p)
            h = float(grid.dt[k]) / steps if grid.dt[k] > 0 else float(grid.dt[k - 1]) / int(grid.substeps[k - 1])
            self._function("output")(_address(x), _address(u), _address(p), ctypes.c_double(h), _address(y[k]))
            for sub in range(steps if grid.dt[k] > 0 else 0):
                v = np.ascontiguousarray(grid.between(k, (sub + 0.5) / steps))
                self._function("step")(_address(x), _address(v), _address(p), ctypes.c_double(h))
        return y

    def _ticks(self, bits: int, x: FloatArray, u: FloatArray, p: FloatArray) -> None:
        for kind in (APPLY, COMPUTE):
            if self._fitted.model.drive.tick is not None and bits & kind:
                self._function("tick")(_address(x), _address(u), _address(p), ctypes.c_int(kind))


def _address(array: FloatArray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
