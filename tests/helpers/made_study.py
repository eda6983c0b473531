"""The small study with some of its fields changed."""

from collections.abc import Callable, Mapping
from typing import Any

from paths import SMALL_STUDY

from dragdeck.cases.case import Case
from dragdeck.study.model import Study
from dragdeck.study.yaml import read_yaml

Load = Callable[..., list[Case]]
Made = Callable[..., Case]


def put(data: dict[str, Any], changes: Mapping[str, Any]) -> None:
    """Set fields by their dotted names; a block of the same kind keeps what it is not given."""
    for name, value in changes.items():
        *above, last = name.split(".")
        block = data
        for part in above:
            block = block.setdefault(part, {})
        old = block.get(last)
        merged = not above and isinstance(old, dict) and isinstance(value, Mapping)
        merged = merged and value.get("kind") == old.get("kind")
        block[last] = {**old, **value} if merged else value


def plain_study(changes: Mapping[str, Any]) -> dict[str, Any]:
    """The small study as ``case.json`` has it, with these fields changed."""
    data: dict[str, Any] = dict(read_yaml(SMALL_STUDY))
    put(data, {"fidelity": data.pop("fidelities")["quick"], **changes})
    return Study.model_validate(data).plain()
