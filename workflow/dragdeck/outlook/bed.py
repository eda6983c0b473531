"""What to expect of a bed before it is run: how soft it is, how it is split among ranks."""

from dragdeck.cases.case import Case
from dragdeck.cases.ranks import cores_here
from dragdeck.scenes.filling import MOST_OVERLAP, floor_overlap, rank_split


def notes(case: Case) -> list[tuple[str, str]]:
    """What ``check`` and ``explain`` say of a fill and a process: a heading and a text each."""
    return [("overlap", _overlap(case)), ("ranks", _ranks(case))]


def _overlap(case: Case) -> str:
    overlap = floor_overlap(case.study)
    verdict = "within" if overlap <= MOST_OVERLAP else "ABOVE"
    return (
        f"{100 * overlap:.2g} % of a diameter between particles at the floor, by the weight above: "
        f"{verdict} {100 * MOST_OVERLAP:g} % (an assumption)"
    )


def _ranks(case: Case) -> str:
    parts = rank_split(case)
    if case.study.chosen_fidelity().ranks != "auto":
        return f"{case.ranks}, {parts}"
    cases = f"{case.beside} case{'s' if case.beside > 1 else ''}"
    return f"{case.ranks} (auto: {cases} on {cores_here()} cores), {parts}"
