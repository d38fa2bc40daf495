"""A page in headless Chromium while time goes by as for people, by the DevTools protocol."""
import base64
import io
import json
import os
import pathlib
import signal
import subprocess
import sys
import time
import urllib.request

import numpy as np
from conftest import ROOT

sys.path.append(str(ROOT / "tests" / "documents"))
import browser  # noqa: E402

PATIENCE = 180  # [s] on a machine that is busy


class Chromium:
    """A context: the browser with one page. `log` has what that logs, "error: ..." and so on."""

    def __init__(self, address, folder, width, height):
        """folder: for its profile."""
        self._port, self._size, self._calls, self.log = pathlib.Path(folder) / "DevToolsActivePort", (width, height), 0, []
        options = [option for option in browser.OPTIONS if "virtual-time" not in option and "vsync" not in option]
        self._process = subprocess.Popen([browser.program(), *options, f"--user-data-dir={folder}", "--remote-debugging-port=0",
                                          f"--window-size={width},{height}", address],
                                         stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)

    def __enter__(self):
        from websockets.sync.client import connect  # of viser
        try:
            wait_for(self._port.is_file)
            self._socket = connect(wait_for(self._page), max_size=None)
            self._call("Runtime.enable")
            self._call("Log.enable")
            width, height = self._size
            self._call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        os.killpg(self._process.pid, signal.SIGKILL)  # its own children alone
        self._process.wait()

    def pixels(self):
        """(h, w, 3) of what it shows now."""
        from PIL import Image
        data = self._call("Page.captureScreenshot", format="png")["data"]
        return np.array(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"), float)

    def buttons(self):
        """What they say."""
        return self._value("[...document.querySelectorAll('button')].map(b => b.innerText.trim())")

    def click(self, words):
        """On the button that says so."""
        self._value(f"[...document.querySelectorAll('button')].find(b => b.innerText.trim() == {json.dumps(words)}).click()")

    def _value(self, script):
        return self._call("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def _page(self):
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self._port.read_text().split()[0]}/json", timeout=PATIENCE) as reply:
                return next((page["webSocketDebuggerUrl"] for page in json.load(reply) if page["type"] == "page"), None)
        except (OSError, IndexError):  # it is about to listen
            return None

    def _call(self, method, **arguments):
        self._calls += 1
        self._socket.send(json.dumps({"id": self._calls, "method": method, "params": arguments}))
        while True:
            message = json.loads(self._socket.recv(timeout=PATIENCE))
            if message.get("id") == self._calls:
                assert "error" not in message, message
                return message["result"]
            self._keep(message)

    def _keep(self, message):
        given = message.get("params", {})
        if message["method"] == "Runtime.consoleAPICalled":
            self.log.append(f"{given['type']}: " + " ".join(str(part.get("value")) for part in given["args"]))
        elif message["method"] == "Runtime.exceptionThrown":
            self.log.append(f"error: {given['exceptionDetails'].get('text')}")
        elif message["method"] == "Log.entryAdded":
            self.log.append(f"{given['entry']['level']}: {given['entry']['text']}")


def wait_for(what):
    """What `what()` gives once it gives something."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found = what()
        if found:
            return found
        time.sleep(0.3)
    raise AssertionError(f"waited {PATIENCE} s in vain")
