"""Prints the targets of the test programs that have a test matching a regular expression.

usage: test_programs.py COMPILE_COMMANDS REGEX

Reads the names from TEST(), TEST_F(), TEST_P() and TYPED_TEST() in the sources, so that nothing has
to be built first. Prints "all" when no C++ test matches: the name may be that of a Python,
JavaScript or fuzz test, which need the program itself.
"""
import json
import re
import sys
from pathlib import Path

TEST = re.compile(r"\b(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+),\s*(\w+)\s*\)")
INCLUDE = re.compile(r'^#include "(.*)"', re.MULTILINE)
PROGRAM = re.compile(r" -o \S*/CMakeFiles/(\w+_tests)\.dir/")


def read_source(path):
    """The text of a source; of one made by a unity build, the texts of those that it includes."""
    text = path.read_text(encoding="utf-8")
    if path.parent.name != "Unity":
        return text
    return "".join(Path(source).read_text(encoding="utf-8") for source in INCLUDE.findall(text))


def main(commands, regex):
    wanted = re.compile(regex)
    programs = set()
    for command in json.loads(Path(commands).read_text()):
        program = PROGRAM.search(command["command"])
        if not program or program[1] in programs or command["file"].endswith("cmake_pch.hxx.cxx"):
            continue
        names = TEST.findall(read_source(Path(command["file"])))
        if any(wanted.search(f"{suite}.{name}") for suite, name in names):
            programs.add(program[1])
    print("\n".join(sorted(programs)) or "all")


if __name__ == "__main__":
    main(*sys.argv[1:])
