#!/usr/bin/python3
"""Writes the seeds of the fuzz targets with binary inputs:

    PYTHONPATH=protocol/clients/python /usr/bin/python3 tests/fuzz/write_seeds.py

Seeds of scripts and HTTP requests are text files in corpus/. A fuzzer's findings are added to
corpus/NAME/ as found-WHAT.
"""

import pathlib
import struct
import subprocess
import tempfile

from google.protobuf import descriptor_pb2, message_factory, text_format

from enfilade.messages import ClientMessage

CORPUS = pathlib.Path(__file__).parent / "corpus"
ROOT = CORPUS.parent.parent.parent

SPAWN = 'command { avatar: "ann" tag: 1 spawn { at { y: 0.01 } facing: 90 } }'
BOX = "box { min { x: -0.1 y: 0.1 z: -0.1 } max { x: 0.1 y: 0.4 z: 0.1 } }"
EYES = 'eyes { avatar: "ann" fov_y: 1 near: 0.1 far: 50 forward { x: 1 } }'

SESSIONS = {
    "walk": [SPAWN, 'subscribe { contacts: true near_misses: true notices: true state: true }',
             'command { avatar: "ann" tag: 2 walk { along { x: 4.9 } along { x: 4.9 z: 3 } speed: 3 } }',
             "step { ticks: 16 avatars: true }", 'command { avatar: "ann" leave {} }', "step { ticks: 2 }"],
    "drive": [SPAWN, "step { ticks: 1 }", 'command { avatar: "ann" drive { velocity { x: 5 z: 0.5 } } }',
              "step { ticks: 16 }", 'command { avatar: "ann" drive { velocity {} } }', "step { ticks: 1 }"],
    "orders": [SPAWN, 'command { avatar: "ann" look { at { x: 1 y: 1 z: 1 } } }',
               'command { avatar: "ann" wait { seconds: 0.05 } }', 'command { avatar: "ann" capture { as: "p" } }',
               'command { avatar: "ann" jump { height: 0.3 velocity { x: 1 } } }',
               'command { avatar: "ann" fly { on: true } }', 'command { avatar: "ann" crouch { height: 1 } }',
               'command { avatar: "ann" fly { on: false } }', 'command { avatar: "ann" crouch {} }',
               "step { ticks: 16 }", "step { ticks: 16 }"],
    "chain": ['command { avatar: "ann" spawn { at { y: 0.01 } self_contact: true parts { %s } '
              'links { joint { kind: KIND_REVOLUTE anchor { y: 0.5 } axis { y: 1 } low: -1 high: 1 } part { %s } } '
              'links { parent: 0 joint { kind: KIND_PRISMATIC anchor { y: 0.5 } axis { x: 1 } } value: 0.2 '
              'part { points { x: 0.1 } points { y: 0.1 } points { z: 0.1 } points {} } } } }' % (BOX, BOX),
              "step { ticks: 1 }", 'command { avatar: "ann" drive_joints { to { value: 0.5 } to {} speed: 2 } }',
              "step { ticks: 8 }", 'command { avatar: "ann" drive_joints { to {} to { value: 0.9 } at_once: true } }',
              "step { ticks: 8 avatars: true }"],
    "bodies": [SPAWN, 'body_command { body: "door" open {} speed: 2 }', "step { ticks: 8 }",
               'body_command { body: "door" to: 0.3 }', "step { ticks: 4 }", 'body_command { body: "door" close {} }',
               "step { ticks: 4 }", 'body_command { body: "door" stop {} }', 'body_command { body: "lift" level: 1 }',
               'body_command { body: "sled" run {} }', "step { ticks: 16 }"],
    "rays": [SPAWN, "step { ticks: 1 }",
             'rays { rays { origin { y: 1 } direction { x: 1 } reach: 20 } rays { origin { y: 1 } direction { y: -1 } } }',
             'rays { rays { origin { y: 1 } direction { x: 1 } reach: 9 } only_blocked: true through_glass: true tick: 1 }',
             'rays { scan { avatar: "ann" width: 6.2 height: 0.5 columns: 12 rows: 3 } through_avatar: "ann" }',
             'rays { scan { at { y: 1 } forward { x: 1 } up { y: 1 } width: 1 columns: 5 reach: 5 } }'],
    "pictures": [SPAWN, "step { ticks: 1 }", "frame { %s width: 8 height: 8 channels: CHANNEL_RGB channels: CHANNEL_DEPTH }" % EYES,
                 "frame { free { eye { y: 2 } target { x: 1 } up { y: 1 } fov_y: 1 hide_avatar: 'ann' } width: 8 height: 6 "
                 "channels: CHANNEL_IDS channels: CHANNEL_NORMALS channels: CHANNEL_RANGE tick: 1 glass: GLASS_SOLID renderer: RENDERER_RAYS }",
                 "frame { free { eye { y: 2 } forward { x: 1 } height_y: 4 near: 1 far: 9 } width: 4 height: 4 rgb_encoding: ENCODING_PNG }",
                 "frame { eyes { avatar: 'ann' } width: 4 height: 4 intrinsics { fx: 4 fy: 4 cx: 2 cy: 2 } rgb_encoding: ENCODING_JPEG }",
                 "watch_frames { watch: 1 frame { %s width: 8 height: 8 } rate: 10 }" % EYES, "step { ticks: 8 }", "watch_frames { watch: 1 }"],
    "questions": [SPAWN, "step { ticks: 1 }", "describe {}", "describe { ids: 1 ids: 2 ids: 4 ids: 99 }", "metrics {}",
                  'hello { protocol_version: "1.0.0" client_name: "demo" capabilities: "frames" token: "t" }', ""],
    "clock": ["set_clock { free_run { speed: 2 } }", "step { ticks: 1 }", "set_clock { pause {} }", "set_clock { lockstep {} }",
              "step { ticks: 3 }", "restart {}", "step { ticks: 1 }", "bye {}"],
    "refused": ['command { avatar: "ann" spawn { at { x: 5.1 y: 1 } } }', 'command { avatar: "ann" walk { along { x: 1 } } }',
                "step { ticks: 2 }", 'command { avatar: "bob" walk { along { x: nan } speed: inf } }', 'command { avatar: "../x" leave {} }',
                'command { avatar: "ann" }', "step { ticks: 0 }", "subscribe { state: true state_rate: -1 }"],
}

