"""Formulas of LIGGGHTS: the value of those that need no running simulation."""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.Mod: math.fmod, ast.Pow: operator.pow,
    ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Not: operator.not_,
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge,
}  # fmt: skip
_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "sqrt": math.sqrt, "exp": math.exp, "ln": math.log, "log": math.log10, "abs": abs,
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos,
    "atan": math.atan, "atan2": math.atan2, "ceil": math.ceil, "floor": math.floor,
    "round": lambda x: math.floor(x + 0.5),
}  # fmt: skip
_AS_PYTHON = (
    (r"\^", "**"), (r"&&", " and "), (r"\|\|", " or "), (r"!(?!=)", " not "),
    (r"(?<![\w.])0+(?=\d)", ""),
)  # fmt: skip
_LONGEST = 1000


def value_of(formula: str, name: Callable[[str], float | None]) -> float | None:
    """The value of a formula; None where it needs what only a simulation knows.

    Parameters
    ----------
    formula : str
    name : callable
        The value of a word such as ``PI`` or ``v_x``, or None.
    """
    for pattern, replacement in _AS_PYTHON:
        formula = re.sub(pattern, replacement, formula)
    try:
        if len(formula) > _LONGEST:
            return None
        return float(_value(ast.parse(formula.strip(), mode="eval").body, name))
    except (ArithmeticError, KeyError, RecursionError, SyntaxError, TypeError, ValueError):
        return None


def _value(node: ast.AST, name: Callable[[str], float | None]) -> Any:
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=word):
            return name(word)
        case ast.UnaryOp(op=action, operand=inner):
            return _OPERATORS[type(action)](_value(inner, name))
        case ast.BinOp(left=left, op=action, right=right):
            return _OPERATORS[type(action)](_value(left, name), _value(right, name))
        case ast.Compare(left=left, ops=[action], comparators=[right]):
            return _OPERATORS[type(action)](_value(left, name), _value(right, name))
        case ast.BoolOp(op=ast.And(), values=parts):
            return all([_known(_value(part, name)) for part in parts])
        case ast.BoolOp(values=parts):
            return any([_known(_value(part, name)) for part in parts])
        case ast.Call(func=ast.Name(id=word), args=parts):
            return _FUNCTIONS[word](*(_value(part, name) for part in parts))
    raise ValueError(ast.dump(node))


def _known(value: float | None) -> float:
    if value is None:
        raise TypeError(value)
    return value
