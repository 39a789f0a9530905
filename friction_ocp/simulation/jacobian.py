"""Jacobians with few operations: the graph of a computation with its vertices eliminated, the cheapest first.

The Jacobian is the sum over all paths from an argument to a value of the products of the partial derivatives on the
way. Eliminating a vertex joins every edge that leads to it with every edge that leads away; in which order decides how
many operations that takes: what comes next is what leaves the fewest new edges, among equals the latest. Forward mode
is the order of the computation, reverse mode its opposite. Source: Griewank and Walther 2008, "Evaluating Derivatives",
chapters 9 and 10.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from heapq import heapify, heappop, heappush

import casadi as ca

_STEPWISE = {
    *(ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR, ca.OP_NOT),
    *(ca.OP_SIGN, ca.OP_FLOOR, ca.OP_CEIL),
}
"""Operations whose derivative is zero wherever it exists."""


def jacobian(value: ca.SX, by: ca.SX) -> ca.SX:
    """Return the Jacobian (rows, columns), sparse, of a vector by a vector of symbols.

    Where a condition leaves something out its derivative is 0, be it infinite or not a number.
    """
    graph = _graph(ca.densify(value), by)
    graph.eliminate()
    found = ca.SX(value.numel(), by.numel())
    for row, vertex in enumerate(graph.sinks):
        for source, edge in sorted(graph.into[vertex].items()):
            found[row, graph.sources[source]] = edge.partial
    return found


@dataclass(frozen=True)
class _Edge:
    """The derivative of a vertex by another one."""

    partial: ca.SX
    mixed: bool = False
    """Whether it is a sum with terms that conditions may leave out: where it is 0 for that, so is any product."""

    def after(self, inner: _Edge) -> _Edge:
        """Return the derivative by what `inner` is a derivative by: conditions remain the last to be applied."""
        product = _product(self.partial, inner.partial)
        if not self.mixed or _is_chosen(self.partial):
            return _Edge(product)
        return _Edge(_chosen(ca.SX.binary(ca.OP_NE, self.partial, ca.SX(0)), product))

    def beside(self, other: _Edge) -> _Edge:
        """Return the sum over two ways."""
        conditional = any(edge.mixed or _is_chosen(edge.partial) for edge in (self, other))
        return _Edge(self.partial + other.partial, mixed=conditional)


@dataclass
class _Graph:
    """Vertices by number, in the order of the computation, and the derivatives between them."""

    into: list[dict[int, _Edge]] = field(default_factory=list[dict[int, _Edge]])
    """By vertex: the edges that lead to it, by where they come from."""
    onward: list[set[int]] = field(default_factory=list[set[int]])
    """By vertex: where edges lead from it."""
    sources: dict[int, int] = field(default_factory=dict[int, int])
    """The arguments' places by vertex."""
    sinks: list[int] = field(default_factory=list[int])
    """The values' vertices."""

    def add(self, edges: dict[int, _Edge]) -> int:
        """Add a vertex that edges lead to."""
        vertex = len(self.into)
        self.into.append(edges)
        self.onward.append(set())
        for source in edges:
            self.onward[source].add(vertex)
        return vertex

    def depends(self, vertex: int) -> bool:
        """Whether a vertex moves with any argument."""
        return vertex in self.sources or bool(self.into[vertex])

    def eliminate(self) -> None:
        """Leave nothing but edges from arguments to values."""
        left = {*range(len(self.into))} - {*self.sources, *self.sinks}
        queue = [(self._price(vertex), -vertex) for vertex in left]
        heapify(queue)
        while left:
            price, vertex = heappop(queue)
            vertex = -vertex
            if vertex not in left:
                continue
            if self._price(vertex) > price:
                heappush(queue, (self._price(vertex), -vertex))
                continue
            left.discard(vertex)
            for other in self._without(vertex) & left:
                heappush(queue, (self._price(other), -other))

    def _price(self, vertex: int) -> int:
        """Return how many new edges there are once a vertex is eliminated."""
        before = self.into[vertex].keys()
        return sum(len(before - self.into[target].keys()) for target in self.onward[vertex])

    def _without(self, vertex: int) -> set[int]:
        """Join the edges to a vertex with those that lead away; return the vertices that it was joined with."""
        before, after = self.into[vertex], self.onward[vertex]
        for source in before:
            self.onward[source].discard(vertex)
            self.onward[source] |= after
        for target in after:
            edges = self.into[target]
            outer = edges.pop(vertex)
            for source, inner in before.items():
                edge = outer.after(inner)
                edges[source] = edges[source].beside(edge) if source in edges else edge
        self.into[vertex], self.onward[vertex] = {}, set()
        return {*before, *after}


