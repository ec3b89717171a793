"""What a robot shows to the router, and what it says when the router does not accept it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Dict

import pytest
import zenoh

from cogmap import Credentials, InvalidValue, Robot, Timeout

from stand_in import free_port


def test_credentials_become_zenoh_settings_and_the_password_is_not_shown(tmp_path: Path) -> None:
    beneath = tmp_path / "zenoh.json5"
    beneath.write_text("{ transport: { link: { tls: { verify_name_on_connect: false } } } }")
    credentials = Credentials(
        user="ada",
        password="s3cret",
        root_certificate=tmp_path / "ca.pem",
        client_certificate="/etc/ada.pem",
        client_key="/etc/ada.key",
        config_file=beneath,
    )
    config = credentials.config()
    tls = json.loads(config.get_json("transport/link/tls"))
    assert tls["root_ca_certificate"] == str(tmp_path / "ca.pem")
    assert (tls["connect_certificate"], tls["connect_private_key"]) == (
        "/etc/ada.pem",
        "/etc/ada.key",
    )
    assert tls["enable_mtls"] is True and tls["verify_name_on_connect"] is False
    users = json.loads(config.get_json("transport/auth/usrpwd"))
    assert (users["user"], users["password"]) == ("ada", "s3cret")
    assert "s3cret" not in repr(credentials)


def test_halves_of_credentials_are_refused() -> None:
    with pytest.raises(ValueError, match="password"):
        Credentials(user="ada")
    with pytest.raises(ValueError, match="client_key"):
        Credentials(client_certificate="ada.pem")


@pytest.mark.parametrize(
    "name, others",
    [
        ("root_certificate", {}),
        ("client_certificate", {"client_key": __file__}),
        ("client_key", {"client_certificate": __file__}),
        ("config_file", {}),
    ],
)
def test_a_file_that_is_not_there_is_named_at_once(name: str, others: Dict[str, str]) -> None:
    credentials = Credentials(**{name: "/nowhere/x.pem"}, **others)
    with pytest.raises(InvalidValue, match="/nowhere/x.pem") as caught:
        Robot("demo", "ada", connect="tls/127.0.0.1:9", credentials=credentials)
    assert caught.value.field == f"credentials.{name}"


def test_a_router_with_users_lets_in_who_has_the_password(tmp_path: Path) -> None:
    users = tmp_path / "users.txt"
    users.write_text("ada:s3cret\n")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("transport/auth/usrpwd/dictionary_file", json.dumps(str(users)))
    with zenoh.open(config):

        def robot(password: str) -> Robot:
            return Robot(
                "demo",
                "ada",
                connect=endpoint,
                credentials=Credentials(user="ada", password=password),
                connect_timeout_s=3.0,
            )

        with pytest.raises(Timeout, match="lets a robot in"):
            robot("guessed")
        robot("s3cret").close()
