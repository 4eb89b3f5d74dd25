#!/usr/bin/python3
"""Writes the seeds of the fuzz targets whose inputs nobody can write by hand:

    PYTHONPATH=protocol/python /usr/bin/python3 tests/fuzz/write_seeds.py

Scripts and HTTP requests are text, and seeds of their own in corpus/. What a fuzzer finds is added to
corpus/NAME/ as found-WHAT.
"""

import pathlib
import struct

from google.protobuf import text_format

from enfilade.messages import ClientMessage

CORPUS = pathlib.Path(__file__).parent / "corpus"

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
        # Who speaks (bit 0), the length, the message: see requests_fuzz.cpp.
        write("requests", name, b"".join(struct.pack("<BH", 0, len(part)) + part for part in parts))
        write("requests", "two-" + name,
              b"".join(struct.pack("<BH", i % 2, len(part)) + part for i, part in enumerate(parts)))
        stream = b"".join(struct.pack("<II", len(part) + 4, len(part)) + part for part in parts)
        # Bit 0: it begins with the magic; the rest: in pieces of how many bytes it comes, less one.
        write("framing", name, bytes([1 | 16 << 1]) + b"ENF1" + stream)
    part = parts[0]
    write("framing", "attachment", bytes([2]) + struct.pack("<II", len(part) + 9, len(part)) + part + b"12345")
    write("framing", "too-large", bytes([0]) + struct.pack("<II", 1 << 31, 4))
    write("framing", "contradiction", bytes([0]) + struct.pack("<II", 8, 100) + b"abcd")
    write("framing", "half", bytes([0]) + struct.pack("<II", 100, 90) + b"abcd")
    write("framing", "tls", bytes([1]) + b"\x16\x03\x01\x02\x00")
    write("framing", "http", bytes([1]) + b"GET / HTTP/1.1\r\n")


if __name__ == "__main__":
    main()
