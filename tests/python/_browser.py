"""A headless Chromium that a test drives by DevTools messages, through a pipe."""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

PROGRAMS = ["chromium", "chromium-browser", "google-chrome", "chrome"]

# Nothing that a test does not ask for: no updates, no services, no sandbox for a test as root.
QUIET = [
    "--headless=new", "--no-sandbox", "--no-first-run", "--hide-scrollbars", "--mute-audio",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--disable-default-apps", "--disable-extensions", "--disable-dev-shm-usage",
    "--remote-debugging-pipe",
]

# WebGL on the processor.
WITH_WEBGL = ["--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
WITHOUT_WEBGL = ["--disable-gpu", "--disable-software-rasterizer", "--disable-3d-apis"]


def program() -> str:
    """The browser. Exits with the command that installs it if there is none."""
    found = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if found is None:
        raise SystemExit("Chromium is missing; on Debian: apt-get install -y chromium")
    return found


class Browser:
    """A browser with one page. Use it in a `with` statement."""

    def __init__(self, options=(), timeout_s=60.0):
        self.timeout_s = timeout_s
        self.folder = tempfile.mkdtemp(prefix="cutis-browser-")
        to_browser, self.write_end = os.pipe()
        self.read_end, from_browser = os.pipe()
        # The browser reads messages from descriptor 3 and writes them to descriptor 4.
        script = f'exec 3<&{to_browser} 4>&{from_browser}; exec "$@"'
        command = [program(), *QUIET, *options, f"--user-data-dir={self.folder}", "about:blank"]
        self.process = subprocess.Popen(
            ["bash", "-c", script, "browser", *command],
            pass_fds=(to_browser, from_browser),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_browser)
        os.close(from_browser)
        self.pending, self.number, self.session = b"", 0, None
        # What the page wrote to the console, and the errors of its scripts.
        self.console = []
        self.sent = {}

    @property
    def requests(self):
        """The addresses that the page requested and its policy did not refuse."""
        return list(self.sent.values())

    def __enter__(self):
        targets = self.call("Target.getTargets")["targetInfos"]
        page = next(target for target in targets if target["type"] == "page")
        attached = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)
        self.session = attached["sessionId"]
        for domain in ["Page", "Runtime", "Log", "Network"]:
            self.call(f"{domain}.enable")
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.write_end)
        os.close(self.read_end)
        shutil.rmtree(self.folder, ignore_errors=True)

    def call(self, method, **parameters):
        """Sends a message and returns the result."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self._send(message)
        while True:
            reply = self._receive()
            if reply.get("id") == self.number:
                if "error" in reply:
                    raise RuntimeError(f"{method}: {reply['error']['message']}")
                return reply["result"]
            self._note(reply)

    def _send(self, message):
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.write_end, data):]

    def _receive(self):
        deadline = time.monotonic() + self.timeout_s
        while b"\0" not in self.pending:
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([self.read_end], [], [], left)[0]:
                raise TimeoutError(f"no answer of the browser in {self.timeout_s} s")
            data = os.read(self.read_end, 1 << 20)
            if not data:
                raise RuntimeError("the browser ended")
            self.pending += data
        message, self.pending = self.pending.split(b"\0", 1)
        return json.loads(message)

    def _note(self, event):
        parameters = event.get("params", {})
        match event.get("method"):
            case "Runtime.exceptionThrown":
                self.console.append(str(parameters["exceptionDetails"].get("exception", parameters)))
            case "Runtime.consoleAPICalled":
                self.console.append(f"{parameters['type']}: {parameters['args']}")
            case "Log.entryAdded":
                entry = parameters["entry"]
                # Reading the picture back is slow, which concerns only tests.
                if "GPU stall due to ReadPixels" not in entry["text"]:
                    self.console.append(f"{entry['level']}: {entry['text']}")
            case "Network.requestWillBeSent":
                self.sent[parameters["requestId"]] = parameters["request"]["url"]
            case "Network.loadingFailed" if parameters.get("blockedReason") == "csp":
                self.sent.pop(parameters["requestId"], None)

    def size(self, width, height, scale=1, mobile=False):
        """Sets the size of the page in pixels of CSS."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=mobile)

    def media(self, **features):
        """Sets media features, such as `prefers_color_scheme="dark"`."""
        named = [{"name": name.replace("_", "-"), "value": value} for name, value in features.items()]
        self.call("Emulation.setEmulatedMedia", features=named)

    def open(self, path: Path):
        """Opens a file and waits until its scripts have run."""
        self.call("Page.navigate", url=Path(path).resolve().as_uri())
        self.until("document.readyState === 'complete' && location.href !== 'about:blank'")
        self.frames()

    def evaluate(self, expression):
        """The value of an expression in the page. Waits for a promise."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in found:
            raise RuntimeError(f"{expression}: {found['exceptionDetails']}")
        return found["result"].get("value")

    def until(self, condition):
        """Waits until a condition holds."""
        deadline = time.monotonic() + self.timeout_s
        while not self.evaluate(condition):
            if time.monotonic() > deadline:
                raise TimeoutError(condition)
            time.sleep(0.02)

    def frames(self):
        """Waits until what was asked for is drawn."""
        self.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")

    def focus(self, selector):
        """Moves the focus to an element."""
        self.evaluate(f"document.querySelector({json.dumps(selector)}).focus()")

    def press(self, key, modifiers=0):
        """Presses and releases a key."""
        code = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Home": 36, "End": 35, "Tab": 9}
        text = {"text": key} if len(key) == 1 else {}
        virtual = code.get(key, ord(key[0]))
        for kind in ["keyDown", "keyUp"]:
            more = text if kind == "keyDown" else {}
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=virtual, modifiers=modifiers, **more)
        self.frames()

    def click(self, selector):
        """Clicks in the middle of an element."""
        x, y = self.middle(selector)
        for kind in ["mousePressed", "mouseReleased"]:
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)
        self.frames()

    def drag(self, selector, dx, dy, modifiers=0):
        """Drags from the middle of an element."""
        x, y = self.middle(selector)
        move = lambda kind, x, y: self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, modifiers=modifiers)
        move("mousePressed", x, y)
        for n in range(1, 5):
            move("mouseMoved", x + dx * n / 4, y + dy * n / 4)
        move("mouseReleased", x + dx, y + dy)
        self.frames()

    def middle(self, selector):
        """The middle of an element, after scrolling to it."""
        name = json.dumps(selector)
        self.evaluate(f"document.querySelector({name}).scrollIntoView({{block: 'center'}})")
        box = f"document.querySelector({name}).getBoundingClientRect()"
        return self.evaluate(f"(() => {{ const b = {box}; return [b.x + b.width / 2, b.y + b.height / 2]; }})()")

    def screenshot(self, full=False) -> bytes:
        """The page as a PNG file."""
        return base64.b64decode(self.call("Page.captureScreenshot", captureBeyondViewport=full)["data"])

    def canvas(self, selector="#canvas") -> np.ndarray:
        """The pixels of a canvas: rows, columns, and red, green, blue and opacity."""
        name = json.dumps(selector)
        width, height, text = self.evaluate(f"""(() => {{
            const source = document.querySelector({name});
            const copy = new OffscreenCanvas(source.width, source.height).getContext("2d");
            copy.drawImage(source, 0, 0);
            const values = copy.getImageData(0, 0, source.width, source.height).data;
            let text = "";
            for (let n = 0; n < values.length; n += 30000)
                text += String.fromCharCode(...values.subarray(n, n + 30000));
            return [source.width, source.height, btoa(text)];
        }})()""")
        return np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width, 4)
