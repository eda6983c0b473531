"""Hostile studies, with their templates and meshes: what `dragdeck check` says of them."""

import re
from pathlib import Path

from attack.calls import main_of, refused
from attack.ground import STUDY

REFUSED, WARNED, ACCEPTED = "refused, and named", "warned, and named", "accepted"
HARMLESS = "harmless: the same commands"

ANSWERED_IN_S = 5.0
"""A study is answered in 5 s; processor time that is allowed."""


def checked(
    project: Path, named: tuple[str, ...], study: str = STUDY, patience_s: float = ANSWERED_IN_S
) -> str:
    """What `dragdeck check` says of a study; no input may become code.

    Parameters
    ----------
    named : tuple of str
        Regular expressions, all of which a message that refuses or warns matches.
    """
    said = main_of("dragdeck", ["check", study], project, patience_s)
    assert not list(project.rglob("pwned")), f"an input became code: {said.tail}"
    if said.status == 2 and "usage:" in said.text:  # argparse refuses what looks like an option
        return REFUSED
    if refused(said, *named):
        return REFUSED
    if _made_same_commands(project, study):
        return HARMLESS
    warnings = " ".join(re.findall(r"(?ims)^warning:.*", said.text))
    matches = [re.search(name, warnings, re.IGNORECASE) for name in named]
    return WARNED if warnings and all(matches) else ACCEPTED


def _made_same_commands(project: Path, study: str) -> bool:
    """Whether input scripts with foreign text hold the commands of the harmless study.

    False: no foreign text to tell by.
    """
    data = project / "studies" / study / "study.yaml"
    text = data.read_text(encoding="utf-8", errors="replace") if data.is_file() else ""
    if not any(part in text for part in ("pwned", "{{", "a &", "aaaaaaaa")):
        return False
    unknown = main_of("dragdeck", ["step", "render", study, "drop_test", "?"], project)
    for run in sorted(set(re.findall(r"[A-Za-z0-9._-]{4,}", unknown.text))):
        main_of("dragdeck", ["step", "render", study, "drop_test", run], project)
    decks = list(project.rglob("in.liggghts"))
    assert decks, f"no input script: {unknown.tail}"
    for deck in decks:
        for line in commands(deck.read_text(encoding="utf-8")):
            foreign = "pwned" in line or "49" in line.split()[:1] or line.split()[:1] == ["b"]
            assert not foreign, f"an input became code: {line}"
    return True


def commands(deck: str) -> list[str]:
    """Commands of an input script as LIGGGHTS reads them: lines joined, then remarks removed."""
    joined = re.sub(r"&[ \t]*\n", "", deck.replace("\r", "\n"))
    lines = [re.sub(r"#.*", "", line).strip() for line in joined.split("\n")]
    return [line for line in lines if line]
