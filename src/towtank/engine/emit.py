"""C text of a CasADi function, from its list of instructions.

The text is in terms of ``T``, one number or a pack of numbers of several trajectories (``c/lanes.h``), so the same text
serves both. It depends on the function alone: two builds give the same bytes.
"""

from __future__ import annotations

from typing import Any

from towtank.errors import TowtankError

_OPERATIONS = {
    "OP_ASSIGN": "{0}",
    "OP_ADD": "{0} + {1}",
    "OP_SUB": "{0} - {1}",
    "OP_MUL": "{0} * {1}",
    "OP_DIV": "{0} / {1}",
    "OP_NEG": "-{0}",
    "OP_SQ": "{0} * {0}",
    "OP_TWICE": "{0} + {0}",
    "OP_INV": "C(1.0) / {0}",
    "OP_SQRT": "SQRT({0})",
    "OP_FABS": "ABS({0})",
    "OP_FLOOR": "FLOOR({0})",
    "OP_SIGN": "SIGN({0})",
    "OP_FMIN": "MIN({0}, {1})",
    "OP_FMAX": "MAX({0}, {1})",
    "OP_ATAN2": "ATAN2({0}, {1})",
    "OP_LT": "LESS({0}, {1})",
    "OP_LE": "LEQ({0}, {1})",
    "OP_EQ": "SAME({0}, {1})",
    "OP_NE": "C(1.0) - SAME({0}, {1})",
    "OP_NOT": "C(1.0) - {0}",
    "OP_AND": "{0} * {1}",
    "OP_OR": "MAX({0}, {1})",
    "OP_IF_ELSE_ZERO": "WHERE({0}, {1})",
}
"""CasADi operation -> C. Truth values are 0.0 and 1.0, as CasADi has them."""

_FLOPS = {"OP_SIN": 20, "OP_COS": 20, "OP_ATAN2": 40, "OP_ASSIGN": 0}
"""Operations counted as more or less than one floating-point operation; trigonometry by convention (ENGINE notes)."""


def c_function(function: Any) -> tuple[str, int]:
    """C text of ``function`` (casadi.Function of SX) as ``static inline void name(const T *a0, ..., T *r0, ...)``.

    Returns the text and the number of floating-point operations of one call. A sine and a cosine of the same argument
    become one call. Inputs and outputs are the nonzeros, column by column.

    Raises
    ------
    TowtankError
        An operation this table does not have.
    """
    import casadi

    names = {getattr(casadi, name): name for name in (*_OPERATIONS, "OP_SIN", "OP_COS")}
    arguments = [f"const T *a{i}" for i in range(function.n_in())] + [f"T *r{i}" for i in range(function.n_out())]
    lines = [f"static inline __attribute__((always_inline)) void {function.name()}({', '.join(arguments)}) {{"]
    held: dict[int, str] = {}
    trigonometry: dict[str, str] = {}
    flops = 0
    for k in range(function.n_instructions()):
        operation, out, args = (
            function.instruction_id(k),
            function.instruction_output(k),
            function.instruction_input(k),
        )
        if operation == casadi.OP_CONST:
            held[out[0]] = f"C({float(function.instruction_constant(k))!r})"
        elif operation == casadi.OP_INPUT:
            held[out[0]] = f"a{args[0]}[{args[1]}]"
        elif operation == casadi.OP_OUTPUT:
            lines.append(f"  r{out[0]}[{out[1]}] = {held[args[0]]};")
        else:
            name = names.get(operation)
            if name is None:
                raise TowtankError(
                    f"engine: {function.name()} uses CasADi operation {operation}, which has no C text. Use +, -, *, / "
                    "and the functions of ops only."
                )
            flops += _FLOPS.get(name, 1)
            values = [held[j] for j in args]
            if name in ("OP_SIN", "OP_COS"):
                pair = trigonometry.setdefault(values[0], f"{k}")
                if pair == f"{k}":
                    lines.append(f"  T s{k}, c{k}; SINCOS({values[0]}, &s{k}, &c{k});")
                held[out[0]] = f"{'s' if name == 'OP_SIN' else 'c'}{pair}"
            else:
                lines.append(f"  T t{k} = {_OPERATIONS[name].format(*values)};")
                held[out[0]] = f"t{k}"
    return "\n".join([*lines, "}"]), flops


def c_pattern(name: str, pattern: Any) -> str:
    """C text of a sparsity pattern (casadi.Sparsity), column by column: ``name_col`` (columns + 1), ``name_row``."""
    return "\n".join(
        [
            _table(f"{name}_col", list(pattern.colind())),
            _table(f"{name}_row", list(pattern.row())),
        ]
    )


def _table(name: str, values: list[int]) -> str:
    return f"static const int {name}[] = {{{', '.join(map(str, values or [0]))}}};"
