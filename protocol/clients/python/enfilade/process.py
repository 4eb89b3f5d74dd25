"""A server process that this Python process starts and stops."""

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
from typing import Any, List, Optional, Sequence, Set, Union

from .client import Client, connect
from .errors import StartFailed

_STOPPING_SECONDS = 10.0  # from SIGTERM to SIGKILL
_CHECK_SECONDS = 0.02
_DYING_SECONDS = 0.5  # from the end of a connection to that of its process


def find_program() -> str:
    """Finds the server's program: $ENFILADE, or `enfilade` on the PATH, or the build of a checkout:
    that of this package, or the current folder."""
    named = os.environ.get("ENFILADE")
    if named:
        return named
    on_path = shutil.which("enfilade")
    if on_path:
        return on_path
    for folder in [*Path(__file__).resolve().parents, Path.cwd()]:
        built = folder / "build" / "enfilade"
        ours = (folder / "protocol" / "enfilade.proto").is_file()
        if ours and built.is_file() and os.access(built, os.X_OK):
            return str(built)
    raise StartFailed("the program `enfilade` was not found: put it on the PATH, name it in $ENFILADE "
                      "(export ENFILADE=CHECKOUT/build/enfilade), or give program=")


def serve(scene: Union[str, Path], *arguments: str, program: Optional[str] = None,
          seconds: float = 120.0) -> "Server":
    """Serves `scene`, a model or a recording, on a free port of 127.0.0.1 and returns when clients
    may connect. `arguments` are further arguments of `enfilade serve`. Raises StartFailed after
    `seconds`, or if the server ends."""
    return Server(scene, arguments, program or find_program(), seconds)


class _Running:
    """The process of a Server. A separate object, so that the Server can be collected."""

    def __init__(self, command: List[str]) -> None:
        self.said = ""
        self.log = tempfile.TemporaryFile()
        try:
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                            stderr=self.log, start_new_session=True)
        except OSError as error:
            raise StartFailed(f"cannot start {command[0]}: {error}") from error
        self.clients: "weakref.WeakSet[Client]" = weakref.WeakSet()
        _running.add(self)

    def terminate(self) -> None:
        """Asks the process to end, without waiting. The end of its stdin also ends it."""
        if self.process.poll() is None:
            self.process.terminate()

    def wait(self) -> int:
        """Waits until it has ended, and kills it after a time limit."""
        deadline = time.monotonic() + _STOPPING_SECONDS
        while self.process.poll() is None and time.monotonic() < deadline:
            # It waits for clients that do not close; they still have its final message to read.
            for client in list(self.clients):
                client.shutdown_send()
            try:
                self.process.wait(_CHECK_SECONDS)
            except subprocess.TimeoutExpired:
                pass
        if self.process.poll() is None:
            self.process.kill()
        code = self.process.wait()
        if not self.log.closed:
            self.said = self.read_log()
        for stream in (self.process.stdin, self.process.stdout, self.log):
            if stream is not None:
                stream.close()
        _running.discard(self)
        return code

    def fate(self) -> str:
        """Returns how the process ended, for a client whose connection ended."""
        try:
            code = self.process.wait(_DYING_SECONDS)
        except subprocess.TimeoutExpired:
            return ""
        if code >= 0:
            how = f"with exit code {code}"
        else:
            how = f"by signal {-code} ({signal.strsignal(-code)})"
        last = self.read_log(end=True).strip().splitlines()[-1:]
        return f"the server ended {how}" + (f"; the last line of its log: {last[0]}" if last else "")

    def read_log(self, *, end: bool = False) -> str:
        """Returns its first megabyte, or its last 4 kB."""
        if self.log.closed:
            return self.said
        size = os.fstat(self.log.fileno()).st_size
        return os.pread(self.log.fileno(), 1 << 20,
                        max(size - 4096, 0) if end else 0).decode(errors="replace")


_running: Set[_Running] = set()


def _reap() -> None:
    """Releases servers that have ended on request."""
    for one in list(_running):
        if one.process.poll() is not None:
            one.wait()


@atexit.register
def _stop_all() -> None:
    for one in list(_running):
        one.terminate()
    for one in list(_running):
        one.wait()


class Server:
    """A running server. It is stopped by stop(), or at the end of a `with`. It is also stopped
    when no object refers to it any more, and at the end of this Python process. It ends, too, if
    this process is killed: the server ends when its stdin is closed."""

    def __init__(self, scene: Union[str, Path], arguments: Sequence[str], program: str,
                 seconds: float) -> None:
        _reap()
        command = [program, "serve", str(scene), "--listen", "127.0.0.1:0",
                   "--stop-at-end-of-input", *arguments]
        self._running = _Running(command)
        # Does not wait: a garbage collection must not block.
        weakref.finalize(self, self._running.terminate).atexit = False
        self.process = self._running.process
        try:
            self.ready: Any = self._await_ready(time.monotonic() + seconds)
            self.address: str = f"127.0.0.1:{self.ready['port']}"
        except BaseException:
            self.stop()
            raise

    def _await_ready(self, deadline: float) -> Any:
        out = self.process.stdout
        assert out is not None
        line = b""
        while not line.endswith(b"\n"):
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([out], [], [], left)[0]:
                raise StartFailed(f"the server was not ready in time; its log:\n{self.log()}")
            piece = os.read(out.fileno(), 4096)
            if not piece:
                self.process.wait(_STOPPING_SECONDS)
                raise StartFailed(f"the server ended with {self.process.returncode}; its log:\n"
                                  f"{self.log()}")
            line += piece
        try:
            ready = json.loads(line)
            int(ready["port"])
        except (ValueError, KeyError, TypeError) as error:
            raise StartFailed(f"{self.process.args[0]!r} is not an Enfilade server: its first line is "
                              f"{line[:200]!r}") from error
        return ready

    def log(self) -> str:
        """Returns its stderr so far; also after stop()."""
        return self._running.read_log()

    def connect(self, *, name: str = "enfilade python", token: str = "", timeout: float = 30.0,
                world: str = "main") -> Client:
        client = connect(self.address, name=name, token=token, timeout=timeout, world=world)
        self._running.clients.add(client)
        client._connection.fate = self._running.fate
        return client

    def stop(self) -> int:
        """Asks it to end, waits, and kills it after a time limit. Returns its exit code."""
        self._running.terminate()
        return self._running.wait()

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, *_: Any) -> None:
        self.stop()
