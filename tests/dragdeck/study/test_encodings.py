"""Files that are no YAML of plain values."""

from pathlib import Path

import pytest

from dragdeck.errors import InputError
from dragdeck.study.yaml import read_yaml


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("title: A bowl\n".encode("utf-16"), "not UTF-8 text"),
        ("title: Schüssel\n".encode("latin-1"), "not UTF-8 text"),
        (b"title: a\x00b\n", "not YAML"),
        (b"title: !!binary aGVsbG8=\n", "a binary is no plain value"),
        (b"sweep: !!set {a, b}\n", "a set is no plain value"),
        (b"? [a, b]\n: 1\n", "not YAML"),
        (b"a: " + 5000 * b"[", "nested too deeply"),
        (5000 * b"{a: ", "nested too deeply"),
        (b"", "a study is a mapping"),
    ],
)
def test_each_is_named_with_its_file(tmp_path: Path, content: bytes, words: str) -> None:
    file = tmp_path / "study.yaml"
    file.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        read_yaml(file)
    assert caught.value.file == file


def test_a_byte_order_mark_is_no_trouble(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_bytes("title: Schüssel\n".encode("utf-8-sig"))
    assert read_yaml(file) == {"title": "Schüssel"}
