"""Whether a run counts as a result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

RUN_SCHEMA = 2


def refusal(record: Mapping[str, Any]) -> str | None:
    """Say why a run with this ``run.json`` does not count, or return None if it does."""
    if record.get("schema") != RUN_SCHEMA:
        return f"schema of run.json is {record.get('schema')!r}, this dragchain reads {RUN_SCHEMA}"
    if record.get("state") != "complete":
        return f"its state is {record.get('state')!r}, not 'complete'"
    checks = record.get("checks")
    if not checks:
        return (
            "run.json lists no acceptance checks, so nothing says that its outputs can be trusted"
        )
    failed = [
        f"{check['name']} (saw {check['seen']}, limit {check['limit']})"
        for check in checks
        if check["passed"] is not True
    ]
    return f"acceptance checks failed: {'; '.join(failed)}" if failed else None
