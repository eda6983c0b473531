"""Make what the pages take from records, and draw the figures: python docs/tools [OPTION].

Without options, ``docs/values.csv`` and every page are made anew (`page_parts`). ``--check`` only
says which files would change.
"""

import argparse
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2]))  # evidence is not installed

import nbformat
from figures import draw_all
from nbclient import NotebookClient
from page_parts import PageError, stale_files
from records import ROOT
from worked_examples import EXAMPLES, run_example


def main() -> int:
    """Do what the options ask for; 1 if a check found a file that is not up to date."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="change nothing, list stale files")
    parser.add_argument("--figures", action="store_true", help="draw the figures, too")
    parser.add_argument("--notebooks", action="store_true", help="run notebooks, keep their output")
    parser.add_argument("--example", choices=EXAMPLES, help="run its study, renew what it shows")
    options = parser.parse_args()
    if options.example:
        run_example(options.example)
    try:
        stale = list(stale_files())
    except PageError as error:
        sys.exit(str(error))
    for file, text in stale:
        print(file)
        if not options.check:
            file.write_text(text, encoding="utf-8")
    if options.figures:
        draw_all()
    if options.notebooks:
        store_outputs()
    return int(options.check and bool(stale))


def store_outputs() -> None:
    """Run the notebooks on the results here and store what they show, warnings left out."""
    for file in sorted((ROOT / "docs/examples").glob("*.ipynb")):
        notebook = nbformat.read(file, as_version=4)
        folder = {"metadata": {"path": str(ROOT / "studies")}}
        NotebookClient(notebook, record_timing=False, resources=folder).execute()
        for cell in notebook.cells:
            if cell.cell_type == "code":
                cell.outputs = [part for part in cell.outputs if part.get("name") != "stderr"]
        notebook.metadata = {"kernelspec": notebook.metadata["kernelspec"]}
        nbformat.write(notebook, file)


if __name__ == "__main__":
    sys.exit(main())
