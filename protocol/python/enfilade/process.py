"""A server process of one's own."""

from __future__ import annotations

import atexit
import json
import os
import select
import shutil
import signal
import subprocess
import tempfile
import time
import weakref
from pathlib import Path
from typing import Any, List, Optional, Sequence, Union

from .client import Client, connect
from .errors import StartFailed

_STOPPING_SECONDS = 10.0  # from SIGTERM to SIGKILL
_running: "weakref.WeakSet[Server]" = weakref.WeakSet()


def find_program() -> str:
    """The server's program: $ENFILADE, or `enfilade` on the PATH, or the build of this checkout."""
    named = os.environ.get("ENFILADE")
    if named:
        return named
    on_path = shutil.which("enfilade")
    if on_path:
        return on_path
    for folder in Path(__file__).resolve().parents:
        built = folder / "build" / "enfilade"
        if built.is_file() and os.access(built, os.X_OK):
            return str(built)
    raise StartFailed("there is no program `enfilade`: put it on the PATH, name it by $ENFILADE, "
                      "or give program=")


def serve(scene: Union[str, Path], *arguments: str, program: Optional[str] = None,
          seconds: float = 120.0) -> "Server":
    """Serves `scene` on a free port of 127.0.0.1 and returns when clients may connect. `arguments`
    are further ones of `enfilade serve`. Raises StartFailed after `seconds`, or when it ends."""
    return Server(scene, arguments, program or find_program(), seconds)


class Server:
    """It is stopped by stop(), at the end of a `with`, and at the end of this Python; also when this
    Python is killed: the server ends when the other end of its standard input is closed."""

    def __init__(self, scene: Union[str, Path], arguments: Sequence[str], program: str,
                 seconds: float) -> None:
        self._log = tempfile.TemporaryFile()
        command: List[str] = [program, "serve", str(scene), "--listen", "127.0.0.1:0",
                              "--stop-at-end-of-input", *arguments]
        try:
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                            stderr=self._log, start_new_session=True)
        except OSError as error:
            raise StartFailed(f"cannot start {program}: {error}") from error
        _running.add(self)
        try:
            self.ready: Any = self._await_ready(time.monotonic() + seconds)
        except BaseException:
            self.stop()
            raise
        self.address: str = f"127.0.0.1:{self.ready['port']}"

    def _await_ready(self, deadline: float) -> Any:
        out = self.process.stdout
        assert out is not None
        line = b""
        while not line.endswith(b"\n"):
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([out], [], [], left)[0]:
                raise StartFailed(f"the server was not ready in time; it said:\n{self.log()}")
            piece = os.read(out.fileno(), 4096)
            if not piece:
                self.process.wait(_STOPPING_SECONDS)
                raise StartFailed(f"the server ended with {self.process.returncode}; it said:\n"
                                  f"{self.log()}")
            line += piece
        return json.loads(line)

    def log(self) -> str:
        """What it wrote to stderr so far."""
        return os.pread(self._log.fileno(), 1 << 20, 0).decode(errors="replace")

    def connect(self, *, name: str = "enfilade python", timeout: float = 30.0) -> Client:
        return connect(self.address, name=name, timeout=timeout)

    def stop(self) -> int:
        """Tells it to end, waits, kills it when it does not; its exit code."""
        _running.discard(self)
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(_STOPPING_SECONDS)
            except subprocess.TimeoutExpired:
                self.process.kill()
        code = self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                stream.close()
        self._log.close()
        return code

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, *_: Any) -> None:
        self.stop()


@atexit.register
def _stop_all() -> None:
    for server in list(_running):
        server.stop()
