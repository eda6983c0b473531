"""An extension of Sphinx: notebooks are pages, with the output that they store."""

from collections.abc import Iterator

import nbformat
from docutils import nodes
from myst_parser.parsers.sphinx_ import MystParser
from nbformat import NotebookNode
from sphinx.application import Sphinx


class NotebookParser(MystParser):
    """Reads a notebook as Markdown."""

    supported = ("ipynb",)

    def parse(self, inputstring: str, document: nodes.document) -> None:
        """Fill the document."""
        cells = nbformat.reads(inputstring, as_version=4).cells
        super().parse("\n\n".join(part for cell in cells for part in _parts(cell)), document)


def _parts(cell: NotebookNode) -> Iterator[str]:
    if cell.cell_type != "code":
        yield cell.source
        return
    yield f"```python\n{cell.source}\n```"
    for output in cell.outputs:
        data = output.get("data", {"text/plain": output.get("text", "")})
        if "image/png" in data:
            yield f"![plot](data:image/png;base64,{''.join(data['image/png'].split())})"
        elif "text/html" in data:
            table = data["text/html"].replace('border="1" class="dataframe"', 'class="table"')
            table = table.replace("<th></th>", "<td></td>")  # an empty head has no name
            scrolled = f'<div class="pst-scrollable-table-container">{table}</div>'
            yield f"```{{raw}} html\n{scrolled}\n```"
        else:
            yield f"```text\n{data['text/plain']}\n```"


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the ending and its parser."""
    app.add_source_suffix(".ipynb", "ipynb")
    app.add_source_parser(NotebookParser)
    return {"parallel_read_safe": True}