# Items of recording_fuzz.cpp: the kind of each item, and the item.
ITEMS = [
    (1, "RecordedCommands", 'tick: 1 commands { avatar { avatar: "ann" spawn { at { y: 0.01 } } } }'),
    (3, "State", "tick: 1 time: 0.0166 hash: 1"),
    (2, "TickEvents", 'sequence: 1 tick: 1 contacts { tick: 1 kind: KIND_BEGIN a: 8 b: 1 a_name: "ann" b_name: "floor" } '
                      'notices { tick: 1 kind: KIND_SPAWNED avatar: "ann" id: 8 }'),
    (1, "RecordedCommands", 'tick: 2 commands { body { body: "door" open {} } }'),
    (3, "State", 'tick: 2 time: 0.0333 avatars { id: 8 name: "ann" feet { y: 0.01 } }'),
    (4, "RecordedNames", 'first_id: 1 paths: "floor" paths: "left" global_ids: "a" global_ids: ""'),
    (5, "RecordedCheckpoint", "tick: 2 state_hash: 7 world: 'none'"),
    (0, "RecordingStart", "parent { file: 'a.mcap' tick: 2 }"),
    (3, "State", "tick: 3 time: 0.05"),
]

TEXTS = {
    "tum": (0, "# a path\n0 0 1.7 0 0 0 0 1\n0.5 1 1.7 0 0 0.7071 0 0.7071\n1 1 1.7 1 0 1 0 0\n"),
    "tum-opencv": (2, "1305031102.1758 1.3563 0.6305 1.6380 0.6132 0.5962 -0.3311 -0.3986\n"),
    "poses": (1, '[{"time": 0, "eye": [0, 1.7, 0], "look_at": [1, 1.7, 0]}, {"time": 1, "eye": [1, 1.7, 0], "forward": [0, 0, -1]}]'),
    "transforms": (3, '{"camera_angle_x": 1.2, "w": 64, "h": 48, "frames": [{"file_path": "a.png", "transform_matrix": '
                      '[[1,0,0,0],[0,1,0,1.7],[0,0,1,0],[0,0,0,1]]}]}'),
    "intrinsics": (1, '{"fl_x": 50, "fl_y": 50, "cx": 32, "cy": 24, "w": 64, "h": 48, "frames": [{"transform_matrix": '
                      '[[0,0,1,3],[0,1,0,1.7],[-1,0,0,2],[0,0,0,1]], "time": 2}]}'),
}


