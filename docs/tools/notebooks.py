"""Run the notebooks of examples/ on the results here and store what they show."""

import nbformat
from nbclient import NotebookClient
from tables import ROOT

NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


def store_outputs() -> None:
    """Run all; the studies that they name need results. Times and places are not stored."""
    for file in NOTEBOOKS:
        notebook = nbformat.read(file, as_version=4)
        folder = {"metadata": {"path": str(ROOT / "studies")}}
        NotebookClient(notebook, record_timing=False, resources=folder).execute()
        notebook.metadata = {"kernelspec": notebook.metadata["kernelspec"]}
        nbformat.write(notebook, file)
