"""A Chromium without a network, which tests tell what to do through a pipe."""

import json
import select
import shutil
from subprocess import DEVNULL, PIPE, Popen

from ..processes import wait_for

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--mute-audio",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--use-angle=swiftshader", "about:blank",
    "--enable-unsafe-swiftshader", "--remote-debugging-pipe", "--window-size=1280,1000",
)  # fmt: skip
FIRST = 30.0  # how long is waited for something [s]
# The browser reads from descriptor 3 and writes to 4.
START = 'exec "$@" 3<&0 4>&1 </dev/null >/dev/null'


class Browser:
    """A Chromium that is told what to do through a pipe."""

    def __init__(self, home):
        words = ["bash", "-c", START, "-", CHROMIUM, *FLAGS, f"--user-data-dir={home}"]
        self.process = Popen(words, stdin=PIPE, stdout=PIPE, stderr=DEVNULL, bufsize=0)
        self.number, self.session, self.rest, self.events = 0, {}, b"", []
        pages = self.ask("Target.getTargets")["targetInfos"]
        page = next(each["targetId"] for each in pages if each["type"] == "page")
        session = self.ask("Target.attachToTarget", targetId=page, flatten=True)
        self.session = {"sessionId": session["sessionId"]}
        for name in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{name}.enable")
        off = {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0}
        self.ask("Network.emulateNetworkConditions", **off)

    def ask(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params, **self.session}
        self.process.stdin.write(json.dumps(message).encode() + b"\0")
        while True:
            found = self._read()
            if found.get("id") == self.number:
                assert "error" not in found, found
                return found["result"]
            assert found.get("method") != "Page.javascriptDialogOpening", "a title was run"
            self.events.append(found)

    def _read(self):
        source = self.process.stdout
        while b"\0" not in self.rest:
            assert select.select([source], [], [], FIRST)[0], "the browser says nothing"
            part = source.read(1 << 20)
            assert part, "the browser has gone"
            self.rest += part
        message, _, self.rest = self.rest.partition(b"\0")
        return json.loads(message)

    def value(self, expression):
        how = {"awaitPromise": True, "returnByValue": True}
        found = self.ask("Runtime.evaluate", expression=expression, **how)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def until(self, expression):
        return wait_for(lambda: self.value(expression), FIRST)

    def complaints(self):
        for each in self.events:
            method, params = each.get("method"), each.get("params", {})
            bad = method == "Runtime.exceptionThrown"
            bad |= method == "Runtime.consoleAPICalled" and params["type"] in ("error", "assert")
            bad |= method == "Log.entryAdded" and params["entry"]["level"] == "error"
            if method == "Network.requestWillBeSent":
                bad = not params["request"]["url"].startswith(("file:", "data:", "blob:"))
            if bad:
                yield str(params)

    def close(self):
        self.process.terminate()
        self.process.communicate(timeout=10)
