"""The commands of ``dragchain`` that a calibration uses."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_calibration(commands: Commands) -> None:
    """Add the commands ``record``, ``calibrate``, ``trials`` and ``synthesise``."""
    record = commands.add_parser("record", help="check a measured drop test and find its impacts")
    record.set_defaults(action=_record)
    _file(record, "record", "the CSV of force over time")
    record.add_argument("--fall-time", type=float, required=True, metavar="S", help="free fall, s")
    record.add_argument("--out", type=Path, required=True, metavar="FILE", help="record.json")

    calibrate = commands.add_parser("calibrate", help="fit the restitution to a drop test")
    calibrate.set_defaults(action=_calibrate)
    _file(calibrate, "record", "the CSV of force over time")
    calibrate.add_argument("--drops", type=Path, required=True, help="drops.json of the sweep")
    calibrate.add_argument("--out", type=Path, required=True, metavar="DIR", help="its folder")

    trials = commands.add_parser("trials", help="recover known restitutions from made-up records")
    trials.set_defaults(action=_trials)
    trials.add_argument("--drops", type=Path, required=True, help="drops.json of the sweep")
    trials.add_argument("--trials", type=Path, required=True, help="drops.json of the trials")
    trials.add_argument("--seed", type=int, default=1, help="of sensors and noise")
    trials.add_argument("--records", type=int, default=1, help="records of each drop")
    trials.add_argument("--out", type=Path, required=True, metavar="FILE", help="trials.json")

    page = commands.add_parser("calibration-report", help="draw the figures and write the page")
    page.set_defaults(action=_page)
    _file(page, "record", "the CSV of force over time")
    page.add_argument("folder", type=Path, metavar="DIR", help="folder of the calibration")

    made = commands.add_parser("synthesise", help="write a record of a simulated drop")
    made.set_defaults(action=_synthesise)
    made.add_argument("--trials", type=Path, required=True, help="drops.json of the trials")
    made.add_argument("--drop", default="trial-001", help="which of them")
    made.add_argument("--rate", type=float, default=500e3, metavar="HZ", help="samples a second")
    made.add_argument("--noise", type=float, default=0.1, metavar="N", help="standard deviation")
    made.add_argument("--offset", type=float, default=0.0, metavar="N", help="constant offset")
    made.add_argument("--drift", type=float, default=0.0, metavar="N/S", help="drift")
    made.add_argument("--resolution", type=float, default=0.01, metavar="N", help="rounded to it")
    made.add_argument("--seed", type=int, default=1, help="of noise and phase")
    made.add_argument("--out", type=Path, required=True, metavar="FILE", help="the CSV")


def _file(parser: argparse.ArgumentParser, name: str, text: str) -> None:
    parser.add_argument(name, type=Path, metavar=name.upper(), help=text)


def _record(options: argparse.Namespace) -> None:
    from dragchain.calibration import write_record

    write_record(options.record, options.fall_time, options.out)


def _calibrate(options: argparse.Namespace) -> None:
    import json

    from dragchain.calibration import write_calibration

    result = json.loads(write_calibration(options.record, options.drops, options.out).read_text())
    fit, put = result["fit"], result["put"]
    print(f"put restitution: {put['value']:g} into {put['field'].removesuffix('.restitution')}")
    print(f"  95 % interval {fit['low']:.4f} to {fit['high']:.4f}")
    print(
        f"  the ball then rebounds with {result['effective']:.4f}; measured "
        f"{result['measured']['value']:.4f}"
    )


def _trials(options: argparse.Namespace) -> None:
    from dragchain.calibration import write_trials

    write_trials(options.drops, options.trials, options.seed, options.records, options.out)


def _page(options: argparse.Namespace) -> None:
    from dragchain.calibration_report import write_report

    write_report(options.record, options.folder)


def _synthesise(options: argparse.Namespace) -> None:
    from dragchain.calibration import write_synthetic
    from dragchain.synthetic import Sensor

    sensor = Sensor(options.rate, options.noise, options.offset, options.drift, options.resolution)
    write_synthetic(options.trials, options.drop, sensor, options.seed, options.out)
