"""The command ``dragchain``."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from dragchain.calibration_cli import add_calibration
from dragchain.errors import DragchainError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        The arguments, without the command's name; those of the process if None.

    Returns
    -------
    int
        The exit status: 0, or 1 after an error that is printed to stderr. A
        wrong use of the command exits with 2.
    """
    options = _parser().parse_args(arguments)
    try:
        options.action(options)
    except (DragchainError, OSError) as error:
        print(f"dragchain: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="dragchain", description="Make tables, figures and reports of what the engine wrote."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    run_dir = argparse.ArgumentParser(add_help=False)
    run_dir.add_argument("run_dir", type=Path, metavar="RUN_DIR", help="folder of one run")

    tables = commands.add_parser(
        "tables", parents=[run_dir], help="make the tables of a run from its raw outputs"
    )
    tables.set_defaults(action=_tables)
    chains = commands.add_parser(
        "chains", parents=[run_dir], help="make the network and chain tables from the tables"
    )
    chains.set_defaults(action=_chains)
    figures = commands.add_parser(
        "figures", parents=[run_dir], help="draw the figures of a run from its tables"
    )
    figures.set_defaults(action=_figures)
    removal = commands.add_parser(
        "removal", parents=[run_dir], help="load, sliding and friction work on a tool's facets"
    )
    removal.set_defaults(action=_removal)
    export = commands.add_parser(
        "export", parents=[run_dir], help="write the frames of a run for ParaView or OVITO"
    )
    export.add_argument(
        "--to", required=True, choices=("paraview", "xyz"), help="VTP files with a PVD, or text"
    )
    export.add_argument(
        "--out", type=Path, metavar="DIR", help="its folder (default: export/TO in the run's)"
    )
    export.add_argument("--from-time", type=float, metavar="S", help="first simulated time, s")
    export.add_argument("--to-time", type=float, metavar="S", help="last simulated time, s")
    export.add_argument("--every", type=int, default=1, metavar="N", help="every N-th frame only")
    export.add_argument("--replace", action="store_true", help="write over an earlier export")
    export.set_defaults(action=_export)
    report = commands.add_parser("report", help="write the report on several runs")
    report.add_argument("--out", type=Path, required=True, metavar="DIR", help="its folder")
    report.add_argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR", help="run folders")
    report.add_argument("--advice", type=Path, metavar="FILE", help="advice.json of the study")
    report.set_defaults(action=_report)
    add_calibration(commands)
    verify = commands.add_parser("verify", help="judge the runs of the verification suite")
    verify.add_argument("--out", type=Path, required=True, metavar="DIR", help="its folder")
    verify.add_argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR", help="run folders")
    verify.set_defaults(action=_verify)
    verdict = commands.add_parser("verdict", help="fail if a quantity of the suite failed")
    verdict.add_argument("report_dir", type=Path, metavar="DIR", help="what `verify` wrote")
    verdict.set_defaults(action=_verdict)
    stability = commands.add_parser("stability", help="write the report on a stability map")
    stability.add_argument("--out", type=Path, required=True, metavar="DIR", help="its folder")
    stability.add_argument("lists", type=Path, nargs="+", metavar="POINTS", help="lists of points")
    stability.set_defaults(action=_stability)
    peaks = commands.add_parser("peaks", help="test whether chains explain the peaks of the drag")
    peaks.add_argument("--out", type=Path, required=True, metavar="DIR", help="its folder")
    peaks.add_argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR", help="run folders")
    peaks.set_defaults(action=_peaks)
    measure = commands.add_parser(
        "measure", parents=[run_dir], help="measure a run of a trade, tables and chains included"
    )
    measure.add_argument("--fill-table", type=Path, required=True, help="fill.json of its bed")
    measure.set_defaults(action=_measure)
    checks = commands.add_parser("checks", help="check the advisor's promises on other scenes")
    checks.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="the results' folder"
    )
    checks.add_argument("measures", type=Path, nargs="+", metavar="MEASURES", help="measures.json")
    checks.set_defaults(action=_checks)
    scaling = commands.add_parser("scaling", help="fit a power law to the drag over one field")
    scaling.add_argument("--out", type=Path, required=True, metavar="DIR", help="its folder")
    scaling.add_argument("--field", required=True, help="dotted name of the field")
    scaling.add_argument("--expected", type=float, metavar="N", help="exponent to compare with")
    scaling.add_argument("--source", help="where that exponent comes from")
    scaling.add_argument(
        "--within", type=float, nargs=2, metavar=("LOW", "HIGH"), help="levels it is meant for"
    )
    scaling.add_argument("--command", help="what made it, for the record")
    scaling.add_argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR", help="run folders")
    scaling.set_defaults(action=_scaling)
    trade = commands.add_parser("trade", help="write the report on a trade of speed and accuracy")
    trade.add_argument("--out", type=Path, required=True, metavar="DIR", help="its folder")
    trade.add_argument(
        "--reference", type=Path, required=True, metavar="RUN_DIR", help="a run at the reference"
    )
    trade.add_argument(
        "--drops", type=Path, nargs="*", default=[], metavar="RUN_DIR", help="drop tests"
    )
    trade.add_argument("--costs", type=Path, metavar="FILE", help="costs of what decks leave out")
    trade.add_argument("--checks", type=Path, metavar="FILE", help="checks on other scenes")
    trade.add_argument("--plan", default="", metavar="NAME", help="name of the plan")
    trade.add_argument("--command", help="what made it, for the record")
    trade.add_argument(
        "--largest-step", type=float, default=math.inf, help="over the Rayleigh time, to recommend"
    )
    trade.add_argument(
        "measures", type=Path, nargs="+", metavar="MEASURES", help="measures.json of the runs"
    )
    trade.set_defaults(action=_trade)
    validate = commands.add_parser("validate", help="set runs of a study beside its source")
    validate.add_argument("--out", type=Path, required=True, metavar="DIR", help="its folder")
    validate.add_argument("--command", default="dragchain validate", help="what made the runs")
    validate.add_argument(
        "run_dirs",
        type=Path,
        nargs="+",
        metavar="RUN_DIR",
        help="measured runs, the reference first",
    )
    validate.set_defaults(action=_validate)
    return parser


