"""Array types and operations that every package uses."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragdeck.arrays import Floats as Floats
from dragdeck.arrays import Ints as Ints

Columns = Mapping[str, NDArray[Any]]
"""Columns of a table by their names, (n,) each."""


def places(ids: Ints, known: Ints) -> Ints:
    """The place of each id in `known`, whose ids are unlike; -1 where it is not there.

    By hashing: in a time linear in both.
    """
    return np.asarray(pd.Index(known).get_indexer(pd.Index(ids)), dtype=np.int64)
