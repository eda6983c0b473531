"""From a study file to LIGGGHTS decks and finished runs."""

__version__ = "0.3.0"
__all__ = ["__version__"]
