"""JSON documents: a model a document, written and read by the same class."""
