"""The process of a case on a packing that stands for the settled one, and its input script."""

from dragdeck.cases.case import Case
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.physics.packing import Bed
from dragdeck.project import Project
from dragdeck.scenes.process import process_scene

BED = Bed(surface_m=0.038, top_m=0.0446)


def script(case: Case, project: Project) -> str:
    """The input script of the process, by the project's templates."""
    return deck_text(process_scene(case, BED), environment(project.templates))
