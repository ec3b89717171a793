"""Requests to a service over HTTP, and what becomes of them."""

from __future__ import annotations

import json
import time
import urllib.error
import urllib.parse
import urllib.request
from typing import Any, Callable, Dict, Iterable, Iterator, Optional, Tuple, Type, TypeVar, Union

from .errors import ApiError, Timeout, Unreachable, WireError
from .request import checked_token, tls_of
from .retry import Addresses, Retries, seconds_of
from .scalar import positive_seconds, seconds
from .sse import ServerSentEvent, server_sent_events
from .unreachable import translated
from .wire import JSON, decode

#: Members that every problem has (RFC 9457).
_PROBLEM = frozenset(("type", "title", "status", "detail"))

T = TypeVar("T")
Query = Dict[str, Union[None, str, int, float]]


class HttpService:
    """A service that answers requests over HTTP. Holds no connection between them."""

    def __init__(
        self,
        url: Union[str, Iterable[str]],
        token: Optional[str],
        timeout_s: float,
        ca_file: Optional[str],
        retry_timeout_s: float,
    ) -> None:
        self._addresses = Addresses(url)
        self._token = checked_token(token)
        self._timeout_s = positive_seconds("timeout_s", timeout_s)
        self._tls = tls_of(ca_file)
        self._retry_timeout_s = seconds("retry_timeout_s", retry_timeout_s)

    @property
    def _url(self) -> str:
        return self._addresses.in_use

    def _get(self, kind: Type[T], path: str, query: Optional[Query] = None) -> T:
        return self._decoded(kind, path, self._request("GET", path, query))

    def _send(
        self,
        kind: Type[T],
        method: str,
        path: str,
        content_type: str,
        body: bytes,
        *,
        repeatable: bool = False,
    ) -> T:
        """Sends a body. `repeatable` says that sending it twice does no more than sending it
        once."""
        answer = self._request(
            method, path, body=body, content_type=content_type, repeatable=repeatable
        )
        return self._decoded(kind, path, answer)

    def _decoded(self, kind: Type[T], path: str, answer: bytes) -> T:
        try:
            return decode(kind, answer, JSON)
        except WireError as error:
            raise WireError(f"{self._url}{path}: {error}") from error

    def _request(
        self,
        method: str,
        path: str,
        query: Optional[Query] = None,
        *,
        body: Optional[bytes] = None,
        content_type: Optional[str] = None,
        accept: str = JSON,
        repeatable: bool = False,
    ) -> bytes:
        def attempt() -> bytes:
            request = self._make_request(method, path + _asked(query), accept=accept, body=body)
            if content_type is not None:
                request.add_header("Content-Type", content_type)
            with translated(f"{method} {request.full_url}"):
                with self._open(request, self._timeout_s) as response:
                    data: bytes = response.read()
                    return data

        return self._repeated(attempt, repeatable or method == "GET")

    def _repeated(self, attempt: Callable[[], T], repeatable: bool) -> T:
        """What an attempt brings, made again while the space moves to another owner, and at another
        address where nothing listens at the one before."""
        retries = Retries(self._retry_timeout_s, repeatable)
        addresses_left = len(self._addresses)
        while True:
            url = self._url
            try:
                return attempt()
            except ApiError as error:
                pause_s = retries.pause_after(error)
                if pause_s is None:
                    raise
                addresses_left = len(self._addresses)
                # Another one may know better where the space is.
                self._addresses.leave(url)
                time.sleep(pause_s)
            except (Timeout, Unreachable) as error:
                addresses_left -= 1
                # The next request at least shall go elsewhere.
                self._addresses.leave(url)
                if not addresses_left or not retries.may_go_elsewhere(error):
                    raise

    def _stream(
        self,
        path: str,
        read: Callable[[ServerSentEvent], Optional[T]],
        *,
        query: Optional[Query] = None,
        timeout_s: Optional[float],
        last_event_id: Optional[str] = None,
    ) -> Iterator[T]:
        """What `read` makes of the events of a stream; those of which it makes nothing are passed
        over."""
        if timeout_s is not None:
            timeout_s = positive_seconds("timeout_s", timeout_s)

        def attempt() -> Tuple[str, Any]:
            request = self._make_request("GET", path + _asked(query), accept="text/event-stream")
            if last_event_id is not None:
                request.add_header("Last-Event-ID", last_event_id)
            where = f"GET {request.full_url}"
            with translated(where):
                return where, self._open(request, timeout_s)

        where, opened = self._repeated(attempt, repeatable=True)
        with translated(where), opened as response:
            for told in server_sent_events(response):
                message = read(told)
                if message is not None:
                    yield message

    def _make_request(
        self, method: str, path: str, *, accept: str, body: Optional[bytes] = None
    ) -> urllib.request.Request:
        request = urllib.request.Request(self._url + path, data=body, method=method)
        request.add_header("Accept", accept)
        if self._token is not None:
            # Not a header that redirects carry along: the token is for this service alone.
            request.add_unredirected_header("Authorization", f"Bearer {self._token}")
        return request

    def _open(self, request: urllib.request.Request, timeout_s: Optional[float]) -> Any:
        try:
            return urllib.request.urlopen(request, timeout=timeout_s, context=self._tls)
        except urllib.error.HTTPError as error:
            where = f"{request.get_method()} {request.full_url}"
            if error.code == 401:
                where += " without a token" if self._token is None else " with the given token"
            with error:
                raise _api_error(error, where) from None


def _asked(query: Optional[Query]) -> str:
    """The part of an address that holds a query, without what is absent."""
    given = {name: value for name, value in (query or {}).items() if value is not None}
    return f"?{urllib.parse.urlencode(given)}" if given else ""


def _api_error(error: urllib.error.HTTPError, where: str) -> ApiError:
    """The error of a refused request; the body may be anything when a proxy wrote it."""
    status, body = error.code, error.read()
    retry_after_s = seconds_of(error.headers.get("Retry-After"))
    try:
        problem = json.loads(body)
        return ApiError(
            status,
            str(problem["type"]),
            str(problem["title"]),
            str(problem.get("detail", "")),
            {name: value for name, value in problem.items() if name not in _PROBLEM},
            where,
            retry_after_s,
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        text = body[:200].decode("utf-8", "replace")
        return ApiError(
            status, "about:blank", error.reason, text, where=where, retry_after_s=retry_after_s
        )
