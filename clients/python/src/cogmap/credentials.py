"""How a robot shows who it is, and knows whom it talks to."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from typing import Any, Dict, Optional, Union

import zenoh

from .errors import InvalidValue

_Path = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class Credentials:
    """What a robot shows to the Zenoh router, and how it knows the router.

    `docs/security.md` of the project has an example with the files of both sides.

    Raises:
        InvalidValue: A user without a password, a certificate without its key, or the reverse.
    """

    #: User name, with its password.
    user: Optional[str] = None
    password: Optional[str] = field(default=None, repr=False)
    #: File (PEM) with the certificate of the authority that has signed the router's: for `tls/`
    #: endpoints.
    root_certificate: Optional[_Path] = None
    #: Files (PEM) with the robot's own certificate and its key, where the router asks for one.
    client_certificate: Optional[_Path] = None
    client_key: Optional[_Path] = None
    #: A Zenoh configuration file (JSON5) for everything else. The rest and the endpoints are put
    #: over it.
    config_file: Optional[_Path] = None

    def __post_init__(self) -> None:
        if (self.user is None) != (self.password is None):
            raise InvalidValue("credentials", self, "expected user and password together")
        if (self.client_certificate is None) != (self.client_key is None):
            expected = "expected client_certificate and client_key together"
            raise InvalidValue("credentials", self, expected)

    def check_files(self) -> None:
        """Raises `InvalidValue` for a file that cannot be read: Zenoh would try again with it until
        its time is over, and not say why."""
        for name in ("root_certificate", "client_certificate", "client_key", "config_file"):
            file: Optional[_Path] = getattr(self, name)
            if file is None:
                continue
            try:
                with open(file, "rb"):
                    pass
            except OSError as error:
                expected = f"expected a file that can be read ({error.strerror})"
                raise InvalidValue(f"credentials.{name}", str(file), expected) from None

    def config(self) -> zenoh.Config:
        """The Zenoh configuration that they make."""
        if self.config_file is None:
            config = zenoh.Config()
        else:
            config = zenoh.Config.from_file(os.fspath(self.config_file))
        tls = "transport/link/tls"
        values: Dict[str, Any] = {
            "transport/auth/usrpwd/user": self.user,
            "transport/auth/usrpwd/password": self.password,
            f"{tls}/root_ca_certificate": _path(self.root_certificate),
            f"{tls}/connect_certificate": _path(self.client_certificate),
            f"{tls}/connect_private_key": _path(self.client_key),
            f"{tls}/enable_mtls": None if self.client_certificate is None else True,
        }
        for key, value in values.items():
            if value is not None:
                config.insert_json5(key, json.dumps(value))
        return config


def _path(path: Optional[_Path]) -> Optional[str]:
    return None if path is None else os.fspath(path)