def _graph(value: ca.SX, by: ca.SX) -> _Graph:
    """Return the graph of a vector, each value a vertex of its own."""
    others = ca.vertcat(*[symbol for symbol in ca.symvar(value) if not ca.depends_on(by, symbol)])
    function = ca.Function("value", [by, others], [value], {"cse": True})
    graph, values, held = _Graph(), list[ca.SX](), dict[int, int]()
    ends = [-1] * value.numel()
    for k in range(function.n_instructions()):
        operation, inputs = function.instruction_id(k), function.instruction_input(k)
        output = function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            ends[output[1]] = held[inputs[0]]
            continue
        edges = dict[int, _Edge]()
        if operation == ca.OP_CONST:
            values.append(ca.SX(function.instruction_constant(k)))
        elif operation == ca.OP_INPUT:
            values.append((by, others)[inputs[0]][inputs[1]])
            if inputs[0] == 0:
                graph.sources[len(graph.into)] = inputs[1]
        else:
            places = [held[register] for register in inputs]
            operands = [values[place] for place in places]
            values.append(_computed(operation, operands))
            edges = _edges(graph, operation, places, operands)
        held[output[0]] = graph.add(edges)
    for vertex in ends:
        graph.sinks.append(graph.add({vertex: _Edge(ca.SX(1))} if graph.depends(vertex) else {}))
    return graph


def _edges(graph: _Graph, operation: int, places: list[int], operands: list[ca.SX]) -> dict[int, _Edge]:
    """Return the edges to the result of an operation."""
    edges = dict[int, _Edge]()
    if operation in _STEPWISE:
        return edges
    for number, place in enumerate(places):
        if graph.depends(place):
            partial = _partial(operation, number, operands)
            if not partial.is_zero():
                edge = _Edge(partial)
                edges[place] = edges[place].beside(edge) if place in edges else edge
    return edges


def _partial(operation: int, number: int, operands: list[ca.SX]) -> ca.SX:
    """Return the derivative of an operation by one of its operands."""
    if operation == ca.OP_IF_ELSE_ZERO:
        return ca.SX(0) if number == 0 else _chosen(operands[0], ca.SX(1))
    return _partials(operation, len(operands))[number].call(operands, True, False)[0]


@cache
def _partials(operation: int, count: int) -> list[ca.Function]:
    symbols = [ca.SX.sym(f"a{k}") for k in range(count)]
    value = _computed(operation, symbols)
    return [ca.Function("partial", symbols, [ca.densify(ca.jacobian(value, symbol))]) for symbol in symbols]


def _computed(operation: int, operands: list[ca.SX]) -> ca.SX:
    return ca.SX.binary(operation, *operands) if len(operands) == 2 else ca.SX.unary(operation, *operands)


def _chosen(condition: ca.SX, value: ca.SX) -> ca.SX:
    return ca.SX.binary(ca.OP_IF_ELSE_ZERO, condition, value)


def _is_chosen(value: ca.SX) -> bool:
    return bool(value.is_op(ca.OP_IF_ELSE_ZERO))


def _product(outer: ca.SX, inner: ca.SX) -> ca.SX:
    """Return a product to which the conditions of its factors are applied after all else."""
    for one, other, swapped in ((outer, inner, False), (inner, outer, True)):
        if _is_chosen(one):
            rest = _product(other, one.dep(1)) if swapped else _product(one.dep(1), other)
            return _chosen(one.dep(0), rest)
    return outer * inner
