"""Services for the tests: started for them, ended after them, their log shown when they fail."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Callable, Generator, Iterator, List, Optional, Sequence

import pytest

from server import Server

MakeServer = Callable[..., Server]
_SERVERS = pytest.StashKey[List[Server]]()


def pytest_configure() -> None:
    """A shell starts what runs in the background with SIGINT ignored, and so would be the programs
    that the tests start and interrupt."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def make_service(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[MakeServer]:
    """Makes running services, each on an empty directory: `make_service(settings, token)`. All of
    them must end well when asked to."""
    servers: List[Server] = []
    request.node.stash[_SERVERS] = servers

    def make(settings: Sequence[str] = (), token: Optional[str] = None) -> Server:
        server = Server(Path(tmp_path_factory.mktemp("service")), settings, token)
        servers.append(server)
        server.start()
        return server

    yield make
    errors: List[BaseException] = []
    for server in servers:
        try:
            server.close()
        except Exception as error:  # The other services have to end too.
            errors.append(error)
    if errors:
        raise errors[0]


@pytest.fixture
def service(make_service: MakeServer) -> Server:
    """A running service with default settings."""
    return make_service()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Adds the logs of a failed test's services to its report."""
    report = yield
    if report.failed:
        for server in item.stash.get(_SERVERS, []):
            report.sections.append((f"log of {server.url}", server.log_tail()))
    return report
