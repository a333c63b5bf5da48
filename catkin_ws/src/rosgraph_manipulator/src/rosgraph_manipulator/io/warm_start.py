"""Runs a Python node whose imports are done in advance.

    python warm_start.py SCRIPT

It imports what SCRIPT imports. Then it waits for one line of JSON on its standard input:
`{"arguments": [...], "cwd": FOLDER, "log": FILE or null}`, and runs `SCRIPT arguments...`. The imports take most of a
start. Done in advance, they are over before the old node has ended, or before the next variant is known. Where the
input ends without a line, the process ends. It imports no package of ours, because it becomes somebody else's node.
"""

import ast
import contextlib
import json
import os
import runpy
import sys


def imported_by(script: str) -> list[ast.stmt]:
    """Return the import statements at the top level of a script; for a relay script of catkin, those of its target.

    Raises:
        SyntaxError, OSError, ValueError: the script can't be read as Python; its run will show the same error.
    """
    with open(script, encoding="utf-8") as file:
        body = ast.parse(file.read(), script).body
    for statement in body:
        match statement:
            case ast.Assign(targets=[ast.Name(id="python_script")], value=ast.Constant(value=str(target))):
                return imported_by(target)
    return [statement for statement in body if isinstance(statement, ast.Import | ast.ImportFrom)]


def prepare(script: str) -> None:
    """Do the script's imports. An import that fails here fails again, with its own message, when the script runs."""
    with contextlib.suppress(SyntaxError, OSError, ValueError):
        for statement in imported_by(script):
            with contextlib.suppress(Exception):
                exec(compile(ast.Module([statement], []), script, "exec"), {"__name__": "warm_start"})  # noqa: S102


def main() -> None:
    """Do the imports, wait for the command, and run the script."""
    script = sys.argv[1]
    sys.argv = [script]
    sys.path[0] = os.path.dirname(script)
    prepare(script)
    line = sys.stdin.readline()
    if not line:
        return
    role = json.loads(line)
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)
    if role["log"]:
        with contextlib.suppress(OSError):  # a full disk must not keep a robot from driving
            log = os.open(role["log"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
            os.dup2(log, 1)
            os.close(log)
    os.chdir(role["cwd"])
    sys.argv = [script, *role["arguments"]]
    if "rospy" in sys.modules:  # it takes names and remappings from the arguments when it is imported
        sys.modules["rospy"].names.reload_mappings(sys.argv)
    runpy.run_path(script, run_name="__main__")


if __name__ == "__main__":
    main()
