"""A relay of TCP connections that can be cut, frozen and mended: a network that fails on demand."""

from __future__ import annotations

import asyncio
import threading
from typing import Any, Coroutine, Optional, Set, Tuple, TypeVar

from port import Port
from wait import LONG_S

#: Most bytes that are passed on at once.
_CHUNK_BYTES = 1 << 16

T = TypeVar("T")
Stream = Tuple[asyncio.StreamReader, asyncio.StreamWriter]


class Relay:
    """Passes bytes on between connections to a port of its own and a port of a server.

    Its work is done by a thread of its own; the methods are called from others, and have taken
    effect when they return.

    Args:
        target: Port of the server, on loopback.
        address: Where it listens.
    """

    def __init__(self, target: int, address: str = "127.0.0.1") -> None:
        self._listening = Port()
        self._target = target
        #: Where clients connect, beside the port.
        self.address = address
        self._connections: Set["asyncio.Task[None]"] = set()
        self._server: Optional[asyncio.AbstractServer] = None
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._flowing = self._do(_event())
        self.mend()

    @property
    def port(self) -> int:
        """The port to which clients connect."""
        return self._listening.number

    def cut(self) -> None:
        """Closes all connections and refuses new ones."""
        self._do(self._cut())

    def freeze(self) -> None:
        """Passes nothing on; connections stay open, and new ones are taken."""
        self._do(self._freeze())

    def mend(self) -> None:
        """Passes everything on again, also what was held back while it was frozen."""
        self._do(self._mend())

    def close(self) -> None:
        """Ends it."""
        self.cut()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def pass_on(self, client: Stream, server: Stream) -> None:
        """Passes a connection's bytes on until one of its ends is closed."""
        ways = (
            asyncio.ensure_future(self._pump(client[0], server[1])),
            asyncio.ensure_future(self._pump(server[0], client[1])),
        )
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)

    async def flow(self) -> None:
        """Waits while it is frozen."""
        await self._flowing.wait()

    async def connect(self) -> Stream:
        """Connects to the server."""
        return await asyncio.open_connection("127.0.0.1", self._target)

    def _do(self, step: Coroutine[Any, Any, T]) -> T:
        return asyncio.run_coroutine_threadsafe(step, self._loop).result(LONG_S)

    async def _cut(self) -> None:
        if self._server is not None:
            self._server.close()
            self._server = None
        tasks = list(self._connections)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _freeze(self) -> None:
        self._flowing.clear()

    async def _mend(self) -> None:
        self._flowing.set()
        if self._server is None:
            self._server = await asyncio.start_server(self._serve, self.address, self.port)

    def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._server is None:
            # It was cut after the system had taken the connection.
            writer.transport.abort()
            return
        task = asyncio.ensure_future(self._relay((reader, writer)))
        self._connections.add(task)
        task.add_done_callback(self._connections.discard)

    async def _relay(self, client: Stream) -> None:
        server: Optional[Stream] = None
        try:
            await self.flow()
            server = await self.connect()
            await self.pass_on(client, server)
        except asyncio.CancelledError:
            # What was not passed on yet is lost with the connection.
            for stream in (client, server):
                if stream is not None:
                    stream[1].transport.abort()
        except (OSError, EOFError):
            pass  # one end has gone: so goes the other
        finally:
            for stream in (client, server):
                if stream is not None:
                    stream[1].close()

    async def _pump(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while True:
            data = await reader.read(_CHUNK_BYTES)
            await self.flow()
            if not data:
                return
            writer.write(data)
            await writer.drain()


async def _event() -> asyncio.Event:
    """An event of the loop that runs this."""
    return asyncio.Event()
