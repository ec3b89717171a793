"""Takes the picture of the page that the documents show: of a demo, as anybody can run it."""

from __future__ import annotations

import argparse
import io
import re
import subprocess
import tempfile
import time
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, ViewportSize, sync_playwright

from chromium import launch

#: Address that the demo prints.
_ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+")
#: Longest wait for it [s].
_START_S = 30.0
#: Largest picture [bytes].
_BYTES_MAX = 400_000
#: Whether samples come in: on a machine that does much else, robots may stand still for a moment.
_BUSY = "Number(document.querySelector('.health dd').textContent) > 60"
#: How often the picture is taken anew where none did.
_RETAKES = 8
_SIZE = ViewportSize(width=1440, height=900)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--binary", help="the program cogmap, whose demo is shown")
    options.add_argument("--url", help="a service that runs a demo already, instead of one")
    options.add_argument("--out", required=True, type=Path, help="the picture, PNG")
    options.add_argument("--after", type=float, default=42.0, help="seconds until then")
    options.add_argument("--keys", default="", help="keys that are pressed before")
    options.add_argument("--theme", choices=["dark", "light"], default="dark")
    asked = options.parse_args()
    picture = take(asked.url, asked) if asked.url else take_demo(asked)
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    asked.out.write_bytes(picture)
    print(f"{asked.out}: {len(picture)} bytes")


def take_demo(asked: argparse.Namespace) -> bytes:
    """The picture of the page of a demo that is started for it."""
    with tempfile.TemporaryFile("w+") as log:
        command = [asked.binary, "demo", "--duration", f"{asked.after + 60:.0f}s"]
        demo = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        try:
            return take(address(demo, Path(f"/proc/self/fd/{log.fileno()}")), asked)
        finally:
            demo.terminate()
            demo.wait()


def address(demo: "subprocess.Popen[bytes]", log: Path) -> str:
    """Where the demo says that its service listens."""
    deadline = time.monotonic() + _START_S
    while time.monotonic() < deadline and demo.poll() is None:
        found = _ADDRESS.search(log.read_text())
        if found:
            return found.group()
        time.sleep(0.1)
    raise RuntimeError(f"the demo told no address:\n{log.read_text()}")


def take(url: str, asked: argparse.Namespace) -> bytes:
    """The picture of the page, some time into the demo."""
    began = time.monotonic()
    with sync_playwright() as playwright:
        browser = launch(playwright)
        page = browser.new_page(viewport=_SIZE, color_scheme=asked.theme)
        page.goto(f"{url}/?space=demo")
        wait(page, began + asked.after - time.monotonic())
        for key in asked.keys.split():
            page.keyboard.press(key)
        wait(page, 3.0)
        picture = page.screenshot()
        for _ in range(_RETAKES):
            if page.evaluate(_BUSY):
                break
            wait(page, 0.5)
            picture = page.screenshot()
        browser.close()
    return small(picture)


def wait(page: Page, seconds: float) -> None:
    page.wait_for_timeout(max(0.0, 1000 * seconds))


def small(picture: bytes) -> bytes:
    """The picture with brightness in as fine steps as fit into the bytes that it may have."""
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    for step in (1, 2, 3, 4, 6, 8):
        table = [min(255, (value + step // 2) // step * step) for value in range(256)]
        written = io.BytesIO()
        image.point(3 * table).save(written, "PNG", optimize=True)
        if written.tell() <= _BYTES_MAX:
            break
    return written.getvalue()


if __name__ == "__main__":
    main()
