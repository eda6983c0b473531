"""Formulas of LIGGGHTS: the value of those that need no running simulation."""

import math
import operator
import re
from collections.abc import Callable, Mapping

_TOKEN = re.compile(r"\s*(?:((?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[A-Za-z_]\w*|"
                    r"&&|\|\||[<>=!]=|[-+*/%^<>!(),]))")  # fmt: skip
_BINARY: Mapping[str, tuple[int, Callable[[float, float], float]]] = {
    "||": (1, lambda a, b: a != 0 or b != 0), "&&": (2, lambda a, b: a != 0 and b != 0),
    "==": (3, operator.eq), "!=": (3, operator.ne), "<": (4, operator.lt), "<=": (4, operator.le),
    ">": (4, operator.gt), ">=": (4, operator.ge), "+": (5, operator.add), "-": (5, operator.sub),
    "*": (6, operator.mul), "/": (6, operator.truediv), "%": (6, math.fmod), "^": (7, math.pow),
}  # fmt: skip
"""Operators with their rank, as LIGGGHTS has them; those of the same rank from left to right."""

_UNARY: Mapping[str, Callable[[float], float]] = {"-": operator.neg, "!": operator.not_}
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "sqrt": math.sqrt, "exp": math.exp, "ln": math.log, "log": math.log10, "abs": abs,
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos,
    "atan": math.atan, "atan2": math.atan2, "ceil": math.ceil, "floor": math.floor,
    "round": lambda x: math.floor(x + 0.5),
}  # fmt: skip
_LONGEST = 1000

Names = Callable[[str], float | None]
"""The value of a word such as ``PI`` or ``v_x``, or None."""


def value_of(formula: str, name: Names) -> float | None:
    """The value of a formula; None where it needs what only a simulation knows."""
    tokens = _TOKEN.findall(formula)[::-1]
    if len(formula) > _LONGEST or "".join(formula.split()) != "".join(tokens[::-1]):
        return None
    try:
        value = float(_value(tokens, name))
    except (ArithmeticError, LookupError, RecursionError, TypeError, ValueError):
        return None
    return value if math.isfinite(value) and not tokens else None


def _value(tokens: list[str], name: Names, above: int = 0) -> float:
    """The value of tokens in reverse order up to an operator of this rank or a lower one."""
    token = tokens.pop()
    if token in _UNARY:
        value = _UNARY[token](_value(tokens, name, 8))
    elif token == "(":
        (value,) = _bracket(tokens, name)
    elif tokens[-1:] == ["("]:
        tokens.pop()
        value = _FUNCTIONS[token](*_bracket(tokens, name))
    else:
        known = float(token) if token[0] in ".0123456789" else name(token)
        if known is None:
            raise ValueError(token)
        value = known
    while tokens and (rank := _BINARY.get(tokens[-1], (0,))[0]) > above:
        value = _BINARY[tokens.pop()][1](value, _value(tokens, name, rank))
    return value


def _bracket(tokens: list[str], name: Names) -> list[float]:
    """The values up to a closing bracket, which is taken too."""
    values = [_value(tokens, name)]
    while (token := tokens.pop()) == ",":
        values.append(_value(tokens, name))
    return values if token == ")" else []
