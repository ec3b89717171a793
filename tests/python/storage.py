"""An S3 server as a process of its own: SeaweedFS, on loopback."""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Dict, List, Optional

from port import Port
from wait import LONG_S, eventually

BUCKET = "robots"
_KEYS = ("cogmap", "cogmapsecret")
_RIGHTS = ["Admin", "Read", "Write", "List", "Tagging"]
_REQUESTS = re.compile(r'^SeaweedFS_s3_request_total\{(.*)\} (\S+)$', re.MULTILINE)
_METHOD = re.compile(r'type="(\w+)"')


def _program() -> str:
    """The program, from the package that lies beside this Python."""
    beside = Path(sys.executable).with_name("weed")
    found = str(beside) if beside.is_file() else shutil.which("weed")
    assert found is not None, "there is no weed: make object-storage-check installs it"
    return found


class Storage:
    """The server and a bucket. It can be frozen, and killed and started again on the same ports
    and objects.

    Args:
        home: Directory for its objects and its log.
    """

    def __init__(self, home: Path) -> None:
        parts = ("master", "volume", "filer", "s3")
        # Its own choice for gRPC lies where systems take the ports of outgoing connections.
        ports = {f"{part}.port{kind}": Port() for part in parts for kind in ("", ".grpc")}
        self._ports = ports
        self._metrics = Port()
        self._master = (
            f"127.0.0.1:{ports['master.port'].number}.{ports['master.port.grpc'].number}"
        )
        #: Port of its S3 interface.
        self.port = ports["s3.port"].number
        self.endpoint = f"http://127.0.0.1:{self.port}"
        self._home = home
        self._process: Optional[subprocess.Popen[bytes]] = None
        (home / "objects").mkdir()
        identity = {
            "name": _KEYS[0],
            "credentials": [{"accessKey": _KEYS[0], "secretKey": _KEYS[1]}],
            "actions": _RIGHTS,
        }
        (home / "s3.json").write_text(json.dumps({"identities": [identity]}))
        self.start()
        self._shell(f"s3.bucket.create -name {BUCKET}")

    def start(self) -> None:
        """Starts the process and waits until it answers."""
        assert self._process is None, "the S3 server runs already"
        command = [_program(), "server", f"-dir={self._home / 'objects'}", "-ip=127.0.0.1"]
        command += ["-ip.bind=127.0.0.1", "-filer", "-s3"]
        command += [f"-s3.config={self._home / 's3.json'}"]
        command += ["-s3.iam=false", "-master.volumeSizeLimitMB=256", "-volume.max=40"]
        command += ["-master.telemetry=false", f"-metricsPort={self._metrics.number}"]
        command += [f"-{name}={port.number}" for name, port in self._ports.items()]
        with (self._home / "storage.log").open("ab") as log:
            self._process = subprocess.Popen(command, stdout=log, stderr=log)
        eventually("the S3 server", self._answers)

    def environment(self, endpoint: Optional[str] = None) -> Dict[str, str]:
        """What tells a service where it is and who may write; at another endpoint, if there is one
        before it."""
        return {
            "AWS_ENDPOINT": self.endpoint if endpoint is None else endpoint,
            "AWS_ALLOW_HTTP": "true",
            "AWS_REGION": "us-east-1",
            "AWS_ACCESS_KEY_ID": _KEYS[0],
            "AWS_SECRET_ACCESS_KEY": _KEYS[1],
        }

    def requests(self) -> Dict[str, int]:
        """How many requests of each method were answered since the start of the process."""
        url = f"http://127.0.0.1:{self._metrics.number}/metrics"
        with urllib.request.urlopen(url, timeout=LONG_S) as answer:
            text: str = answer.read().decode()
        counts: Dict[str, int] = {}
        for labels, value in _REQUESTS.findall(text):
            method = _METHOD.search(labels)
            if method is not None:
                counts[method[1]] = counts.get(method[1], 0) + int(float(value))
        return counts

    def objects(self, folder: str) -> List[str]:
        """Names of the objects in a folder of the bucket, in order."""
        request = urllib.request.Request(f"{self._files(folder)}/?limit=100000")
        request.add_header("Accept", "application/json")
        with urllib.request.urlopen(request, timeout=LONG_S) as answer:
            entries = json.load(answer)["Entries"] or []
        return sorted(entry["FullPath"].rpartition("/")[2] for entry in entries)

    def remove(self, path: str) -> None:
        """Removes an object of the bucket, which no program that keeps to its rules would."""
        request = urllib.request.Request(self._files(path), method="DELETE")
        urllib.request.urlopen(request, timeout=LONG_S).close()

    def freeze(self) -> None:
        """Lets it answer nothing, with all connections open."""
        self._running().send_signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """Lets it go on."""
        self._running().send_signal(signal.SIGCONT)

    def kill(self) -> None:
        """Kills the process: no last word."""
        process, self._process = self._running(), None
        process.kill()
        process.wait()

    def close(self) -> None:
        """Ends it if it runs."""
        if self._process is not None:
            self.kill()

    def _files(self, path: str) -> str:
        """Where the server's own interface to files has an object."""
        return f"http://127.0.0.1:{self._ports['filer.port'].number}/buckets/{BUCKET}/{path}"

    def _running(self) -> subprocess.Popen[bytes]:
        assert self._process is not None, "the S3 server does not run"
        return self._process

    def _answers(self) -> bool:
        assert self._running().poll() is None, "the S3 server has ended"
        try:
            urllib.request.urlopen(self.endpoint, timeout=1)
        except urllib.error.HTTPError:
            return True  # it wants to know who asks
        except OSError:
            return False
        return True

    def _shell(self, command: str) -> None:
        arguments: List[str] = [_program(), "shell", f"-master={self._master}"]
        subprocess.run(arguments, input=command, text=True, check=True, capture_output=True)
