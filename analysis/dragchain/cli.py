"""The commands of ``dragchain``."""

import math
from pathlib import Path

from dragdeck.cli import FIDELITY, STUDY
from dragdeck.command_line import Argument, Command, Program

RUN_DIR = Argument("run_dir", type=Path, metavar="RUN_DIR",
                    help="folder of the run: results/STUDY/SCENE/RUN")  # fmt: skip
RUN_DIRS = Argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR",
                     help="folders of the runs: results/STUDY/process/RUN")  # fmt: skip
OUT_DIR = Argument("--out", type=Path, required=True, metavar="DIR", dest="out_dir",
                    help="folder for the results; required")  # fmt: skip
MADE_BY = Argument("--command", required=True, metavar="TEXT",
                    help="command that made the runs, to be recorded; required")  # fmt: skip
PACKINGS = Argument("--packings", type=int, default=1, metavar="N",
                    help="packings of the case, whose mean is to be inside the tolerance "
                    "(default: 1)")  # fmt: skip
MEASURES = Argument("measures", type=Path, nargs="+", metavar="MEASURES",
                     help="quantities.json of each run: ./run dragchain quantities")  # fmt: skip


COMMANDS = (
    Command("tables", "make the tables of a run",
            "Make the tables of a run. It reads the raw output, case.json and columns.json in "
            "RUN_DIR and writes Parquet tables and documents to RUN_DIR/tables.",
            "tables.write:write_tables", (RUN_DIR,),
            "./run dragchain tables results/uhlmann2015/process/RUN"),
    Command("chains", "find contact networks and force chains",
            "Find contact network, clusters and force chains in each frame of a process run. It "
            "reads the tables of the run and writes network.parquet, clusters.parquet and "
            "chains.parquet to RUN_DIR/tables.",
            "network.write:write_chains", (RUN_DIR,)),
    Command("loading", "map the load on the workpiece",
            "Map load, sliding distance and friction work on the workpiece and classify its "
            "contact events. It reads the tables of a process run and writes facets.parquet, "
            "contact_events.parquet, loading.json and workpiece.vtp to RUN_DIR/tables.",
            "loading.write:write_loading", (RUN_DIR,)),
    Command("quantities", "measure the quantities of a run",
            "Measure the quantities of a process run, each with its interval. It reads the tables "
            "and force chains of the run and writes "
            "quantities.json to RUN_DIR/tables. A run of a plan, and a window, gets its tables "
            "and chains first.",
            "quantities.measure:write_quantities", (RUN_DIR,)),
    Command("figures", "draw the figures of a run",
            "Draw the figures of a run. It reads the tables and writes PNG files to "
            "RUN_DIR/figures and their values to RUN_DIR/tables/findings.json.",
            "report.run_figures:write_figures", (RUN_DIR,)),
    Command("network", "write the interactive page on the contact network",
            "Write network.html, an interactive page on the contact network of a process run, to "
            "RUN_DIR. It reads the tables and force chains of the run.",
            "network_page.page:write_page", (RUN_DIR,)),
    Command("journal", "draw the figures of a run for a publication",
            "Draw the figures of a process run for a journal, as SVG, PDF and PNG in "
            "RUN_DIR/figures/journal. It reads the tables and findings.json of the run.",
            "report.journal:write_journal_figures", (RUN_DIR,)),
    Command("export", "export a run to ParaView or OVITO",
            "Export the frames of a run to ParaView, whose files OVITO reads too. It reads the "
            "tables of the run and writes VTP files for each frame with a PVD time series.",
            "export.write:write_export", (
        RUN_DIR,
        Argument("--out", type=Path, metavar="DIR",
                  help="folder for the export (default: export/paraview in RUN_DIR)"),
        Argument("--from-time", type=float, metavar="S",
                  help="simulated time of the first frame, s (default: start of the run)"),
        Argument("--to-time", type=float, metavar="S",
                  help="simulated time of the last frame, s (default: end of the run)"),
        Argument("--every", type=int, default=1, metavar="N",
                  help="export every N-th frame only (default: %(default)s)"),
        Argument("--replace", action="store_true",
                  help="overwrite an earlier export (default: refuse to)")),
            "./run dragchain export results/uhlmann2015/process/RUN --every 10"),
    Command("project", "project load and removal on a mesh of your own",
            "Project the load on the workpiece, and the removal if the study has a law, onto a "
            "mesh of your own; sums are conserved. It reads the tables of the runs and writes "
            "projection.vtu, .csv and .parquet to the folder.",
            "report.projection:write_projection", (
        OUT_DIR,
        Argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR",
                  help="folders of the runs of one case, its packings: results/STUDY/process/RUN"),
        Argument("--mesh", type=Path, required=True, metavar="FILE",
                  help="surface in the coordinates of workpiece.vtp: STL, OBJ, PLY, VTK or VTU; "
                  "required"),
        Argument("--unit", default="m", choices=("m", "cm", "mm", "um", "in"),
                  help="unit of length in that file (default: %(default)s)"),
        Argument("--smoothing-length", type=float, required=True, metavar="M",
                  help="radius of the cone over which a contact is spread, m; required")),
            "./run dragchain project --out results/removal/projection --mesh part.stl --unit mm "
            "--smoothing-length 0.002 results/removal/process/RUN"),
    Command("report", "write the report on a study",
            "Write the report on the process runs of a study. It reads their tables and figures "
            "and writes report.html and summary.csv, .parquet and .xlsx to the folder.",
            "report.study_report:write_study_report", (
        OUT_DIR, RUN_DIRS,
        Argument("--preview", type=Path, metavar="FILE",
                  help="picture of the set-up: results/STUDY/set_up.png"),
        Argument("--signal", type=Path, metavar="FILE",
                  help="measured force signal: reference.signal.file of the study"))),
    Command("compare", "compare cases of one study or of several",
            "Compare cases: differences with intervals over the packings, load maps on one scale, "
            "contact networks side by side and, for a sweep over two or more fields, main effects "
            "and interactions. It reads tables and figures of the runs and writes comparison.html, "
            "differences.csv and effects.csv to the folder.",
            "compare.report:write_comparison", (
        OUT_DIR,
        Argument("folders", type=Path, nargs="+", metavar="FOLDER",
                  help="results/STUDY with a report, or folders of process runs; differences are "
                  "from the first case")),
            "./run dragchain compare results/drag-spin --out results/compare/drag-spin"),
)  # fmt: skip
"""What a user calls."""

