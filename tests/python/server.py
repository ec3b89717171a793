"""A service as a process of its own."""

from __future__ import annotations

import signal
import subprocess
import urllib.request
from pathlib import Path
from typing import Any, List, Mapping, Optional, Sequence

import cogmap

from binary import binary, environment, run
from host import Host
from port import Port
from wait import LONG_S, eventually

#: Lines of the log that a failed test shows.
_LOG_LINES_MAX = 200


class Server:
    """A service on loopback ports and a directory of its own. It can be killed, paused and started
    again on the same ports and directory.

    Args:
        home: Directory for its store and its log.
        settings: Settings (`key=value`) beside the ports and the directory.
        token: Bearer token that its clients use, if the settings ask for one.
        variables: Environment variables beside the caller's.
        host: Where it runs.
    """

    def __init__(
        self,
        home: Path,
        settings: Sequence[str] = (),
        token: Optional[str] = None,
        variables: Optional[Mapping[str, str]] = None,
        host: Host = Host(),
    ) -> None:
        self._host = host
        self._http = Port()
        self._zenoh = Port()
        self._settings = settings
        self._token = token
        self._variables = variables or {}
        self.data = home / "data"
        self._log = home / "log"
        self._process: Optional[subprocess.Popen[bytes]] = None

    def start(self) -> None:
        """Starts the process and waits until it is ready."""
        self.launch()
        self.await_ready()

    def launch(self) -> None:
        """Starts the process without waiting for it."""
        assert self._process is None, "the service runs already"
        command = [*self._host.enter, binary(), "serve", "--data-dir", str(self.data)]
        listens = f"{self._host.listens}:{self._http.number}"
        command += ["--http", listens, "--zenoh", self.endpoint]
        for setting in self._settings:
            command += ["--set", setting]
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                command, env={**environment(), **self._variables}, stdout=log, stderr=log
            )

    def await_ready(self) -> None:
        """Waits until the process is ready."""
        process = self._process
        assert process is not None, "the service does not run"

        def ready() -> bool:
            assert process.poll() is None, f"the service ended with {process.returncode}"
            try:
                return self.client().ready()
            except OSError:
                return False

        eventually("readiness", ready)

    def kill(self) -> None:
        """Kills the process as a power cut would: no last word."""
        self._signal(signal.SIGKILL)
        assert self._ended() == -signal.SIGKILL

    def terminate(self) -> None:
        """Asks the process to end, waits for it, and expects it to end well."""
        self._signal(signal.SIGTERM)
        status = self._ended()
        assert status == 0, f"the service ended with {status} after SIGTERM"

    def pause(self) -> None:
        """Stops the process where it stands."""
        self._signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Lets a stopped process go on."""
        self._signal(signal.SIGCONT)

    def close(self) -> None:
        """Ends the process in good order if it runs; whatever happens, it is gone then."""
        process = self._process
        if process is None:
            return
        try:
            self.resume()
            self.terminate()
        finally:
            process.kill()
            process.wait()

    def _signal(self, number: signal.Signals) -> None:
        assert self._process is not None, "the service does not run"
        self._process.send_signal(number)

    def _ended(self) -> int:
        assert self._process is not None, "the service does not run"
        process, self._process = self._process, None
        try:
            return process.wait(LONG_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            raise

    @property
    def runs(self) -> bool:
        """Whether the process was started and neither ended nor killed since."""
        return self._process is not None and self._process.poll() is None

    @property
    def url(self) -> str:
        """Base of its HTTP interface."""
        return f"http://{self._host.reached}:{self._http.number}"

    @property
    def address(self) -> str:
        """Where other services reach its HTTP interface."""
        return f"{self._host.inner}:{self._http.number}"

    @property
    def endpoint(self) -> str:
        """Its Zenoh endpoint."""
        return f"tcp/{self._host.inner}:{self._zenoh.number}"

    def client(self, **options: Any) -> cogmap.Client:
        """The client's HTTP side."""
        return cogmap.Client(self.url, token=self._token, timeout_s=LONG_S, **options)

    def robot(self, agent: str, session: Optional[int] = None, **options: Any) -> cogmap.Robot:
        """A robot of the space `default`, whose close adds nothing to what a test counts."""
        options.setdefault("ends_session", False)
        return cogmap.Robot(
            "default", agent, connect=self.endpoint, session_id=session, **options
        )

    def counter(self, name: str, space: str = "default") -> int:
        """A counter of a space since the start of the process."""
        with urllib.request.urlopen(f"{self.url}/metrics", timeout=LONG_S) as answer:
            text: str = answer.read().decode()
        wanted = f'{name}{{space="{space}"}} '
        values = [line for line in text.splitlines() if line.startswith(wanted)]
        assert len(values) == 1, f"{wanted}: {values}"
        return int(values[0].split()[-1])

    def journal(self, space: str = "default") -> List[str]:
        """The entries of a journal, as JSON; the service must not run."""
        return run("export", "journal", "--data-dir", self.data, "--space", space).splitlines()

    def log_tail(self) -> str:
        """The end of its log."""
        lines = self._log.read_text(errors="replace").splitlines() if self._log.exists() else []
        return "\n".join(lines[-_LOG_LINES_MAX:])
