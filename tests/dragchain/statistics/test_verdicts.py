"""One vocabulary of verdicts on claims, predictions and expectations."""

import pkgutil
from collections.abc import Iterator
from importlib import import_module
from typing import get_args

import dragchain
import evidence
from dragchain.statistics.estimate import Verdict
from dragdeck.parts import Part

WORDS = {"confirmed", "not confirmed", "contradicted"}
CHECKS = {"pass", "fail"}
"""Of a check of a number against its limit, which judges no claim."""

OUTSIDE = ("__main__", "dragchain.export.view")
"""Modules that are run, the latter by ParaView."""


def parts(parent: type[Part] = Part) -> Iterator[type[Part]]:
    for child in parent.__subclasses__():
        yield child
        yield from parts(child)


def test_whatever_judges_a_claim_uses_the_same_three_words() -> None:
    for package in (dragchain, evidence):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith(OUTSIDE):
                import_module(module.name)
    words = {
        part.__name__: set(get_args(part.model_fields["verdict"].annotation))
        for part in parts()
        if part.__module__.split(".")[0] in ("dragchain", "evidence")
        if "verdict" in part.model_fields
    }
    judged = {name: found - {"no expectation"} for name, found in words.items() if found != CHECKS}
    assert set(get_args(Verdict)) == WORDS
    assert "ScalingFile" in judged
    assert all(found == WORDS for found in judged.values()), judged
