"""The closed loop on CasADi symbols, and the C text of it. CasADi is needed to build, not to run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

from towtank.engine.emit import c_function, c_pattern
from towtank.engine.form import Form, system
from towtank.engine.loop import MEMORY, SEEN, channels, command, dynamics, load_through_water, observe, observed, states
from towtank.model.algebra import ZERO, Ops
from towtank.model.equations import Constants
from towtank.model.rigid_body import mass_matrix
from towtank.pilot.law import Seen
from towtank.pilot.orders import ORDERS


def casadi_ops() -> Ops:
    """The elementary functions on CasADi symbols."""
    import casadi as ca

    functions = {name: getattr(ca, name) for name in ("sin", "cos", "fabs", "sqrt", "fmin", "fmax", "atan2", "floor")}
    return cast(Ops, SimpleNamespace(**functions, positive=lambda x: ca.SX(x) > 0))


@dataclass(frozen=True)
class Traced:
    """The closed loop of a form as CasADi functions; sizes in ``numbers``.

    dynamics(p, x, asked) -> rates;   observe(p, x, orders) -> channels;   steer(p, channels, memory, orders) ->
    granted (3), asked (n + 1: fin angles, throttle), rates of the memory (3), heading wanted (1).
    """

    form: Form
    symbols: Any
    expressions: Any
    functions: dict[str, Any]

    @property
    def numbers(self) -> dict[str, int]:
        """Sizes and places the C text needs."""
        n = self.form.fins
        names = channels(n)
        return {
            "NP": len(self.form.names), "NX": len(states(n)), "NM": len(MEMORY), "NO": len(ORDERS), "NF": n,
            "NA": n + 1,
            "NS": observed(n), "NY": len(names), "PSI": names.index("psi"), "Z": names.index("z"),
            "DELTA": names.index("delta1"), "SPEED": names.index("speed"),
            "DEAD_BAND": self.form.place["dead_band0"], "BACKLASH": self.form.place["backlash0"],
            "FIN_SHARE": self.form.place["fin_share"], "INVERSE": self.form.place["inverse00"],
        }  # fmt: skip


def traced(form: Form) -> Traced:
    """Trace the closed loop of ``form``; common subexpressions are removed."""
    import casadi as ca

    n, ops = form.fins, casadi_ops()
    sizes = {"p": len(form.names), "x": len(states(n)), "asked": n + 1, "orders": len(ORDERS), "memory": len(MEMORY)}
    v = SimpleNamespace(
        **{name: ca.SX.sym(name, size) for name, size in sizes.items()}, seen=ca.SX.sym("y", observed(n))
    )
    listed = {name: [value[i] for i in range(value.numel())] for name, value in vars(v).items()}
    s = system(form, listed["p"])
    rates = ca.vertcat(*dynamics(s, listed["x"], listed["asked"], ops))
    weightless = replace(s, constants=replace(s.constants, mass_inverse=[[ZERO] * 6] * 6))
    direct = ca.vertcat(*dynamics(weightless, listed["x"], listed["asked"], ops))
    seen = ca.vertcat(*observe(s, listed["x"], listed["orders"], ops))
    steering = command(s, listed["seen"], listed["memory"], listed["orders"], ops)
    asked = [*steering.fins, listed["orders"][ORDERS.index("throttle")]]
    steered = [ca.vertcat(*part) for part in (steering.granted, asked, steering.memory_rates, [steering.heading])]
    load = ca.vertcat(*load_through_water(s, listed["x"], listed["asked"][-1], ops))
    e = SimpleNamespace(rates=rates, direct=direct, seen=seen, steered=steered, load=load, mass=_mass(s.constants))
    functions = {
        "dynamics": _function("dynamics", [v.p, v.x, v.asked], [rates]),
        "observe": _function("observe", [v.p, v.x, v.orders], [seen]),
        "steer": _function("steer", [v.p, v.seen, v.memory, v.orders], steered),
    }
    return Traced(form, v, e, functions)


def slopes_header(trace: Traced) -> str:
    """C text ``slopes.h``: vector-Jacobian products and sparse Jacobians of the three functions.

    The rates are direct + W load, with W the inverse of the mass matrix M. Derivatives are with respect to the
    parameters before W; what a change of mass, CG, inertia or added mass does through W is part of them: M a = load
    gives da = W (dload - dM a), so the load of the derivatives is ``balanced`` = load - M a with a held.
    """
    import casadi as ca

    v, e, form = trace.symbols, trace.expressions, trace.form
    free = form.place["inverse00"]
    theta = v.p[:free]
    held = ca.SX.sym("a", 6)
    W = ca.reshape(v.p[free:], 6, 6).T
    balanced = e.load - ca.mtimes(e.mass, held)
    bar = {"x": ca.SX.sym("lx", e.rates.numel()), "seen": ca.SX.sym("ly", e.seen.numel()),
           "asked": ca.SX.sym("la", v.asked.numel()), "memory": ca.SX.sym("lm", v.memory.numel())}  # fmt: skip
    through = ca.mtimes(W.T, bar["x"][7:13])

    def known(expression: Any) -> Any:
        return ca.substitute(expression, held, ca.mtimes(W, e.load))

    moved = ca.dot(bar["x"], e.direct) + ca.dot(through, e.load)
    shifted = ca.dot(bar["x"], e.direct) + ca.dot(through, balanced)
    seen = _smooth_seen(form, v)
    watched, (_, asked, remembered, _) = ca.dot(bar["seen"], seen), e.steered
    steered = ca.dot(bar["asked"], asked) + ca.dot(bar["memory"], remembered)
    both = ca.vertcat(asked, remembered)
    functions = [
        ("dynamics_vjp", [v.p, v.x, v.asked, bar["x"]],
         [ca.densify(out) for out in (ca.gradient(moved, v.x), ca.gradient(moved, v.asked),
                                      known(ca.gradient(shifted, theta)))]),
        ("observe_vjp", [v.p, v.x, v.orders, bar["seen"]], [ca.gradient(watched, x) for x in (v.x, theta)]),
        ("steer_vjp", [v.p, v.seen, v.memory, v.orders, bar["asked"], bar["memory"]],
         [ca.gradient(steered, x) for x in (v.seen, v.memory, theta)]),
        ("dynamics_jac", [v.p, v.x, v.asked],
         [*(ca.jacobian(e.direct, x) for x in (v.x, v.asked, theta)), ca.jacobian(e.load, v.x),
          known(ca.jacobian(balanced, theta))]),
        ("observe_jac", [v.p, v.x, v.orders], [ca.jacobian(seen, x) for x in (v.x, theta)]),
        ("steer_jac", [v.p, v.seen, v.memory, v.orders], [ca.jacobian(both, x) for x in (v.seen, v.memory, theta)]),
    ]  # fmt: skip
    lines = [f"/* {form.word} */", f"#define FREE {free}"]
    for name, inputs, outputs in functions:
        function = ca.Function(
            name, inputs, ca.cse([out if name == "dynamics_vjp" else ca.sparsify(out) for out in outputs])
        )
        lines.append(c_function(function)[0])
        lines += [c_pattern(f"{name}{i}", function.sparsity_out(i)) for i in range(function.n_out())]
    return "\n".join([*lines, ""])


def _smooth_seen(form: Form, v: Any) -> Any:
    """The channels with an arc tangent that has a slope at (0, 0) too, which a craft at rest or upright meets."""
    import casadi as ca

    ops = casadi_ops()

    def atan2(y: Any, x: Any) -> Any:
        return ca.atan2(y, x + ca.logic_not(ca.SX(x * x + y * y) > 0))

    p, x, orders = ([column[i] for i in range(column.numel())] for column in (v.p, v.x, v.orders))
    smooth = cast(Ops, SimpleNamespace(**{**vars(ops), "atan2": atan2}))
    return ca.vertcat(*observe(system(form, p), x, orders, smooth))


def _mass(k: Constants) -> Any:
    """M_RB - M_A (6, 6) of symbols."""
    import casadi as ca

    rows = zip(mass_matrix(k.body), k.added, strict=True)
    return ca.vertcat(*(ca.horzcat(*(a - b for a, b in zip(*pair, strict=True))) for pair in rows))


def _function(name: str, inputs: list[Any], outputs: list[Any]) -> Any:
    import casadi as ca

    return ca.Function(name, inputs, ca.cse([ca.densify(out) for out in outputs]))


def model_header(trace: Traced) -> str:
    """C text ``model.h`` of the closed loop: sizes, then the three functions."""
    lines = [f"/* {trace.form.word} */"]
    lines += [f"#define {name} {value}" for name, value in trace.numbers.items()]
    names = channels(trace.form.fins)
    seen = [str(names.index(SEEN.get(name, name))) for name in Seen._fields]
    lines += [f"#define NSEEN {len(seen)}", f"static const int SEEN_AT[NSEEN] = {{{', '.join(seen)}}};"]
    for function in trace.functions.values():
        text, flops = c_function(function)
        lines += [f"#define FLOPS_{function.name().upper()} {flops}", text]
    return "\n".join([*lines, ""])
