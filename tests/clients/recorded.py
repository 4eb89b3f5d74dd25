"""Recordings as tests see them: verified by the program, read by the reader of MCAP's own authors."""

import base64
import json
import os
import shutil
import subprocess
from pathlib import Path

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

import enfilade.process

_MCAP = Path(__file__).parent / "mcap"


def verify(file, *before):
    """The exit code, the report on stdout (None: nothing), and stderr."""
    done = subprocess.run([enfilade.process.find_program(), "replay", *before, file, "--verify"],
                          capture_output=True, text=True, timeout=300)
    return done.returncode, json.loads(done.stdout) if done.stdout else None, done.stderr


def other_reader(test, file, *arguments):
    """Return the output of the other reader. Without it the test is skipped, or in CI fails."""
    if not shutil.which("node") or not (_MCAP / "node_modules").is_dir():
        if os.environ.get("CI"):
            test.fail(f"no other reader of MCAP: npm ci in {_MCAP}")
        test.skipTest(f"npm ci in {_MCAP} brings the other reader")
    done = subprocess.run(["node", _MCAP / "read_recording.mjs", *arguments, file],
                          capture_output=True, text=True, timeout=300)
    test.assertEqual(done.returncode, 0, done.stderr)
    return json.loads(done.stdout)


def messages(test, file, *topics):
    """(topic, seconds, message) of the topics, or of all, by the schemas that the file carries."""
    read = other_reader(test, file, "--messages")
    types = {}
    for topic, channel in read["channels"].items():
        described = descriptor_pb2.FileDescriptorSet.FromString(
            base64.b64decode(channel["schema"]))
        pool = descriptor_pool.DescriptorPool()
        for one in described.file:
            pool.Add(one)
        kind = pool.FindMessageTypeByName(channel["type"])
        make = getattr(message_factory, "GetMessageClass", None)
        types[topic] = make(kind) if make else message_factory.MessageFactory(pool).GetPrototype(kind)
    return [(topic, time, types[topic].FromString(base64.b64decode(data)))
            for topic, time, data in read["messages"] if not topics or topic in topics]
