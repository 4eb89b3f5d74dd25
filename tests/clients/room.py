"""A room to serve: a floor, a wall at x = 5 and a column at z = 6, as in the server's own tests."""

import os
import tempfile
import unittest
from pathlib import Path

import enfilade

_BOXES = {
    "floor": ((-10, -0.5, -10), (10, 0, 10)),
    "wall": ((5, 0, -4), (5.2, 3, 4)),
    "column": ((-0.25, 0, 5.75), (0.25, 3, 6.25)),
}
_FACES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
FLOOR, WALL, COLUMN = 1, 2, 3


def obj(boxes=_BOXES) -> str:
    lines, first = [], 1
    for name, (low, high) in boxes.items():
        lines.append(f"o {name}")
        for corner in range(8):
            x, y, z = ((high if corner >> axis & 1 else low)[axis] for axis in range(3))
            lines.append(f"v {x} {y} {z}")
        lines += ["f " + " ".join(str(first + i) for i in face) for face in _FACES]
        first += 8
    return "\n".join(lines) + "\n"


def room_file(clean_up) -> Path:
    """room.obj in a folder of its own, which `clean_up` (addCleanup or addClassCleanup) takes away."""
    folder = tempfile.TemporaryDirectory()
    clean_up(folder.cleanup)
    scene = Path(folder.name) / "room.obj"
    scene.write_text(obj())
    return scene


class RoomCase(unittest.TestCase):
    """One server of the room for all tests of a class; a fresh world and client for each."""

    @classmethod
    def setUpClass(cls):
        cls.scene = room_file(cls.addClassCleanup)
        cls.folder = cls.scene.parent
        cls.server = enfilade.serve(cls.scene)
        cls.addClassCleanup(cls.server.stop)

    def setUp(self):
        self.client = self.server.connect(name="test")
        self.addCleanup(self.client.close)
        self.client.lockstep()
        self.client.restart()
        self.client.subscribe(contacts=True, notices=True)

    def need_pictures(self):
        if not self.client.renderer:
            if os.environ.get("CI"):
                self.fail("no EGL device: install libegl-mesa0 and libgl1-mesa-dri")
            self.skipTest("no EGL device")