def _tables(options: argparse.Namespace) -> None:
    from dragchain.tables import write_tables

    write_tables(options.run_dir)


def _chains(options: argparse.Namespace) -> None:
    from dragchain.network import write_chains

    write_chains(options.run_dir)


def _figures(options: argparse.Namespace) -> None:
    from dragchain.figures import write_figures

    write_figures(options.run_dir)


def _removal(options: argparse.Namespace) -> None:
    from dragchain.removal import write_removal

    write_removal(options.run_dir)


def _export(options: argparse.Namespace) -> None:
    from dragchain.export.moments import Selection
    from dragchain.export.writing import write_export

    done = write_export(
        options.run_dir,
        options.to,
        options.out,
        Selection(options.from_time, options.to_time, options.every),
        replace=options.replace,
        report=print,
    )
    print(f"{done.frames} frames, {done.size / 1e6:.1f} MB: {done.file}")


def _report(options: argparse.Namespace) -> None:
    from dragchain.report import write_report

    write_report(options.out, options.run_dirs, options.advice)


def _verify(options: argparse.Namespace) -> None:
    from dragchain.verification.report import write_verification

    write_verification(options.out, options.run_dirs)


def _verdict(options: argparse.Namespace) -> None:
    from dragchain.verification.report import verdict

    print(verdict(options.report_dir))


def _stability(options: argparse.Namespace) -> None:
    from dragchain.stability_report import write_stability

    write_stability(options.out, options.lists)


def _peaks(options: argparse.Namespace) -> None:
    from dragchain.validation.peaks_report import write_peaks

    for row in write_peaks(options.out, options.run_dirs)["statements"]:
        print(f"{row['verdict']}: {row['text']}")


def _measure(options: argparse.Namespace) -> None:
    from dragchain.measures import write_measures

    write_measures(options.run_dir, options.fill_table)


def _checks(options: argparse.Namespace) -> None:
    from dragchain.checks import write_checks

    for check in write_checks(options.out, options.measures):
        scene = ", ".join(f"{name} {value}" for name, value in check.scene.items())
        error = check.error
        print(
            f"{scene or 'other beds'}: {check.quantity} within {check.tolerance:g} by"
            f" {check.setting}: {error.error:+.3f} ({error.low:+.3f} to {error.high:+.3f}),"
            f" {check.verdict}"
        )


def _scaling(options: argparse.Namespace) -> None:
    from dragchain.scaling import Expectation, write_scaling

    within = tuple(options.within) if options.within else None
    found = write_scaling(
        options.out,
        options.run_dirs,
        options.field,
        Expectation(options.expected, options.source, within),
        [options.command] if options.command else [],
    )
    print(f"{options.field}: {found['statement']}")


def _trade(options: argparse.Namespace) -> None:
    from dragchain.trade_report import write_trade

    write_trade(
        options.out,
        options.measures,
        options.reference,
        drops=options.drops,
        costs=options.costs,
        checks=options.checks,
        plan=options.plan,
        commands=[options.command] if options.command else [],
        largest_step=options.largest_step,
    )


def _validate(options: argparse.Namespace) -> None:
    from dragchain.validation.page import write_validation

    write_validation(options.out, options.run_dirs, options.command)


if __name__ == "__main__":
    sys.exit(main())
