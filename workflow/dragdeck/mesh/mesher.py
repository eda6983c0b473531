"""Programs that mesh, each in a process of its own: their answer, or why there is none."""

from __future__ import annotations

import json
import resource
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dragdeck.errors import InputError
from dragdeck.mesh import remesher, step_mesher

_CPU_LIMIT_S = 120
"""More CPU time than any sensible part needs, s."""


def _limit_time() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (_CPU_LIMIT_S, _CPU_LIMIT_S))


def answer_of(program: str, path: Path, content: str, lengths: Sequence[float]) -> Any:
    """What a mesher writes as JSON for the content of a file and some lengths.

    Raises
    ------
    InputError
        It refuses the part in the file `path`, or ends without an answer.
    """
    with TemporaryDirectory() as folder:
        given, answer = Path(folder, "part.step"), Path(folder, "answer.json")
        given.write_text(content, encoding="latin-1")
        command = [sys.executable, "-P", program, str(given), str(answer), *map(repr, lengths)]
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=False,
            preexec_fn=_limit_time,
        )
        if done.returncode or not answer.is_file():
            raise _broken(path, done.returncode, done.stderr.decode("ascii", "replace"))
        meshed: Any = json.loads(answer.read_text(encoding="ascii"))
    if "refused" in meshed:
        problem, value, limit, remedy = meshed["refused"]
        raise InputError(problem, file=path, value=value, limit=limit, remedy=remedy)
    return meshed


def _broken(path: Path, code: int, said: str) -> InputError:
    value = (said.splitlines() or [f"the mesher ended with code {code}"])[-1]
    step = path.suffix.lower() in (".step", ".stp")
    if -code in (signal.SIGXCPU, signal.SIGKILL):
        return InputError(
            "the part takes too long to mesh",
            file=path,
            value=value,
            limit=f"{_CPU_LIMIT_S} s of CPU time",
            remedy="use a larger facet_size_m" + (" and edge_facet_size_m" if step else ""),
        )
    kind = "STEP file" if step else "surface"
    limit, remedy = f"a whole {kind}", step_mesher.EXPORT if step else remesher.OTHERWISE
    return InputError(f"the {kind} is damaged", file=path, value=value, limit=limit, remedy=remedy)
