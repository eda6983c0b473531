"""Which modules stand behind a command."""

from pathlib import Path

import pytest

from dragdeck.source_hash import source_files, source_hash


def test_everything_behind_the_renderer_is_found() -> None:
    found = source_files("dragdeck.decks.render", "dragdeck.scenes.process")
    assert {"dragdeck.decks.render", "dragdeck.scenes.process", "dragdeck.mesh.shapes"} <= set(
        found
    )
    assert "dragdeck.engine.run_folder" not in found
    assert not any(name.startswith("dragchain") for name in found)


def test_lazy_imports_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "lazybox"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "late.py").write_text("")
    (package / "soon.py").write_text("def run():\n    from lazybox import late\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert "lazybox.late" in source_files("lazybox.soon")


def test_only_an_edit_behind_a_module_changes_its_hash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "toybox"
    package.mkdir()
    for name, text in {
        "__init__": "",
        "one": "from toybox.two import thing\n",
        "two": "thing = 1\n",
        "three": "from toybox import one\n",
    }.items():
        (package / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    before = {name: source_hash(f"toybox.{name}") for name in ("one", "two", "three")}
    (package / "one.py").write_text("from toybox.two import thing  # edited\n")
    after = {name: source_hash(f"toybox.{name}") for name in ("one", "two", "three")}
    assert {name for name in before if before[name] != after[name]} == {"one", "three"}


def test_a_record_that_a_module_names_is_part_of_its_hash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "databox"
    (package / "data").mkdir(parents=True)
    for name, text in {
        "__init__": "",
        "reader": 'FILE = "data/measured.json"\n',
        "user": "from databox import reader\n",
        "other": "",
    }.items():
        (package / f"{name}.py").write_text(text)
    record = package / "data/measured.json"
    record.write_text("1")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = {name: source_hash(f"databox.{name}") for name in ("user", "other")}
    record.write_text("2")
    after = {name: source_hash(f"databox.{name}") for name in ("user", "other")}
    assert [name for name in before if before[name] != after[name]] == ["user"]


@pytest.mark.parametrize("record", ["tradeoff", "stability", "stable_step"])
def test_the_advice_names_the_records_that_it_rests_on(record: str) -> None:
    named = [file for file in source_files("dragdeck.advice.forecast").values()
             if f'{record}.json"'.encode() in file.read_bytes()]  # fmt: skip
    assert named
