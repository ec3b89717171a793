"""Debian's Chromium, or another one that is named; none is fetched."""

from __future__ import annotations

import os
import shutil

from playwright.sync_api import Browser, Playwright

#: WebGL without a graphics card.
_ARGUMENTS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


def launch(playwright: Playwright) -> Browser:
    """A headless browser: `CHROMIUM`, or Debian's. Root may not have a sandbox in a container."""
    found = shutil.which(os.environ.get("CHROMIUM") or "chromium")
    if not found:
        raise FileNotFoundError(
            "there is no Chromium: run `apt-get install chromium`, or name one in CHROMIUM"
        )
    arguments = _ARGUMENTS + (["--no-sandbox"] if os.geteuid() == 0 else [])
    return playwright.chromium.launch(executable_path=found, args=arguments)
