"""Scenes of a case, on a packing that stands for the settled one; their scripts and folders."""

from pathlib import Path

from dragdeck.cases.case import Case
from dragdeck.decks.render import deck_text, write_run
from dragdeck.decks.templates import environment
from dragdeck.physics.packing import Bed
from dragdeck.project import Project
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import SceneType

BED = Bed(surface_m=0.038, top_m=0.0446)


def script(case: Case, project: Project) -> str:
    """The input script of the process, by the project's templates."""
    return deck_text(process_scene(case, BED), environment(project.templates))


def rendered(
    case: Case, project: Project, kind: SceneType = FILLING, bed: Bed | None = None
) -> Path:
    """The folder of a run of the case, which is not run yet."""
    folder = project.run_folder(case, kind)
    write_run(kind.build(case, bed), folder, environment(project.templates))
    return folder


def own_template(case: Case, text: str, name: str = "process.in.j2") -> Path:
    """Write a template of the study."""
    file = case.file.parent / "templates" / name
    file.parent.mkdir(exist_ok=True)
    file.write_text(text)
    return file
