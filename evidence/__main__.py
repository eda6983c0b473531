"""Commands behind the evidence and its records: python -m evidence."""

from pathlib import Path

from dragchain.cli import MADE_BY, OUT_DIR, RUN_DIRS
from dragdeck.cli import FIDELITY, STUDY
from dragdeck.command_line import Argument, Command, Program

CORES = Argument("--cores", type=int, metavar="N",
                 help="runs at the same time (default: all cores)")  # fmt: skip


def out_in(folder: str) -> Argument:
    """The folder for the results of a command, and its default."""
    return Argument("--out", type=Path, default=Path(folder), metavar="DIR", dest="out_dir",
                    help=f"folder for the results (default: {folder})")  # fmt: skip


COMMANDS = (
    Command("verify", "run the verification suite and compare it with reference solutions",
            "Run the verification suite and compare it with reference solutions; fail if a "
            "quantity failed.", "verification.report:verify", (
        Argument("study", nargs="?", default="uhlmann2015", metavar="STUDY",
                 help="study whose materials are tested too (default: uhlmann2015)"),
        FIDELITY, out_in("results/verification/report"), CORES)),
    Command("stability", "run the points of a stability map and judge them",
            "Run the points of a stability map and judge them; write the report.",
            "stability.report:map_stability", (
        out_in("results/stability"),
        Argument("--map", type=Path, default=Path("studies/stability/map.yaml"), dest="points",
                 metavar="FILE", help="points of the map (default: studies/stability/map.yaml)"),
        CORES)),
    Command("costs", "time what each omitted option would cost",
            "Time what each option that input scripts omit would cost. Run it on a machine that "
            "does nothing else.", "costs:measure_costs", (
        STUDY, FIDELITY,
        Argument("--rounds", type=int, default=3, metavar="N",
                 help="number of runs of each option; default: 3"),
        Argument("--out", type=Path, required=True, metavar="FILE", help="costs.json; required")),
        "python -m evidence costs uhlmann2015 --out results/costs.json"),
    Command("solid-fraction", "fill bowls and measure the solid fraction of the beds",
            "Fill bowls with media of several shapes and sizes, and measure the solid fraction of "
            "the beds. The runs are in results/solid_fraction.", "solid_fraction:measure_beds", (
        Argument("out", type=Path, metavar="FILE", help="CSV file to write"),)),
    Command("compare-engines", "run a study in LIGGGHTS and in LAMMPS from the same packings",
            "Run the study quickstart in LIGGGHTS and, from the same packings, in LAMMPS, and "
            "compare ten quantities. Needs ./run setup lammps; the runs are in "
            "results/second_engine.", "second_engine.compare:compare_engines", (
        out_in("results/second_engine/comparison"),)),
    Command("predict", "run what published results are compared with, and predict these",
            "Run plates, bars, rods and heaps of published experiments, and predict their results "
            "with intervals. The runs are in results/published.",
            "published.predict:predict_published", (out_in("results/published/predicted"),)),
    Command("compare-published", "compare predictions with published results",
            "Compare predictions.csv with published.csv.",
            "published.predict:write_verdicts", (
        Argument("folder", type=Path, metavar="DIR", help="folder of both, and of runs.csv"),)),
    Command("validate", "compare the runs of a study with the publication it reproduces",
            "Compare the runs of a study with the publication it reproduces; write the report.",
            "validation.report:write_validation", (
        OUT_DIR, RUN_DIRS, MADE_BY)),
    Command("draw-scenes", "write studies of scenes drawn from a seed",
            "Write studies of small scenes drawn from a seed into the project.",
            "windows.drawn:draw_scenes", (
        Argument("seed", type=int, help="of the random numbers"),
        Argument("--scenes", type=int, default=12, metavar="N",
                 help="number of scenes; default: 12"),
        Argument("--fidelity", default="{tolerance: 0.1}", metavar="YAML",
                 help="block of each study; default: {tolerance: 0.1}"),
        Argument("--packings", type=int, default=0, metavar="N",
                 help="of the plain runs of each scene; default: none"))),
    Command("window-targets", "print the files that Snakemake makes of all windows of a study",
            "Print the files that Snakemake makes of the soft runs and of all windows of a study.",
            "windows.drawn:window_targets", (STUDY,)),
    Command("collect-windows", "collect the quantities of soft runs and of their windows",
            "Collect the quantities of soft runs and of their windows in an archive.",
            "windows.drawn:collect_windows", (
        Argument("archive", type=Path, metavar="FILE", help="tar.xz archive to write"),
        Argument("results", type=Path, nargs="+", metavar="RESULTS",
                 help="folders of the results of studies"))),
    Command("write-kinds", "write studies of each kind of scene, with a tolerance and plain",
            "Write two studies of each kind of scene into the project: one with a tolerance, and "
            "one of plain runs with other packings.", "windows.judge:write_kinds", (
        Argument("--fidelity", metavar="YAML", help="block of each study; default: %(default)s",
                 default="{tolerance: 0.2, quantity: [drag_mean, workpiece_contacts]}"),
        Argument("--packings", type=int, default=2, metavar="N",
                 help="of the plain runs; default: 2"))),
    Command("judge-windows", "compare studies with a tolerance with plain runs",
            "Compare the results of studies with a tolerance with those of plain runs, and write "
            "errors and costs.", "windows.judge:judge_tolerances", (
        Argument("out", type=Path, metavar="FILE", help="CSV file to write"),
        Argument("studies", nargs="+", metavar="STUDY", help="studies with a tolerance"))),
    Command("record-scenes", "make windows.json and stable_step.json from runs of designed scenes",
            "Make windows.json and stable_step.json, which decide tolerances and time steps, from "
            "the runs of designed scenes.", "windows.record:write_scene_records", (
        OUT_DIR,
        Argument("archives", type=Path, nargs="+", metavar="ARCHIVE",
                 help="archives of whole runs: docs/data/scenes/measures.tar.xz and "
                 "fresh.tar.xz for the records of this version"),
        Argument("--windows", type=Path, metavar="ARCHIVE",
                 help="archive of soft runs and windows, of collect-windows")),
        "python -m evidence record-scenes --out workflow/dragdeck/data docs/data/scenes/*.tar.xz"),
)  # fmt: skip

PROGRAM = Program(
    "evidence",
    "Commands behind verification suite, stability map and validation.",
    COMMANDS,
    call="python -m evidence",
)
main = PROGRAM.main

if __name__ == "__main__":
    PROGRAM()
