"""The layers of the packages, as pyproject.toml states them."""

from collections.abc import Mapping

import grimp
import pytest


def imports_of(package: str) -> dict[str, set[str]]:
    """What each module of a package imports of it."""
    graph = grimp.build_graph(package, cache_dir=None)
    return {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}


def levels_of(imports: Mapping[str, set[str]]) -> dict[str, int]:
    """Level of each module: one above the highest that it imports."""
    levels: dict[str, int] = {}

    def level(module: str, above: tuple[str, ...] = ()) -> int:
        assert module not in above, f"a cycle: {' > '.join((*above, module))}"
        if module not in levels:
            below = (level(other, (*above, module)) for other in imports[module])
            levels[module] = 1 + max(below, default=0)
        return levels[module]

    for module in imports:
        level(module)
    return levels


@pytest.mark.parametrize(
    ("package", "modules", "most"),
    [("dragdeck", 80, 15), ("dragchain", 80, 11), ("evidence", 20, 7)],
)
def test_no_cycle_and_few_levels(package: str, modules: int, most: int) -> None:
    levels = levels_of(imports_of(package))
    assert len(levels) > modules
    assert max(levels.values()) <= most
