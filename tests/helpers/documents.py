"""Every JSON document: the model that writes it and the models that read it elsewhere."""

from __future__ import annotations

WRITERS: dict[str, str] = {}
"""Name of the document: ``module:Class`` of its model."""

READERS: dict[str, list[str]] = {
    "case": ["dragchain.run.case:Case"],
    "columns": ["dragchain.run.case:Columns"],
}
"""Models that name what they read of a document that another module writes."""
