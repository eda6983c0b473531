"""Every JSON document that crosses a file boundary: who writes it, who reads it elsewhere."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any

from pydantic import BaseModel

WRITERS = {
    "columns": "dragdeck.decks.outputs:ColumnsFile",
    "run": "dragdeck.engine.record:RunRecord",
    "case.drop_test": "dragdeck.decks.case_file:DropTestCase",
    "case.filling": "dragdeck.decks.case_file:FillingCase",
    "case.process": "dragdeck.decks.process_case:ProcessCase",
    "drops": "dragdeck.campaigns.restitution_drops:DropsFile",
    "costs": "cost_file:TimedCosts",
    "packing": "dragchain.tables.bed:Packing",
    "stability": "dragdeck.outlook.measured:StabilityMap",
    "scaling": "dragchain.scaling.document:ScalingFile",
    "calibration": "dragchain.calibration.results:CalibrationFile",
    "measures": "dragchain.tradeoff.measures:Measures",
    "tradeoff": "dragchain.tradeoff.record:TradeoffRecord",
    "extrapolated": "dragchain.report.values:Extrapolated",
    "advice": "dragdeck.advice.forecast:AdviceFile",
    "loading": "dragchain.loading.document:Loading",
    "figures.drop_test": "dragchain.report.findings:DropFindings",
    "figures.filling": "dragchain.report.findings:FillingFindings",
    "figures.process": "dragchain.report.findings:ProcessFindings",
}
"""Name of the document: ``module:Class`` of the model that writes it."""

READERS = {
    "columns": ["dragchain.run.case:Columns"],
    "run": ["dragchain.run.completeness:RunRecord"],
    "case.drop_test": ["dragchain.run.case:Case"],
    "case.filling": ["dragchain.run.case:Case"],
    "case.process": ["dragchain.run.case:Case"],
    "drops": [
        "dragchain.calibration.simulated_drops:DropTest",
        "dragchain.calibration.simulated_drops:DropsFile",
    ],
    "costs": ["dragchain.tradeoff.changes:CostsFile"],
    "packing": ["dragdeck.scenes.scene:PackingFile"],
    "calibration": ["dragdeck.campaigns.restitution_drops:FitFile"],
    "tradeoff": ["dragdeck.outlook.measured:Tradeoff"],
    "advice": ["dragchain.report.cost_check:Advice"],
}
"""Models of the other package, which name what they read of a document."""


def model(name: str) -> type[BaseModel]:
    """The model that ``module:Class`` names."""
    module, _, attribute = name.partition(":")
    found: type[BaseModel] = getattr(import_module(module), attribute)
    return found


def schema(name: str) -> dict[str, Any]:
    """The JSON Schema of a model as it is written, and read again."""
    return model(name).model_json_schema(by_alias=True)


def unreadable(writer: Mapping[str, Any], reader: Mapping[str, Any]) -> list[str]:
    """What a reader could not take of what a writer may write: one line per place.

    Compared are keys, types, constants and choices; bounds of numbers are the models' own matter.
    """
    return list(_problems(writer, reader, writer, reader, "$"))


def _problems(
    written: Any, read: Any, writer: Mapping[str, Any], reader: Mapping[str, Any], place: str
) -> Iterator[str]:
    takes = _alternatives(read, reader)
    for form in _alternatives(written, writer):
        same = [other for other in takes if _same_kind(form, other)]
        if not same:
            yield f"{place}: {_kind(form)} is written, {', '.join(map(_kind, takes))} is read"
            continue
        found = [list(_within(form, other, writer, reader, place)) for other in same]
        yield from min(found, key=len)


def _within(
    form: Any, other: Any, writer: Mapping[str, Any], reader: Mapping[str, Any], place: str
) -> Iterator[str]:
    kept = form.get("properties", {})
    for key, wanted in other.get("properties", {}).items():
        if key in kept:
            yield from _problems(kept[key], wanted, writer, reader, f"{place}.{key}")
        elif "additionalProperties" not in form and key in other.get("required", ()):
            yield f"{place}.{key}: never written"
    for name in ("items", "additionalProperties"):
        if isinstance(form.get(name), dict) and isinstance(other.get(name), dict):
            yield from _problems(form[name], other[name], writer, reader, f"{place}[]")
    known, written = _values(other), _values(form)
    if known is not None and (written is None or not written <= known):
        yield f"{place}: {sorted(map(str, written or {'anything'}))} is written, not all is read"


def _alternatives(form: Any, document: Mapping[str, Any]) -> list[Any]:
    """The forms that a value may have, references followed."""
    if form is True or not form:
        return [{}]
    if "$ref" in form:
        return _alternatives(document["$defs"][form["$ref"].rsplit("/", 1)[-1]], document)
    several = form.get("anyOf") or form.get("oneOf")
    if several:
        return [one for entry in several for one in _alternatives(entry, document)]
    return [form]


def _values(form: Mapping[str, Any]) -> frozenset[Any] | None:
    """The only values that a form has; None: any."""
    if "const" in form:
        return frozenset([form["const"]])
    return frozenset(form["enum"]) if "enum" in form else None


def _kind(form: Mapping[str, Any]) -> str:
    return str(form.get("type", "anything"))


def _same_kind(form: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    kinds = _kind(form), _kind(other)
    return "anything" in kinds[1:] or kinds[0] == kinds[1] or kinds == ("integer", "number")
