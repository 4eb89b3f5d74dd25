#!/usr/bin/env python3
"""Compiles the benchmark sources without output: check_syntax.py BUILD_FOLDER

BUILD_FOLDER is configured with -DENFILADE_BENCHMARKS=ON. CI does not build the benchmarks, so this is
what keeps them compiling.
"""

import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent


def compile_without_output(entry):
    command = re.sub(r" -o \S+| -M[TF] \S+| -MD", "", entry["command"])
    done = subprocess.run(command.replace(" -c ", " -fsyntax-only "), shell=True,
                          cwd=entry["directory"], capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else done.stderr


def main():
    commands = json.loads((Path(sys.argv[1]) / "compile_commands.json").read_text())
    benchmarks = {entry["file"]: entry for entry in commands
                  if Path(entry["file"]).is_relative_to(HERE)}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        errors = [error for error in pool.map(compile_without_output, benchmarks.values()) if error]
    print("\n".join(errors), end="")
    print(f"{len(benchmarks)} benchmark sources, {len(errors)} do not compile")
    sys.exit(1 if errors or not benchmarks else 0)


if __name__ == "__main__":
    main()
