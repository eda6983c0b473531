"""The documents between the packages: their schemas, and that each is read as written."""

import json

import pytest
from documents import READERS, WRITERS, schema, unreadable
from paths import ROOT
from pydantic import BaseModel

CONTRACT = ROOT / "contract"
READ = [(name, reader) for name, readers in READERS.items() for reader in readers]


@pytest.mark.parametrize("name", WRITERS)
def test_the_repository_has_the_schema_that_is_written(
    name: str, request: pytest.FixtureRequest
) -> None:
    """`pytest tests/contract --update` writes them anew."""
    file = CONTRACT / f"{name}.schema.json"
    text = json.dumps(schema(WRITERS[name]), indent=1) + "\n"
    if request.config.getoption("--update"):
        file.write_text(text)
    assert file.read_text() == text


def test_no_schema_is_left_over() -> None:
    assert {file.name.removesuffix(".schema.json") for file in CONTRACT.iterdir()} == set(WRITERS)


@pytest.mark.parametrize(("name", "reader"), READ)
def test_what_is_written_can_be_read(name: str, reader: str) -> None:
    assert unreadable(schema(WRITERS[name]), schema(reader)) == []


class Part(BaseModel):
    number: float
    note: str | None = None


class Written(BaseModel):
    name: str
    parts: list[Part]
    more: dict[str, int] = {}


class FewerKeys(BaseModel):
    parts: list[Part]
    unknown: int = 0
    more: dict[str, float]


class PartNeverNull(BaseModel):
    note: str


class NullRefused(BaseModel):
    parts: list[PartNeverNull]


class OtherType(BaseModel):
    name: int


class NeverWritten(BaseModel):
    names: str


def test_a_reader_may_name_fewer_keys_and_wider_types() -> None:
    assert unreadable(Written.model_json_schema(), FewerKeys.model_json_schema()) == []


@pytest.mark.parametrize(
    ("reader", "problem"),
    [
        (NullRefused, "$.parts[].note: null is written, string is read"),
        (OtherType, "$.name: string is written, integer is read"),
        (NeverWritten, "$.names: never written"),
    ],
)
def test_a_drift_is_named(reader: type[BaseModel], problem: str) -> None:
    assert unreadable(Written.model_json_schema(), reader.model_json_schema()) == [problem]
