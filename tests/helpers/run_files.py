"""Rendered run folders that a test changes."""

import json
from pathlib import Path

from dragdeck.decks import CASE_FILE
from dragdeck.files import file_checksum


def rewrite(file: Path, text: str) -> None:
    """Replace an input file of a run as if it had been written so."""
    file.write_text(text)
    case = file.with_name(CASE_FILE)
    content = json.loads(case.read_text())
    content["files"][file.name] = file_checksum(file)
    case.write_text(json.dumps(content))


OF_EVERY_RUN = {
    "title": "made by hand", "contact_moduli": {}, "numbers": {},
    "settled": {"energy_ratio": 1e-3, "highest_m": 0.1},
    "limits": {"n_particles": 1, "mean_kinetic_energy_j": 1.0, "speed_m_s": 1.0, "why": "any"},
}  # fmt: skip
"""What every ``case.json`` has, and no test looks at."""
