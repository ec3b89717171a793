"""An S3 server as a process of its own: SeaweedFS, on loopback."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Dict, List

from port import Port
from wait import eventually

BUCKET = "robots"
_KEYS = ("cogmap", "cogmapsecret")
_RIGHTS = ["Admin", "Read", "Write", "List", "Tagging"]

def _program() -> str:
    """The program, from the package that lies beside this Python."""
    beside = Path(sys.executable).with_name("weed")
    found = str(beside) if beside.is_file() else shutil.which("weed")
    assert found is not None, "there is no weed: make object-storage-check installs it"
    return found


class Storage:
    """The server and a bucket. It can be frozen and go on.

    Args:
        home: Directory for its objects and its log.
    """

    def __init__(self, home: Path) -> None:
        ports = {name: Port() for name in ("master", "volume", "filer", "s3")}
        self._ports = ports
        self._master = f"127.0.0.1:{ports['master'].number}"
        self.endpoint = f"http://127.0.0.1:{ports['s3'].number}"
        (home / "objects").mkdir()
        identity = {
            "name": _KEYS[0],
            "credentials": [{"accessKey": _KEYS[0], "secretKey": _KEYS[1]}],
            "actions": _RIGHTS,
        }
        config = home / "s3.json"
        config.write_text(json.dumps({"identities": [identity]}))
        command = [_program(), "server", f"-dir={home / 'objects'}", "-ip=127.0.0.1"]
        command += ["-ip.bind=127.0.0.1", "-filer", "-s3", f"-s3.config={config}"]
        command += ["-s3.iam=false", "-master.volumeSizeLimitMB=256", "-volume.max=40"]
        command += ["-master.telemetry=false"]
        command += [f"-{name}.port={port.number}" for name, port in ports.items()]
        with (home / "storage.log").open("ab") as log:
            self._process = subprocess.Popen(command, stdout=log, stderr=log)
        eventually("the S3 server", self._answers)
        self._shell(f"s3.bucket.create -name {BUCKET}")

    def environment(self) -> Dict[str, str]:
        """What tells a service where it is and who may write."""
        return {
            "AWS_ENDPOINT": self.endpoint,
            "AWS_ALLOW_HTTP": "true",
            "AWS_REGION": "us-east-1",
            "AWS_ACCESS_KEY_ID": _KEYS[0],
            "AWS_SECRET_ACCESS_KEY": _KEYS[1],
        }

    def freeze(self) -> None:
        """Lets it answer nothing, with all connections open."""
        self._process.send_signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """Lets it go on."""
        self._process.send_signal(signal.SIGCONT)

    def close(self) -> None:
        """Ends it."""
        self._process.kill()
        self._process.wait()

    def _answers(self) -> bool:
        assert self._process.poll() is None, "the S3 server has ended"
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
