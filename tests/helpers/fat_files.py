"""A run's contacts as a plain deck would write them: more columns, in another order."""

import json
import shutil
from collections.abc import Iterator
from itertools import islice
from pathlib import Path


def fatten(run: Path, target: Path) -> None:
    """Copy a run without its tables; its contact dumps get a column that nobody reads.

    What was written stays as it was, digit by digit: the columns come in reverse order, between
    two that number the rows.
    """
    shutil.copytree(run, target, ignore=shutil.ignore_patterns("tables", "figures", "as_run"))
    content = json.loads((run / "columns.json").read_text())
    for name in ("contacts", "workpiece_contacts"):
        output = content["outputs"][name]
        file = output["pattern"].format(part=1)
        with (run / file).open() as lines, (target / file).open("w") as out:
            out.writelines(_fat(lines))
        for columns, more in (("columns", "more"), ("engine_columns", "c_more")):
            output[columns] = [f"{more}[1]", *reversed(output[columns]), f"{more}[2]"]
    (target / "columns.json").write_text(json.dumps(content))


def _fat(lines: Iterator[str]) -> Iterator[str]:
    while head := list(islice(lines, 9)):
        yield from head[:8]
        names = head[8].split()[2:]
        yield f"ITEM: ENTRIES {' '.join(['c_more[1]', *reversed(names), 'c_more[2]'])} \n"
        for number, line in enumerate(islice(lines, int(head[3]))):
            yield " ".join([str(number), *reversed(line.split()), str(-number)]) + " \n"
