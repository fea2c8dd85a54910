"""A Chromium without a network, which tests tell what to do through a pipe."""

import json
import os
import select
import shutil
import subprocess

from ..processes import wait_for

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--mute-audio",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--remote-debugging-pipe", "--window-size=1280,1000",
)  # fmt: skip
FIRST = 30.0  # how long is waited for something [s]
# The browser reads from descriptor 3 and writes to 4.
START = 'from=$1 to=$2; shift 2; exec "$@" 3<&"$from" 4>&"$to"'


class Browser:
    """A Chromium that is told what to do through a pipe."""

    def __init__(self, home):
        theirs_in, self.out = os.pipe()
        self.inward, theirs_out = os.pipe()
        ends = theirs_in, theirs_out
        words = ["bash", "-c", START, "-", *map(str, ends), CHROMIUM, *FLAGS]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "pass_fds": ends}
        words += [f"--user-data-dir={home}", "about:blank"]
        self.process = subprocess.Popen(words, **quiet)
        for end in ends:
            os.close(end)
        self.number, self.session, self.rest, self.heard = 0, {}, b"", []
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
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            found = self._read()
            if found.get("id") == self.number:
                assert "error" not in found, found
                return found["result"]
            assert found.get("method") != "Page.javascriptDialogOpening", "a title was run"
            self.heard.append(found)

    def _read(self):
        while b"\0" not in self.rest:
            assert select.select([self.inward], [], [], FIRST)[0], "the browser says nothing"
            part = os.read(self.inward, 1 << 20)
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
        for each in self.heard:
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
        self.process.wait(10)
        os.close(self.out)
        os.close(self.inward)
