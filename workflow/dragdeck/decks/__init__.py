"""Input scripts and the other files that a run starts from."""

DECK_FILE = "in.liggghts"
CASE_FILE = "case.json"
COLUMNS_FILE = "columns.json"
"""Files of a run's folder, beside its particles and meshes."""

RUN_FILE, OUTCOME_FILE = "run.json", "outcome.json"
"""How the run ended, once it is complete; and however it ended, of a run that may fail."""

END = "DRAGDECK END"
"""What LIGGGHTS prints when it comes to the last line of a deck."""

PACKING_FILE = "packing.restart"
"""What a filling leaves for the runs that start from its bed."""

WORKPIECE_MESH = "workpiece.stl"
"""The workpiece of a process run, or the first of several."""
