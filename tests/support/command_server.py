"""Carries out drake-quad commands, each in a process of its own that has the imports behind it.

It is begun once for each process of tests. A request is a line of JSON on its stdin: arguments,
environment, working directory, the files that take stdout and stderr, and the seconds after which
it is ended. The answer is the exit status.
"""

import atexit
import gc
import importlib
import io
import json
import os
import signal
import sys
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Any, NoReturn

# What commands import when they begin, or soon after. The threads that this begins are OpenBLAS's
# and jemalloc's, which know of forks (pthread_atfork).
IMPORTED = (
    "drake_quad.cli.main",
    "drake_quad.simulation.run",
    "drake_quad.feasibility.work_out",
    "drake_quad.sweep.run",
    "drake_quad.report.page",
    "drake_quad.feasibility.chart",
    "scipy.stats",
    "scipy.special",
    "scipy.spatial.transform",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
)


def carry_out(request: dict[str, Any]) -> NoReturn:
    """In the child: the command as from a shell."""
    signal.alarm(request["seconds"])
    os.environ.clear()
    os.environ.update(request["environment"])
    os.chdir(request["cwd"])
    for number, name in ((0, os.devnull), (1, request["stdout"]), (2, request["stderr"])):
        flags = os.O_RDONLY if number == 0 else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
        os.dup2(os.open(name, flags, 0o600), number)
    sys.argv = ["drake-quad", *request["arguments"]]
    sys.path[0] = str(Path.cwd())  # as `python -m` has it
    from drake_quad.cli.main import main

    status: object = 0
    try:
        main()
    except SystemExit as end:
        status = end.code
    # What an interpreter does at its end, but for taking down all modules: that copies every page
    # which this process has in common with its parent, and takes longer than most commands.
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status if isinstance(status, int) else 0 if status is None else 1)


def make_ready() -> None:
    """Has here what each command would import, or load, when it begins, or soon after.

    Typer imports most of itself when it parses its first words. Compiled kernels are loaded as far
    as they are there: who compiles one has to be the command, which says so.
    """
    for name in IMPORTED:
        importlib.import_module(name)
    from typer.main import get_command

    from drake_quad.cli.main import app
    from drake_quad.simulation import precompile

    with redirect_stdout(io.StringIO()), suppress(SystemExit):
        get_command(app).main(["scenarios", "--help"], standalone_mode=False)
    missing = {id(kernel) for kernel, _ in precompile._missing(precompile._kernels())}
    for kernel, signature in precompile._signatures(precompile._kernels()):
        if id(kernel) not in missing:
            kernel.compile(signature)


def serve() -> None:
    """Until stdin ends."""
    make_ready()
    gc.freeze()  # nor does a collector in a child look at, and so copy, what is there now
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            carry_out(json.loads(line))
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)


if __name__ == "__main__":
    serve()
