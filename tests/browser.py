"""Pages opened in Chromium where it is installed, without a network."""

import shutil
import subprocess
import tempfile

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER = next((path for path in map(shutil.which, NAMES) if path), None)
QUIET = ("--no-first-run", "--disable-background-networking", "--disable-sync", "--hide-scrollbars")
NO_NETWORK = ("--host-resolver-rules=MAP * ~NOTFOUND",)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="no chromium is installed")


def browsed(address, action, tmp_path, milliseconds=1500):
    """Return what the browser prints of a page after its scripts ran."""
    options = ("--headless", "--no-sandbox", "--disable-gpu", *QUIET, *NO_NETWORK, "--window-size=800,600")
    # a browser now and then hangs at its start on a busy machine, whatever the page
    for attempt in (1, 2, 3):
        profile = tempfile.mkdtemp(dir=tmp_path)
        time = f"--virtual-time-budget={milliseconds}"
        command = [BROWSER, *options, f"--user-data-dir={profile}", time, action, address]
        try:
            return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False).stdout
        except subprocess.TimeoutExpired:
            if attempt == 3:
                raise
    return None
