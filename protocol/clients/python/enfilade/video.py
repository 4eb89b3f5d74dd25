"""Videos of pictures, written by ffmpeg."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np

from .errors import EnfiladeError


class Video:
    """An MP4 file (H.264) of colour pictures.

        with enfilade.Video("walk.mp4", fps=10) as video:
            video.add(client.frame("ann"))

    All pictures have the size of the first one. The file appears with close(), complete; without a
    picture no file appears. Needs ffmpeg."""

    def __init__(self, path: Union[str, Path], fps: float = 30.0) -> None:
        if not 0 < fps <= 1000:
            raise ValueError(f"fps: give pictures per second above 0, up to 1000, not {fps}")
        if shutil.which("ffmpeg") is None:
            raise EnfiladeError("ffmpeg is missing: install it (apt install ffmpeg)")
        self.path = Path(path)
        self.fps = fps
        self.count = 0  # pictures
        self._part = self.path.with_name(f".{self.path.name}.part-{os.getpid()}")
        self._process: Optional[subprocess.Popen] = None
        self._shape = (0, 0)

    def add(self, picture: Any) -> None:
        """Adds a Frame with "rgb", or an array height x width x 3 of uint8."""
        rgb = np.ascontiguousarray(getattr(picture, "rgb", picture))
        if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[2] != 3:
            raise ValueError("add: give a picture with \"rgb\", or height x width x 3 of uint8")
        if self._process is None:
            self._start(rgb.shape[:2])
        if rgb.shape[:2] != self._shape:
            raise ValueError(f"add: the picture has {rgb.shape[1]} x {rgb.shape[0]} pixels, the "
                             f"first one {self._shape[1]} x {self._shape[0]}")
        assert self._process is not None and self._process.stdin is not None
        try:
            self._process.stdin.write(rgb.data)
        except BrokenPipeError:
            self._fail()
        self.count += 1

    def _start(self, shape: Any) -> None:
        self._shape = shape
        command = ["ffmpeg", "-nostdin", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt",
                   "rgb24", "-video_size", f"{shape[1]}x{shape[0]}", "-framerate", f"{self.fps:g}",
                   "-i", "pipe:0", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264",
                   "-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4",
                   str(self._part)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)

    def close(self) -> None:
        """Completes the file."""
        process, self._process = self._process, None
        if process is None:
            return
        _, errors = process.communicate()
        if process.returncode != 0:
            self._part.unlink(missing_ok=True)
            raise EnfiladeError(f"{self.path}: ffmpeg failed: {errors.decode(errors='replace').strip()}")
        self._part.replace(self.path)

    def _fail(self) -> None:
        try:
            self.close()
        finally:
            self._part.unlink(missing_ok=True)
        raise EnfiladeError(f"{self.path}: ffmpeg ended early")

    def __enter__(self) -> "Video":
        return self

    def __exit__(self, kind: Any, *_: Any) -> None:
        if kind is None:
            return self.close()
        if self._process is not None:  # an exception: no file
            self._process.kill()
            self._process.communicate()
            self._process = None
            self._part.unlink(missing_ok=True)
