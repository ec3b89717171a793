"""A browser for the tests, and services for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional, Sequence

import pytest
from playwright.sync_api import Browser, sync_playwright

from chromium import launch
from page import Dashboard
from server import Server
from wait import LONG_S

MakeServer = Callable[..., Server]
Open = Callable[..., Dashboard]


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A headless browser."""
    with sync_playwright() as playwright:
        browser = launch(playwright)
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
