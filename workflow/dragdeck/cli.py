"""The commands of ``dragdeck``."""

from pathlib import Path

from dragdeck.command_line import Argument, Command, Program

STUDY = Argument("study", metavar="STUDY", help="name of the study: a folder in studies/")
FIDELITY = Argument(
    "--fidelity", metavar="NAME",
    help="settings: draft, standard, fine, full, reference, or a name under fidelities in the "
    "study (default: those of the study)",
)  # fmt: skip
PLAN = Argument(
    "--plan", metavar="NAME",
    help="use the design points of this plan in workflow/plans/ instead of the study's cases",
)  # fmt: skip
OUT_DIR = Argument(
    "--out", type=Path, required=True, metavar="DIR", help="folder for the results; required"
)
SCENE = "drop_test, filling or process"


COMMANDS = (
    Command("check", "check a study without running it",
            "Check a study: build every input script in memory, look for LIGGGHTS, and print "
            "warnings and the expected number and cost of the runs. It writes nothing.",
            "commands:check", (
        STUDY, FIDELITY,
        Argument("--verbose", action="store_true",
                  help="also print what is expected of each run: time step, packing, clearances, "
                  "dimensionless numbers")),
            "./run dragdeck check uhlmann2015 --fidelity draft"),
    Command("explain", "explain what the input scripts model",
            "Explain what the input scripts of a study model, what they leave out, and what that "
            "would cost. It writes nothing.",
            "commands:explain", (
        STUDY, FIDELITY,
        Argument("--verbose", action="store_true",
                  help="print every run, with reasons and costs"),
        Argument("scene", nargs="?", metavar="SCENE",
                  help=f"explain one scene only: {SCENE} (default: all three)")),
            "./run dragdeck explain uhlmann2015 process"),
    Command("status", "show the progress of a study",
            "Show which runs of a study are complete, running, interrupted, failed or waiting, and "
            "how long the remaining ones will take. It writes nothing and can be called at any "
            "time.",
            "status:status", (
        STUDY, FIDELITY, PLAN,
        Argument("--verbose", action="store_true",
                  help="list every run (default: all failed, at most eight of each other state)")),
            "./run dragdeck status uhlmann2015"),
    Command("open", "open the report of a study",
            "Print the path of results/STUDY/report/report.html and open it if there is a display.",
            "status:open_report", (STUDY,)),
    Command("preview", "draw the set-up of a study",
            "Draw bowl, packing, workpiece and path of one case, even one that check refuses. It "
            "runs nothing and writes preview.png to results/STUDY.",
            "commands:preview", (
        STUDY, FIDELITY,
        Argument("--case", metavar="NAME",
                  help="case to draw, as ./run dragdeck cases lists it (default: the first)")),
            "./run dragdeck preview planetary"),
    Command("init", "make a project outside of a clone",
            "Write a project into a folder: Snakefile, configuration, profiles, the study "
            "quickstart, and the script run with the commands of a clone. Nothing is overwritten.",
            "new_project:init", (
        Argument("folder", type=Path, metavar="FOLDER", help="folder of the project"),),
            "dragdeck init my-project"),
    Command("files", "print the folder of templates and examples",
            "Print the folder in which this version of dragdeck has its templates, plans, meshes "
            "and example studies. A project uses its own if it has them.",
            "shipped:files", ()),
    Command("new", "create a study",
            "Create studies/STUDY/study.yaml, which takes the fields that it does not set from "
            "another study. From the file of a part, it is a study that runs: unit, axis, bowl, "
            "path and facets follow from the size of the part, and are stated.",
            "commands:new", (
        Argument("study", metavar="STUDY", help="name of the new study, without spaces"),
        Argument("--from", default="uhlmann2015", metavar="STUDY", dest="base",
                  help="study to extend, or file of a part: STL, OBJ, PLY, VTK, VTU or STEP "
                  "(default: %(default)s)")),
            "./run dragdeck new my-part --from uhlmann2015"),
    Command("cases", "list the cases of a study",
            "List the cases of a study with the run ids of their drop test, filling and process. "
            "It writes nothing.",
            "commands:cases", (STUDY, FIDELITY, PLAN)),
    Command("shapes", "compare clumps of spheres with their bodies",
            "List how volume, inertia and surface of clumps of spheres differ from the shapes of "
            "the media, and what they cost, by number of spheres; * marks the number in the "
            "study. It writes nothing.",
            "commands:shapes", (STUDY, FIDELITY),
            "./run dragdeck shapes cylinders"),
    Command("mesh", "count contacts that LIGGGHTS overlooks on a mesh",
            "Show at how many positions at its convex edges LIGGGHTS overlooks the contact of a "
            "sphere with a mesh: as the file is, and with the corners of its facets turned, as "
            "input scripts of dragdeck always contain them.",
            "mesh.contacts:report", (
        Argument("file", type=Path, metavar="FILE",
                  help="STL, OBJ, PLY, VTK, VTU or STEP file"),
        Argument("--unit", default="mm", metavar="UNIT",
                  help="unit of length in the file: m, cm, mm, um or in (default: %(default)s)"),
        Argument("--radius", type=float, default=0.002, metavar="M", dest="radius_m",
                  help="radius of the spheres, m (default: %(default)s)"),
        Argument("--facet-size", type=float, metavar="M", dest="facet_size_m",
                  help="edge length of the facets of a STEP file, m; required for STEP only"),
        Argument("--out", type=Path, metavar="FILE",
                  help="write the turned facets to FILE as ASCII STL, in the unit of the input")),
            "./run dragdeck mesh part.stl --out turned.stl"),
    Command("advise", "find settings for a tolerance",
            "Find the cheapest settings that keep the error of a quantity within a tolerance, and "
            "show the error and cost of each setting. It reads the measured trade-off and the "
            "speeds of earlier runs, and writes results/STUDY/advice.json.",
            "commands:advise", (
        STUDY, FIDELITY,
        Argument("--tolerance", type=float, metavar="X",
                  help="half-width of the 95 %% confidence interval, relative, from 0 to 1; for a "
                  "restitution the largest error (default: the study's, or 0.1)"),
        Argument("--quantity", metavar="NAME",
                  help="quantity to which the tolerance applies, for example drag_mean; "
                  "docs/evidence/tradeoff.md lists all (default: the study's, or drag_mean)")),
            "./run dragdeck advise uhlmann2015 --tolerance 0.05 --quantity drag_mean"),
    Command("run", "run or resume one input script",
            "Run the input script of a run folder with LIGGGHTS, or resume it from its last "
            "checkpoint, and apply the acceptance checks. It writes raw output and state.json "
            "to the folder.",
            "engine.run_folder:run_command", (
        Argument("folder", type=Path, metavar="RUN_DIR",
                  help="folder of the run: results/STUDY/SCENE/RUN"),
        Argument("--outcome", type=Path, metavar="FILE",
                  help="write the result of the run to FILE and exit with 0 even if the run is "
                  "rejected (default: exit with 1)"),
        Argument("--again", action="store_true",
                  help="start again from the beginning if the run was rejected before"),
        Argument("--patience", type=float, default=1800, metavar="S", dest="patience_s",
                  help="terminate LIGGGHTS after this many seconds without output (default: "
                  "%(default)s)")),
            "./run dragdeck run results/uhlmann2015/filling/RUN"),
    Command("audit", "check an input script that dragdeck did not write, and its dumps",
            "Check any input script of LIGGGHTS, and what its run left: overlaps, speeds, lost "
            "particles, stability of the time step, rest at the end. It needs no study and writes "
            "nothing. Exit status: 1 with an error or a warning, 2 if an input cannot be read.",
            "audit.command:audit", (
        Argument("script", nargs="?", type=Path, metavar="SCRIPT", help="input script"),
        Argument("--dump", nargs="+", default=[], metavar="PATTERN",
                  help="dump custom of the run: a file, or a pattern with * for the step"),
        Argument("--contacts", nargs="+", default=[], metavar="PATTERN",
                  help="dump local of compute pair/gran/local with id and force"),
        Argument("--log", type=Path, metavar="FILE", help="log of the run"),
        Argument("--after", type=Path, metavar="SCRIPT",
                  help="script that wrote the restart file from which this one starts"),
        Argument("--var", nargs="+", action="append", default=[], metavar=("NAME", "VALUE"),
                  help="value of a variable, as with -var of LIGGGHTS"),
        Argument("--engine", action="store_true",
                  help="also let LIGGGHTS read a copy of the script, up to a run of zero steps"),
        Argument("--select", default="DK", metavar="IDS",
                  help="apply only these rules: ids or their beginnings, separated by commas"),
        Argument("--ignore", default="", metavar="IDS", help="do not apply these rules"),
        Argument("--format", default="text", choices=("text", "json"),
                  help="format of the output (default: %(default)s)"),
        Argument("--explain", metavar="ID", help="explain a rule, with the evidence behind it")),
            "./run dragdeck audit in.script --dump 'post/*.dump' --log log.liggghts"),
)  # fmt: skip
"""What a user calls."""

STEPS = (
    Command("render", "write the input script of one run",
            "Write in.liggghts, case.json, columns.json, initial particles and meshes of one run "
            "to results/STUDY/SCENE/RUN.",
            "commands:render", (
        STUDY, FIDELITY, PLAN,
        Argument("scene", metavar="SCENE", help=f"scene of the run: {SCENE}"),
        Argument("run", metavar="RUN", help="run id, as ./run dragdeck cases lists it"),
        Argument("--packing", type=Path, metavar="FILE",
                  help="packing.json of the settled packing; required for a process"))),
    Command("set-up", "draw the set-up of a study for its report",
            "Draw the first case of a study obliquely from above, to results/STUDY/set_up.png.",
            "commands:draw_set_up", (STUDY, FIDELITY)),
)  # fmt: skip
"""What the rules call: ``dragdeck step NAME``."""

PROGRAM = Program(
    "dragdeck",
    "Write LIGGGHTS input scripts for the cases of a study, run and check them.",
    COMMANDS,
    STEPS,
)
main = PROGRAM.main

if __name__ == "__main__":
    PROGRAM()
