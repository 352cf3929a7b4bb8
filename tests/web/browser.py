"""Headless Chromium, driven through chromedriver by the W3C WebDriver protocol; nothing but the standard library."""

import base64
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
import urllib.error
import urllib.request

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # WebDriver, section 12.2
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--hide-scrollbars"]
LIMIT = float(os.environ.get("AXLECAST_LIMIT", 60))  # s
LEFT, HOME, END, TAB = "\ue012", "\ue011", "\ue010", "\ue004"  # WebDriver, section 17.4.2: keys


class Refused(Exception):
    pass


class Browser:
    def __init__(self, width=1440, height=900, dark=False, flags=()):
        self.profile = tempfile.mkdtemp(prefix="axlecast-browser-")
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.root = None
        try:
            self.root = f"http://127.0.0.1:{self._port()}"
            options = {"args": [*FLAGS, *flags, f"--user-data-dir={self.profile}", f"--window-size={width},{height}"]}
            session = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": {
                "browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}})
            self.root += f"/session/{session['sessionId']}"
            self.size(width, height)
            self.colours(dark)
        except BaseException:
            self.close()
            raise

    def _port(self):
        for line in self.driver.stdout:
            found = re.search(r"successfully on port (\d+)", line)
            if found:
                return found.group(1)
        raise Refused("chromedriver did not start")

    def _ask(self, method, path, body=None):
        request = urllib.request.Request(self.root + path, method=method, headers={"Content-Type": "application/json"},
                                         data=None if body is None else json.dumps(body).encode())
        try:
            with urllib.request.urlopen(request, timeout=LIMIT) as answer:
                return json.loads(answer.read())["value"]
        except urllib.error.HTTPError as error:
            raise Refused(json.loads(error.read())["value"]["message"]) from error

    def command(self, name, **parameters):
        """A command of the DevTools."""
        return self._ask("POST", "/goog/cdp/execute", {"cmd": name, "params": parameters})

    def size(self, width, height):
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def colours(self, dark):
        self.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def open(self, url):
        self._ask("POST", "/url", {"url": url})

    def run(self, script, *arguments):
        return self._ask("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, script, what, *arguments, limit=LIMIT):
        """The first truthy result of the script."""
        deadline = time.monotonic() + limit
        while time.monotonic() < deadline:
            result = self.run(script, *arguments)
            if result:
                return result
            time.sleep(0.03)
        raise AssertionError(f"not within {limit} s: {what}; the page says: {self.text('body')[:1500]}")

    def text(self, selector):
        return self.run("return document.querySelector(arguments[0])?.innerText ?? ''", selector)

    def _find(self, selector):
        return self._ask("POST", "/element", {"using": "css selector", "value": selector})[ELEMENT]

    def click(self, selector):
        self._ask("POST", f"/element/{self._find(selector)}/click", {})

    def write(self, selector, text):
        self._ask("POST", f"/element/{self._find(selector)}/value", {"text": text})

    def press(self, *keys):
        """Keys to whatever has the focus, one after the other."""
        actions = [action for key in keys for action in ({"type": "keyDown", "value": key}, {"type": "keyUp", "value": key})]
        self._ask("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": actions}]})

    def pointer(self, *actions):
        self._ask("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"},
                                                    "actions": list(actions)}]})

    def wheel(self, x, y, delta):
        self._ask("POST", "/actions", {"actions": [{"type": "wheel", "id": "wheel", "actions": [
            {"type": "scroll", "x": x, "y": y, "deltaX": 0, "deltaY": delta}]}]})

    def screenshot(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self._ask("GET", "/screenshot")))

    def complaints(self):
        """What the browser's console holds of warnings and errors, since it was asked last."""
        return [entry["message"] for entry in self._ask("POST", "/se/log", {"type": "browser"}) if entry["level"] in ("SEVERE", "WARNING")]

    def processes(self):
        """Ids of the browser's processes: all of Chromium's, not the driver's."""
        listing = subprocess.run(["ps", "-eo", "pid=,args="], capture_output=True, text=True, check=True).stdout
        return [int(line.split()[0]) for line in listing.splitlines() if self.profile in line and "chromedriver" not in line.split()[1]]

    def close(self):
        if self.root and "/session/" in self.root:
            try:
                self._ask("DELETE", "")
            except (Refused, OSError):
                pass  # it is gone already
        self.driver.terminate()
        self.driver.wait(20)
        self.driver.stdout.close()
        shutil.rmtree(self.profile, ignore_errors=True)
