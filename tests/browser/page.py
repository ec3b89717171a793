"""The page of a service in a browser, with the words of the tests."""

from __future__ import annotations

import io
from typing import Any, Dict, List, Optional, Tuple

from PIL import Image
from playwright.sync_api import ConsoleMessage, Page

from server import Server
from wait import eventually

Point = Tuple[float, float]


class Dashboard:
    """The page, opened for a space. What its console complains of is kept."""

    def __init__(self, page: Page, service: Server, space: Optional[str] = "default") -> None:
        self.page = page
        self.complaints: List[str] = []
        page.on("console", self._note)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.goto(service.url + ("/" if space is None else f"/?space={space}"))
        page.wait_for_selector("canvas.scene")

    def _note(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            self.complaints.append(f"{message.text} {message.location.get('url', '')}")

    def stats(self) -> Dict[str, Any]:
        """The page's own figures."""
        figures: Dict[str, Any] = self.page.evaluate("cogmap.stats()")
        return figures

    def until(self, what: str, **wanted: Any) -> Dict[str, Any]:
        """Waits until figures have these values."""

        def reached() -> Optional[Dict[str, Any]]:
            stats = self.stats()
            return stats if all(stats[name] == value for name, value in wanted.items()) else None

        return eventually(what, reached)

    def until_places(self, least: int) -> Dict[str, Any]:
        """Waits until so many places are shown."""

        def reached() -> Optional[Dict[str, Any]]:
            stats = self.stats()
            return stats if stats["places"] >= least and stats["frames"] > 0 else None

        return eventually(f"{least} places", reached)

    def text(self, selector: str) -> str:
        """What an element says."""
        return self.page.locator(selector).first.inner_text()

    def panel(self, selector: str) -> str:
        """What a part says that may not be there yet."""
        part = self.page.locator(selector)
        return (part.first.text_content() or "") if part.first.is_visible() else ""

    def settle(self) -> None:
        """Waits until the eye stands still."""
        last: List[Any] = [None]

        def still() -> bool:
            at = self.page.evaluate("cogmap.onScreen([0, 0, 0])")
            before, last[0] = last[0], at
            self.page.wait_for_timeout(200)
            return bool(before == at)

        eventually("the eye stands still", still)

    def on_screen(self, position: Any) -> Point:
        """Where a position of the map lies in the window."""
        at = self.page.evaluate("at => cogmap.onScreen(at)", position)
        return at["x"], at["y"]

    def agent_on_screen(self, name: str) -> Point:
        return self.on_screen(self.page.evaluate("name => cogmap.agent(name)", name))

    def place_on_screen(self, place: int) -> Point:
        return self.on_screen(self.page.evaluate("place => cogmap.place(place)", place))

    def picture(self) -> Image.Image:
        """What the window shows."""
        return Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")

    def scene(self) -> Image.Image:
        """The middle of the scene."""
        picture = self.picture()
        width, height = picture.size
        return picture.crop((width // 4, height // 5, 3 * width // 4, 4 * height // 5))


def brightness(picture: Image.Image) -> float:
    """Mean brightness, 0 for black and 1 for white."""
    grey = picture.convert("L").resize((1, 1), Image.Resampling.BOX)
    value = grey.getpixel((0, 0))
    assert isinstance(value, int)
    return value / 255


def n_colours(picture: Image.Image) -> int:
    """Number of different colours, where nearly equal ones count once."""
    found = picture.point(lambda value: value // 24).getcolors(1 << 24)
    assert found is not None
    return len(found)
