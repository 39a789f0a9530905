"""The maps that a sweep loops over - step, output, controller tick - as CasADi functions with derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from friction_ocp.drive.stepping import SteppedDrive
from friction_ocp.simulation.jacobian import jacobian


@dataclass(frozen=True)
class SweepMap:
    """One map in implicit form: its value depends on torques that equal `found`."""

    name: str
    arguments: tuple[ca.SX, ...]
    """State, inputs, parameters, then what else the map needs."""
    torques: ca.SX
    """Symbols of the unknown torques; empty for an explicit map."""
    value: ca.SX
    found: ca.SX

    @property
    def unknowns(self) -> int:
        """How many torques are unknown."""
        return self.torques.numel()

    def value_functions(self) -> tuple[ca.Function, ...]:
        """Return (arguments) -> value or, for an implicit map, its three stages.

        (arguments) -> constants that do not depend on the torques; (arguments, torques, constants) -> better
        torques, one step of Newton's method; (arguments, torques, constants) -> value.
        """
        if not self.unknowns:
            return (self._function(self.name, [], [self.value]),)
        slope = ca.SX.eye(self.unknowns) - ca.jacobian(self.found, self.torques)
        better = self.torques - ca.solve(slope, self.torques - self.found)
        stacked = ca.cse(ca.vertcat(better, self.value))
        rest, symbols, constants = ca.extract_parametric(stacked, ca.vertcat(*self.arguments), {})
        after = [self.torques, ca.vertcat(*symbols)]
        return (
            self._function(f"{self.name}_c", [], [ca.vertcat(*constants)]),
            self._function(f"{self.name}_n", after, [rest[: self.unknowns]]),
            self._function(self.name, after, [rest[self.unknowns :]]),
        )

    def derivative(self, active: Sequence[int]) -> ca.Function:
        """Return (arguments, torques) -> value, Jacobian by state, Jacobian by active parameters, these two sparse.

        The torques move with state and parameters as the implicit function theorem says.
        """
        by_state, by_active = self._slopes(self.arguments[0], ca.vertcat(*[self.arguments[2][k] for k in active]))
        arguments = [*self.arguments, *([self.torques] if self.unknowns else [])]
        return ca.Function(f"{self.name}_d", arguments, [ca.densify(self.value), by_state, by_active], {"cse": True})

    def solved(self, active: Sequence[int] | None, newton_steps: int) -> ca.Function:
        """Return (arguments, torques to start from) -> value, torques and, by `active`, the two Jacobians.

        The number of Newton's steps is fixed; without `active` there are no Jacobians.
        """
        *equations, value = self.value_functions()
        torques, after = self.torques, list(self.arguments)
        if self.unknowns:
            constants = equations[0].call(list(self.arguments), True, False)[0]
            for _ in range(newton_steps):
                torques = equations[1].call([*self.arguments, torques, constants], True, False)[0]
            after = [*self.arguments, torques, constants]
        values = [value.call(after, True, False)[0], torques]
        if active is not None:
            slopes = self.derivative(active).call(after[: len(self.arguments) + bool(self.unknowns)], True, False)[1:]
            values += [ca.densify(slope) for slope in slopes]
        return ca.Function(f"{self.name}_s", [*self.arguments, self.torques], values, {"cse": True})

    def _slopes(self, state: ca.SX, active: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return the Jacobians of the value by the state and by the active parameters."""
        by = ca.vertcat(state, active)
        ends = [state.numel(), by.numel()]
        if not self.unknowns:
            by_state, by_active = ca.horzsplit(jacobian(self.value, by), [0, *ends])
            return by_state, by_active
        rows = [0, self.value.numel(), self.value.numel() + self.unknowns]
        partial = jacobian(ca.vertcat(self.value, self.found), ca.vertcat(by, self.torques))
        value, found = (ca.horzsplit(part, [0, *ends, partial.size2()]) for part in ca.vertsplit(partial, rows))
        slope = ca.SX.eye(self.unknowns) - found[2]
        by_state, by_active = (value[k] + ca.mtimes(value[2], ca.solve(slope, found[k])) for k in range(2))
        return by_state, by_active

    def _function(self, name: str, more: list[ca.SX], values: list[ca.SX]) -> ca.Function:
        return ca.Function(name, [*self.arguments, *more], [ca.densify(value) for value in values], {"cse": True})


def sweep_maps(drive: SteppedDrive, active: Sequence[int]) -> dict[str, SweepMap]:
    """Return `step`, `output`, `tick` where the drive has ticks, and `now` where delays may be left out.

    `now` is `output` with all sensor delays zero, which needs no acceleration; it exists unless a delay is fitted.
    """
    maps = {"step": _implicit("step", drive), "output": _implicit("output", drive)}
    if drive.tick is not None:
        arguments = _symbols(drive.tick)
        maps["tick"] = _explicit("fo_tick", arguments, drive.tick.call(arguments, True, False)[0])
    delays = delay_indices(drive)
    if delays and not set(delays) & set(active):
        maps["now"] = _without_delay(maps["output"], delays)
    return maps


def delay_indices(drive: SteppedDrive) -> tuple[int, ...]:
    """Return where the parameters hold the delays of output channels, and what their clocks are fast by."""
    whole = drive.mechanism.drive
    names = {f"{name}.delay" for name in drive.output_names}
    names |= {
        f"{clock.path}.{key}" for clock in map(whole.clock_of, whole.outputs) if clock for key in ("offset", "drift")
    }
    return tuple(k for k, name in enumerate(drive.parameter_names) if name in names)


def _symbols(function: ca.Function) -> list[ca.SX]:
    return [ca.SX.sym(f"a{k}", function.size1_in(k)) for k in range(function.n_in())]


def _explicit(name: str, arguments: Sequence[ca.SX], value: ca.SX) -> SweepMap:
    none = ca.SX(0, 1)
    return SweepMap(name, tuple(arguments), none, ca.cse(value), none)


def _implicit(name: str, drive: SteppedDrive) -> SweepMap:
    relation = drive.implicit.get(name)
    if relation is None:
        function: ca.Function = getattr(drive, name)
        arguments = _symbols(function)
        return _explicit(f"fo_{name}", arguments, function.call(arguments, True, False)[0])
    *arguments, torques = _symbols(relation)
    value, found = relation.call([*arguments, torques], True, False)
    return _without_idle_torques(SweepMap(f"fo_{name}", tuple(arguments), torques, value, found))


def _without_idle_torques(item: SweepMap) -> SweepMap:
    """Make a map explicit whose value does not depend on the torques; simplify it before it is differentiated."""
    if not ca.depends_on(item.value, item.torques):
        return _explicit(item.name, item.arguments, item.value)
    stacked = ca.cse(ca.vertcat(item.value, item.found))
    split = item.value.numel()
    return SweepMap(item.name, item.arguments, item.torques, stacked[:split], stacked[split:])


def _without_delay(output: SweepMap, delays: tuple[int, ...]) -> SweepMap:
    symbols = ca.vertcat(*[output.arguments[2][k] for k in delays])
    value = ca.simplify(ca.substitute(output.value, symbols, ca.SX.zeros(len(delays))))
    if not output.unknowns:
        return _explicit("fo_now", output.arguments, value)
    return _without_idle_torques(SweepMap("fo_now", output.arguments, output.torques, value, output.found))
