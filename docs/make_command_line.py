"""Writes docs/command_line.md from the program's own --help.

usage: make_command_line.py PROGRAM > docs/command_line.md
"""
import subprocess
import sys

COMMANDS = ["serve", "replay", "capture", "inspect", "diff", "export", "route", "walk", "doctor"]
HEAD = """# Command line

`build/enfilade` is the whole program, with two modules next to it that read models. stdout carries data;
stderr carries progress and logs. [Exit codes](exit_codes.md) are the same for all commands. This page is
the output of `--help`, written by `docs/make_command_line.py`.
"""


def main(program):
    print(HEAD)
    for command in COMMANDS:
        text = subprocess.run([program, command, "--help"], check=True, capture_output=True, text=True).stdout
        print(f"## {command}\n\n```\n{text.strip()}\n```\n")


if __name__ == "__main__":
    main(sys.argv[1])
