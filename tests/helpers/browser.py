"""Chromium without a window, asked by its debugging protocol: tests look at pages as people see them."""

import asyncio
import base64
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import aiohttp

DEADLINE_S = 60
_FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-dev-shm-usage"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--remote-debugging-port=0"),
)


class Browser:
    """A browser with one page, for a `with` block."""

    def __init__(self, width=1300, height=900, dark=False):
        self._size, self._dark = (width, height), dark
        self._count = 0

    def __enter__(self):
        program = shutil.which("chromium")
        if program is None:
            raise FileNotFoundError("there is no chromium: run ./mros setup --dev")
        self._folder = tempfile.mkdtemp(prefix="browser-")
        flags = [*_FLAGS, f"--user-data-dir={self._folder}", f"--window-size={self._size[0]},{self._size[1]}"]
        if self._dark:
            flags.append("--blink-settings=preferredColorScheme=0")
        self._process = subprocess.Popen(
            [program, *flags, "about:blank"],
            env={**os.environ, "TMPDIR": self._folder},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self._loop = asyncio.new_event_loop()
        self._run(self._connect())
        return self

    def __exit__(self, *_):
        self._run(self._session.close())
        self._loop.close()
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        with suppress(ProcessLookupError):  # its children, which may still write into the folder
            os.killpg(self._process.pid, signal.SIGKILL)
        shutil.rmtree(self._folder, ignore_errors=True)

    def open(self, url):
        """Open a page, and wait until it is loaded."""
        self._call("Page.navigate", url=url)
        self.wait("document.readyState === 'complete'", f"{url} is loaded")

    def ask(self, expression):
        """Return the value of an expression of JavaScript."""
        found = self._call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in found:
            raise AssertionError(found["exceptionDetails"].get("exception", found["exceptionDetails"]))
        return found["result"].get("value")

    def wait(self, expression, what, deadline_s=DEADLINE_S):
        """Wait until an expression is true."""
        end = time.monotonic() + deadline_s
        while time.monotonic() < end:
            if self.ask(f"Boolean({expression})"):
                return
            time.sleep(0.05)
        raise AssertionError(f"not seen within {deadline_s} s: {what}\n{self.text()[:3000]}")

    def wait_for_text(self, text, within="body", deadline_s=DEADLINE_S):
        """Wait until an element shows a text."""
        self.wait(
            f"document.querySelector({json.dumps(within)})?.innerText.includes({json.dumps(text)})", text, deadline_s
        )

    def text(self, within="body"):
        """Return the text of an element, as it is shown."""
        return self.ask(f"document.querySelector({json.dumps(within)})?.innerText ?? ''")

    def click(self, text, within="body"):
        """Click the button, summary or label with a text."""
        self.ask(f"""(() => {{
          const all = [...document.querySelector({json.dumps(within)}).querySelectorAll("button, summary, a, label")];
          const found = all.find((e) => !e.disabled && e.innerText.trim().startsWith({json.dumps(text)}));
          if (!found) throw new Error("no button " + {json.dumps(text)});
          found.click();
        }})()""")

    def press(self, key, code=0):
        """Press a key."""
        for kind in ("keyDown", "keyUp"):
            text = {"text": "\r"} if key == "Enter" and kind == "keyDown" else {}
            self._call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code, **text)

    def resize(self, width, height, mobile=False):
        """Make the page as wide and high as some screen."""
        self._call(
            *("Emulation.setDeviceMetricsOverride",), width=width, height=height, deviceScaleFactor=1, mobile=mobile
        )

    def picture(self, path, whole=True, clip=None):
        """Save what is seen as a PNG file."""
        options = {"captureBeyondViewport": whole}
        if clip:
            options["clip"] = {**clip, "scale": 1}
        found = self._call("Page.captureScreenshot", format="png", **options)
        Path(path).write_bytes(base64.b64decode(found["data"]))

    def box(self, selector):
        """Return where an element is, for `picture`."""
        return self.ask(f"""(() => {{
          const r = document.querySelector({json.dumps(selector)}).getBoundingClientRect();
          return {{x: r.x + scrollX, y: r.y + scrollY, width: r.width, height: r.height}};
        }})()""")

    def errors(self):
        """Return what went wrong in the page's own code since it was opened."""
        return [
            event["params"]
            for event in self._events
            if event["method"] in ("Runtime.exceptionThrown", "Log.entryAdded")
            and (event["method"] == "Runtime.exceptionThrown" or event["params"]["entry"]["level"] == "error")
        ]

    async def _connect(self):
        port_file = Path(self._folder) / "DevToolsActivePort"
        end = time.monotonic() + DEADLINE_S
        while not (port_file.exists() and port_file.read_text().count("\n")):
            if time.monotonic() > end or self._process.poll() is not None:
                raise AssertionError("chromium does not start")
            await asyncio.sleep(0.05)
        port = port_file.read_text().split()[0]
        self._events = []
        self._session = aiohttp.ClientSession()
        async with self._session.get(f"http://127.0.0.1:{port}/json") as answer:
            pages = [page for page in await answer.json() if page["type"] == "page"]
        self._socket = await self._session.ws_connect(pages[0]["webSocketDebuggerUrl"], max_msg_size=0)
        for domain in ("Page", "Runtime", "Log"):
            await self._send(f"{domain}.enable", {})

    async def _send(self, method, parameters):
        self._count += 1
        await self._socket.send_json({"id": self._count, "method": method, "params": parameters})
        while True:
            message = await asyncio.wait_for(self._socket.receive_json(), DEADLINE_S)
            if message.get("id") == self._count:
                if "error" in message:
                    raise AssertionError(f"{method}: {message['error']}")
                return message["result"]
            self._events.append(message)

    def _call(self, method, **parameters):
        return self._run(self._send(method, parameters))

    def _run(self, work):
        return self._loop.run_until_complete(work)