STEPS = (
    Command("numbers", "print the main numbers of a report",
            "Print the path of a report and the mean drag of each case. It reads summary.parquet.",
            "report.summary:main_numbers",
            (Argument("report_dir", type=Path, metavar="REPORT_DIR",
                       help="folder of the report: results/STUDY/report"),)),
    Command("tradeoff", "write the report on the speed-accuracy trade-off",
            "Estimate the error and cost of each setting from the runs of a plan. It reads "
            "quantities.json of the runs and writes report.html, tradeoff.json, runs.csv and "
            "errors.csv to the folder.",
            "tradeoff.report:write_tradeoff", (
        OUT_DIR, MEASURES, MADE_BY,
        Argument("--reference", type=Path, required=True, metavar="RUN_DIR",
                  dest="reference_run", help="folder of a run at the reference settings; required"),
        Argument("--drops", type=Path, nargs="*", default=[], metavar="RUN_DIR",
                  help="folders of drop tests with other settings (default: none)"),
        Argument("--costs", type=Path, metavar="FILE",
                  help="costs.json: measured CPU time of model and output options"),
        Argument("--plan", default="", metavar="NAME", help="name of the plan, for the report"),
        Argument("--largest-step", type=float, default=math.inf, metavar="X",
                  help="largest time step to recommend, as a fraction of the Rayleigh time "
                  "(default: no limit)"))),
    Command("extrapolate", "what a run is at the physical Young's modulus",
            "Take the quantities of a run at the physical Young's modulus from its windows, if it "
            "has any. It writes extrapolated.json to RUN_DIR/tables.",
            "windows.extrapolate:extrapolate_run", (
                RUN_DIR,
                PACKINGS,
                Argument("--round", type=Path, metavar="FILE", dest="round_file",
                          help="last round of windows of the run: ./run dragchain step windows"))),
    Command("windows", "what windows say of a run at the physical Young's modulus",
            "Estimate the quantities of a run with reduced moduli at the physical Young's modulus "
            "from its windows, and how many more windows the tolerance requires. It reads the "
            "quantities.json of the run and of its windows.",
            "windows.rounds:judge_windows", (
                RUN_DIR,
                Argument("--windows", type=Path, nargs="+", required=True, metavar="RUN_DIR",
                          help="folder of each window so far; required"),
                Argument("--tolerance", type=float, required=True, metavar="X",
                          help="relative half-width of the 95 %% confidence interval; required"),
                Argument("--quantities", nargs="+", required=True, metavar="NAME",
                          help="quantities to which the tolerance applies; required"),
                Argument("--most", type=int, required=True, metavar="N",
                          help="largest number of windows; required"),
                Argument("--lengths", type=float, required=True, metavar="X",
                          help="how many windows cost as much as the whole drag; required"),
                PACKINGS,
                Argument("--drag", type=Path, metavar="RUN_DIR",
                          help="folder of the whole drag at the physical Young's modulus, if run"),
                Argument("--out", type=Path, required=True, metavar="FILE",
                          help="file to write; required"))),
    Command("search", "choose the next settings of a search",
            "Choose the next settings of the search of a study. It reads the runs of those so far, "
            "writes points.json and search.html to results/STUDY/search, and prints unfinished, "
            "the number of the round, or complete.",
            "search.report:write_round", (
        STUDY,)),
    Command("scaling", "fit a power law to the mean drag",
            "Fit the power law of the mean drag that the block scaling of the study asks for. It "
            "reads the tables of the runs and writes scaling.json, .csv and .png to the folder.",
            "scaling.fit:write_scaling", (
        STUDY, OUT_DIR, RUN_DIRS, MADE_BY)),
    Command("crate", "pack a study as an RO-Crate",
            "Pack the inputs, runs and report of a study as an RO-Crate, with a checksum for each "
            "file. It reads the given folders and writes the crate to the folder.",
            "report.crate:write_crate", (
        OUT_DIR, RUN_DIRS,
        Argument("--report", type=Path, required=True, metavar="DIR", dest="report_dir",
                  help="folder of the study's report; required"),
        Argument("--inputs", type=Path, nargs="*", default=[], metavar="FILE",
                  help="study files, templates and meshes to include (default: none)"),
        Argument("--licence", metavar="TEXT",
                  help="licence of the results: SPDX name or address (default: unknown)"))),
    Command("calibrate", "fit coefficients to the measurements of a study",
            "Run the drop tests, heaps and drums that the calibration of a study requires, fit "
            "restitution, friction and rolling friction, and write results and report to the "
            "folder. It prints the values for the study.",
            "calibration.report:calibrate_study", (
        STUDY, FIDELITY, OUT_DIR,
        Argument("--cores", type=int, default=1, metavar="N",
                  help="runs at the same time (default: %(default)s)"))),
)  # fmt: skip
"""What the rules call: ``dragchain step NAME``."""

PROGRAM = Program(
    "dragchain", "Make tables, figures and reports from the output of LIGGGHTS.", COMMANDS, STEPS
)
main = PROGRAM.main

if __name__ == "__main__":
    PROGRAM()
