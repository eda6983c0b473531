"""Commands of the project in processes forked from one that has imported what they need.

A fresh interpreter imports for 2 to 5 s of processor time before a command does its work, and a
small study takes 20 commands. That they start by themselves too is what tests/docs/test_commands.py
and the attacks on running commands show.
"""

import atexit
import contextlib
import functools
import gc
import json
import os
import re
import resource
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import traceback
from importlib import import_module
from pathlib import Path
from typing import NoReturn

from paths import ROOT

PACKAGES = os.pathsep.join([str(ROOT / "workflow"), str(ROOT / "analysis"), str(ROOT)])
PROGRAMS = {
    "dragdeck": "dragdeck.cli",
    "dragchain": "dragchain.cli",
    "snakemake": "snakemake.cli",
    "fuzz": "attack.fuzz",
}
PRELOADED = (
    *("dragdeck.commands", "dragdeck.engine.run_folder", "dragdeck.rules"),
    *("dragchain.tables.write", "dragchain.network.write", "dragchain.loading.write"),
    *("dragchain.report.run_figures", "dragchain.report.study_report"),
    *("meshio", "pyvista.plotting", "scipy.signal", "snakemake.cli", "trimesh"),
)
PLACE = "DRAGDECK_TESTS_PRELOADED"
"""Variable with the socket of the process that forks."""

USER = "DRAGDECK_TESTS_USER"
"""Variable with the number of the user that a call is made as, if not of the one who calls."""

CALLER = f"""#!/bin/sh
'''exec' "{sys.executable}" -IS "$0" "$@"
' '''
import json, os, resource as r, socket, sys
limits = [(n, r.getrlimit(n)) for n in (r.RLIMIT_CPU, r.RLIMIT_AS, r.RLIMIT_FSIZE, r.RLIMIT_CORE)]
server = socket.socket(socket.AF_UNIX)
server.connect(os.environ["{PLACE}"])
socket.send_fds(server, [b"\\0"], [0, 1, 2])
call = [sys.argv, os.getcwd(), dict(os.environ), limits]
server.sendall(json.dumps(call).encode() + b"\\n")
sys.exit(int(server.makefile().readline() or 1))
"""
"""A program that has its call made by that process, within its own limits. It is Python that the
shell starts, as a path in the first line may have no space."""


@functools.cache
def programs() -> tuple[Path, str]:
    """The folder with the programs, and the socket that they call; served until the tests end."""
    folder = Path(tempfile.mkdtemp(prefix="preloaded-"))
    for name in PROGRAMS:
        (folder / name).write_text(CALLER)
        (folder / name).chmod(0o755)
    server = subprocess.Popen(
        [sys.executable, __file__, folder / "socket"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([PACKAGES, str(Path(__file__).parent)])},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert server.stdout is not None and server.stdout.readline() == b"ready\n"
    atexit.register(shutil.rmtree, folder)
    atexit.register(server.communicate)
    return folder, str(folder / "socket")


def plain_environment() -> dict[str, str]:
    """An environment in which the programs are those of the interpreter."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    found = {**os.environ, "PYTHONPATH": PACKAGES, "PATH": path}
    found.pop("DISPLAY", None)
    return found


def environment() -> dict[str, str]:
    """An environment in which the programs are those of this module."""
    folder, place = programs()
    found = plain_environment()
    return found | {"PATH": os.pathsep.join([str(folder), found["PATH"]]), PLACE: place}


# --- the process that forks ----------------------------------------------------------------------


def _hashed() -> set[str]:
    """The modules whose hashes are parameters of rules."""
    rules = [file.read_text() for file in (ROOT / "workflow/rules").glob("*.smk")]
    return set(re.findall(r'"((?:dragdeck|dragchain|evidence)\.[\w.]+)"', "".join(rules)))


def _serve(place: str) -> None:
    """Make calls until the standard input ends, with the process that started this one."""
    for name in PRELOADED:
        import_module(name)
    import_module("snakemake.cli").get_argument_parser()  # which imports the plug-ins
    import_module("dragdeck.source_hash").source_files(*_hashed())  # which parses each file once
    gc.freeze()
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(place)
        server.listen(64)
        print("ready", flush=True)
        while sys.stdin not in select.select([server, sys.stdin], [], [])[0]:
            connection, _ = server.accept()
            if os.fork() == 0:
                server.close()
                _answer(connection)
            connection.close()
            with contextlib.suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass


def _answer(connection: socket.socket) -> NoReturn:
    """Make a call in a further process, say how it ended; end it if its caller ends before."""
    _, files, *_ = socket.recv_fds(connection, 1, 3)
    (program, *arguments), folder, variables, limits = json.loads(connection.makefile().readline())
    process = os.fork()
    if process:
        ended = os.pidfd_open(process)
        if connection in select.select([connection, ended], [], [])[0]:
            os.kill(process, signal.SIGTERM)
        status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        with contextlib.suppress(BrokenPipeError):
            connection.sendall(f"{status if status >= 0 else 128 - status}\n".encode())
        os._exit(0)
    connection.close()
    for place, file in enumerate(files):
        os.dup2(file, place)
        os.close(file)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(variables)
    for which, most in limits:
        resource.setrlimit(which, most)
    if user := int(variables.get(USER, 0)):
        os.setgroups([])
        os.setgid(user)
        os.setuid(user)
    sys.argv = [program, *arguments]
    sys.stdin, sys.stdout, sys.stderr = (os.fdopen(n, "rw"[n > 0]) for n in range(3))
    _end(_status(program, arguments))


def _status(program: str, arguments: list[str]) -> int:
    """Exit status of a call, as the interpreter would have it."""
    try:
        code = import_module(PROGRAMS[Path(program).name]).main(arguments)
    except SystemExit as end:
        code = end.code
    except Exception:
        traceback.print_exc()
        return 1
    if isinstance(code, str):
        print(code, file=sys.stderr)
    return code if isinstance(code, int) else int(code is not None)


def _end(status: int) -> NoReturn:
    """End as the interpreter does, but for the destructors of C++ libraries.

    Now and then they abort a forked process ("terminate called without an active exception"),
    because the threads that the libraries began before the fork are not in it.
    """
    threading._shutdown()
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:  # a full disk, or nobody reads
            status = status or 120
    os._exit(status)


if __name__ == "__main__":
    _serve(sys.argv[1])
