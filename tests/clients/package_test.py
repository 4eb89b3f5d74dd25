"""The package as its users have it: its messages, installed by pip, and its examples."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

import enfilade
from room import RoomCase

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "protocol" / "clients" / "python"


class Package(RoomCase):
    def run_python(self, *arguments, python=sys.executable, **options):
        done = subprocess.run([python, *map(str, arguments)], capture_output=True, text=True,
                              timeout=120, **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_the_messages_are_those_of_the_proto(self):
        with tempfile.NamedTemporaryFile() as made:
            subprocess.run(["protoc", f"--proto_path={ROOT}", f"--descriptor_set_out={made.name}",
                            "protocol/enfilade.proto"], check=True, cwd=ROOT)
            embedded = (PACKAGE / "enfilade" / "messages.desc").read_bytes()
            self.assertEqual(embedded, made.read(), "build, and commit messages.desc")

    def test_pip_installs_it_without_a_network(self):
        env = self.folder / "env"
        self.run_python("-m", "venv", "--system-site-packages", env)
        python = env / "bin" / "python"
        source = self.folder / "source"  # pip builds next to the sources
        subprocess.run(["cp", "-r", str(PACKAGE), str(source)], check=True)
        self.run_python("-m", "pip", "install", "--no-build-isolation", "--no-index", "--no-deps",
                        "--disable-pip-version-check", source, python=python)
        plain = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        code = ("import enfilade, sys\n"
                "with enfilade.connect(sys.argv[1]) as client:\n"
                "    print(enfilade.__file__, client.welcome.scene.source)\n")
        output = self.run_python("-c", code, self.server.address, python=python, env=plain,
                               cwd=self.folder)
        self.assertIn(str(env), output)
        self.assertIn("room.obj", output)

    def test_the_random_walk_runs(self):
        self.need_pictures()
        output = self.run_python(PACKAGE / "examples" / "random_walk.py", self.scene, "--start", 0,
                               0.01, 0, "--steps", 5)
        self.assertIn("walked", output)

    def test_the_data_set_is_recorded(self):
        self.need_pictures()
        out = self.folder / "set"
        output = self.run_python(PACKAGE / "examples" / "record_data_set.py", self.scene, out,
                               "--start", 0, 0.01, 0, "--to", 1, 0, 0, "--size", 20, 10)
        self.assertIn("arrived", output)
        index = json.loads((out / "index.json").read_text())
        picture = np.load(out / index["pictures"][-1]["file"])
        self.assertEqual(picture["depth"].shape, (10, 20))
        self.assertIn("wall", index["names"].values())

    def test_the_contact_log_is_json(self):
        output = self.run_python(PACKAGE / "examples" / "contact_log.py", self.scene, "--start", 0, 0.01,
                               0, "--to", 8, 0, 0)
        events = [json.loads(line) for line in output.splitlines()]
        self.assertIn(("begin", "wall"), [(one["kind"], one["b_name"]) for one in events])

    def test_a_recording_is_played_and_taken_over(self):
        walk, branch = (self.folder / name for name in ("walk.mcap", "branch.mcap"))
        with enfilade.serve(self.scene, "--record", str(walk)) as server, server.connect() as client:
            client.spawn("ann", at=(0, 0.01, 0)).walk((3, 0, 0))
            client.run_until_idle()
        output = self.run_python(PACKAGE / "examples" / "replay_and_take_over.py", walk, "--tick", 60,
                               "--avatar", "ann", "--to", 0, 0, 3, "--record", branch)
        self.assertIn("ann arrived", output)
        self.assertTrue(branch.exists())


if __name__ == "__main__":
    unittest.main()
