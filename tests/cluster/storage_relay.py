"""A relay before an S3 server that can also answer in its place, or lose what it answers."""

from __future__ import annotations

from typing import Dict

from http_message import read_answer, read_request
from relay import Relay, Stream

_SLOW_DOWN_BODY = (
    b'<?xml version="1.0" encoding="UTF-8"?>\n'
    b"<Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>"
)
#: What S3 answers to whoever asks too often.
_SLOW_DOWN = (
    b"HTTP/1.1 503 Slow Down\r\nContent-Type: application/xml\r\nContent-Length: %d\r\n\r\n%s"
    % (len(_SLOW_DOWN_BODY), _SLOW_DOWN_BODY)
)


class StorageRelay(Relay):
    """Passes requests on to an S3 server, one after the other, and their answers back.

    Args:
        target: Port of the S3 server, on loopback.
        address: Where it listens.
    """

    def __init__(self, target: int, address: str = "127.0.0.1") -> None:
        #: Requests that were passed on, by their methods.
        self.passed: Dict[str, int] = {}
        #: Requests that were answered with 503.
        self.refused = 0
        #: Answers that were lost.
        self.lost = 0
        self._refuses = False
        self._loses_every = 0
        self._puts = 0
        super().__init__(target, address)

    @property
    def endpoint(self) -> str:
        """What a client of the S3 server takes for it."""
        return f"http://{self.address}:{self.port}"

    def refuse(self) -> None:
        """Answers every request with 503 SlowDown, in the server's place."""
        self._refuses = True

    def lose_answers(self, every: int) -> None:
        """Passes every so-many-th PUT on, and closes its connection instead of answering."""
        self._loses_every = every

    def mend(self) -> None:
        self._refuses = False
        self._loses_every = 0
        super().mend()

    async def pass_on(self, client: Stream, server: Stream) -> None:
        while True:
            request = await read_request(client[0])
            if request is None:
                break
            await self.flow()
            if self._refuses:
                self.refused += 1
                answer, is_last = _SLOW_DOWN, request.is_last
            else:
                if server[0].at_eof():
                    # The server has closed a connection on which nothing came for long.
                    server[1].close()
                    server = await self.connect()
                server[1].write(request.raw)
                self.passed[request.word] = self.passed.get(request.word, 0) + 1
                told = await read_answer(server[0], request.word)
                await self.flow()
                if request.word == "PUT" and self._loses():
                    self.lost += 1
                    break
                answer, is_last = told.raw, told.is_last or request.is_last
            client[1].write(answer)
            await client[1].drain()
            if is_last:
                break
        server[1].close()

    def _loses(self) -> bool:
        self._puts += 1
        return self._loses_every > 0 and self._puts % self._loses_every == 0
