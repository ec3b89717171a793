"""A small server in a thread, which answers as the tests tell it."""

from __future__ import annotations

import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple, Union
from urllib.parse import parse_qs, urlsplit

from cogmap.wire import JSON

GOLDEN = Path(__file__).resolve().parents[3] / "proto" / "golden"
Body = Union[bytes, List[bytes], None]
Answer = Tuple[int, str, Body]


def golden(name: str) -> Any:
    return json.loads((GOLDEN / f"{name}.json").read_text())


class Request:
    """What the server saw."""

    def __init__(self, handler: BaseHTTPRequestHandler, body: bytes) -> None:
        split = urlsplit(handler.path)
        self.line = f"{handler.command} {split.path}"
        self.query = {name: values[0] for name, values in parse_qs(split.query).items()}
        self.headers = handler.headers
        self.body = body


class Server:
    """Answers each request by the function of its method and path, and remembers it."""

    def __init__(self) -> None:
        self.routes: Dict[str, Callable[[Request], Answer]] = {}
        self.seen: List[Request] = []
        #: When to come back, with every answer from 500 on.
        self.retry_after: Optional[str] = None
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def handle_any(self) -> None:
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                request = Request(self, body)
                outer.seen.append(request)
                problem = json.dumps(golden("problem")).encode()
                route = outer.routes.get(request.line)
                not_found: Answer = (404, "application/problem+json", problem)
                status, content_type, answer = not_found if route is None else route(request)
                self.send_response(status)
                self.send_header("Content-Type", content_type)
                if status >= 500 and outer.retry_after is not None:
                    self.send_header("Retry-After", outer.retry_after)
                chunks = answer if isinstance(answer, list) else [answer or b""]
                if not isinstance(answer, list):
                    self.send_header("Content-Length", str(len(chunks[0])))
                self.end_headers()
                for chunk in chunks:
                    self.wfile.write(chunk)
                    self.wfile.flush()

            do_GET = do_PUT = do_POST = do_DELETE = handle_any

            def log_message(self, format: str, *args: Any) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}"
        serve = self._server.serve_forever
        self._thread = threading.Thread(target=serve, args=(0.01,), daemon=True)
        self._thread.start()

    def answer(self, line: str, value: Any, status: int = 200) -> None:
        """Answers a request line with JSON."""
        self.routes[line] = lambda _: (status, JSON, json.dumps(value).encode())

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()