def messages_of_recordings():
    """The classes of recording.proto by their names."""
    with tempfile.NamedTemporaryFile() as described:
        subprocess.run(["protoc", f"--proto_path={ROOT}", "--include_imports", f"--descriptor_set_out={described.name}",
                        "protocol/recording.proto"], cwd=ROOT, check=True)
        files = descriptor_pb2.FileDescriptorSet.FromString(described.read())
    return message_factory.GetMessages(files.file)


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def text(content):
    return struct.pack("<I", len(content)) + content


def write_files_of_recordings():
    kinds = messages_of_recordings()
    items = [(kind, text_format.Parse(content, kinds["enfilade.v1." + name]()).SerializeToString())
             for kind, name, content in ITEMS]
    for count in (2, 3, 5, 7, len(items)):
        write("recording", f"items-{count}", b"".join(struct.pack("<BH", kind, len(part)) + part for kind, part in items[:count]))
    schema = record(3, struct.pack("<H", 1) + text(b"s") + text(b"protobuf") + text(b"?"))
    channel = record(4, struct.pack("<HH", 1, 1) + text(b"/a") + text(b"protobuf") + text(b""))
    message = record(5, struct.pack("<HIQQ", 1, 0, 5, 5) + b"hello")
    write("mcap", "chunk", b"\x01" + schema + channel + message + message)
    write("mcap", "unknown-channel", b"\x01" + message)
    header = record(1, text(b"") + text(b"seed"))
    write("mcap", "open", b"\x00\x89MCAP0\r\n" + header + schema + channel + message)
    write("mcap", "long", b"\x00\x89MCAP0\r\n" + header + struct.pack("<BQ", 6, 1 << 62) + b"abcd")
    for place in (8, 12, 20, 100, 500, 900, 1500):
        write("checkpoint", f"changed-{place}", b"\x01" + struct.pack("<HB", place, 255) + struct.pack("<HB", place + 7, 0))
    write("checkpoint", "none", b"\x00")
    for name, (kind, content) in TEXTS.items():
        write("camera_path", name, bytes([kind]) + content.encode())


def messages(lines):
    for number, line in enumerate(lines, start=1):
        message = text_format.Parse(line, ClientMessage())
        message.request_id = number
        yield message.SerializeToString()


def write(target, name, content):
    folder = CORPUS / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(content)


def main():
    for name, lines in SESSIONS.items():
        parts = list(messages(lines))
        # Sender (bit 0), length, message: see requests_fuzz.cpp.
        write("requests", name, b"".join(struct.pack("<BH", 0, len(part)) + part for part in parts))
        write("requests", "two-" + name,
              b"".join(struct.pack("<BH", i % 2, len(part)) + part for i, part in enumerate(parts)))
        stream = b"".join(struct.pack("<II", len(part) + 4, len(part)) + part for part in parts)
        # Bit 0: the stream begins with the magic; the other bits: size of the pieces in bytes,
        # minus one.
        write("framing", name, bytes([1 | 16 << 1]) + b"ENF1" + stream)
    part = parts[0]
    write("framing", "attachment", bytes([2]) + struct.pack("<II", len(part) + 9, len(part)) + part + b"12345")
    write("framing", "too-large", bytes([0]) + struct.pack("<II", 1 << 31, 4))
    write("framing", "contradiction", bytes([0]) + struct.pack("<II", 8, 100) + b"abcd")
    write("framing", "half", bytes([0]) + struct.pack("<II", 100, 90) + b"abcd")
    write("framing", "tls", bytes([1]) + b"\x16\x03\x01\x02\x00")
    write("framing", "http", bytes([1]) + b"GET / HTTP/1.1\r\n")
    write_files_of_recordings()


if __name__ == "__main__":
    main()
