"""The script of the README's quick start, on the bundled building."""

import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

README = Path(__file__).resolve().parents[2] / "README.md"


class QuickStart(unittest.TestCase):
    def test_the_walk_script_runs_as_it_is_written(self):
        section = README.read_text(encoding="utf-8").split("## Quick start: tests in CI", 1)[1]
        script = re.search(r"```\n(\{.*?)```", section, re.S).group(1)
        with tempfile.TemporaryDirectory() as folder:
            walk = Path(folder, "walk.jsonl")
            walk.write_text(script, encoding="utf-8")
            done = subprocess.run(
                [os.environ["ENFILADE"], "replay", os.environ["ENFILADE_BUILDING"], walk, "--out",
                 Path(folder, "out"), "--strict"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(Path(folder, "out", "frames", "first_room.png").exists(), done.stderr)
