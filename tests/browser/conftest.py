"""A browser for the tests, and services for it. Debian's Chromium is looked for; none is fetched."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional, Sequence

import pytest
from playwright.sync_api import Browser, sync_playwright

from page import Dashboard
from server import Server
from wait import LONG_S

MakeServer = Callable[..., Server]
Open = Callable[..., Dashboard]

#: WebGL without a graphics card.
ARGUMENTS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


def chromium() -> str:
    """The browser: `CHROMIUM`, or Debian's."""
    found = shutil.which(os.environ.get("CHROMIUM") or "chromium")
    if not found:
        raise FileNotFoundError("there is no Chromium: run `apt-get install chromium`, or name one in "
                                "CHROMIUM")
    return found


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A headless browser. Root may not have a sandbox in a container."""
    arguments = ARGUMENTS + (["--no-sandbox"] if os.geteuid() == 0 else [])
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=arguments)
        yield browser
        browser.close()


@pytest.fixture
def make_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MakeServer]:
    """Makes running services, each on an empty directory."""
    servers: List[Server] = []

    def make(settings: Sequence[str] = (), token: Optional[str] = None) -> Server:
        server = Server(Path(tmp_path_factory.mktemp("service")), settings, token)
        servers.append(server)
        server.start()
        return server

    yield make
    for server in servers:
        server.close()


@pytest.fixture
def service(make_service: MakeServer) -> Server:
    """A running service with default settings."""
    return make_service()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Open]:
    """Opens the page of a service, in a window of its own: `open_page(service, …)`."""
    contexts = []

    def open_page(
        service: Server, space: Optional[str] = "default", width: int = 1280, height: int = 800,
        **options: Any,
    ) -> Dashboard:
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        context.set_default_timeout(1000 * LONG_S)
        contexts.append(context)
        return Dashboard(context.new_page(), service, space)

    yield open_page
    for context in contexts:
        context.close()
