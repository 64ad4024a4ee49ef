"""Open pages in headless Chromium: no error on the console, pictures draw and turn, keys work, light and dark.

python drive.py PAGE.html … [--pictures FOLDER]; needs Chromium and the package websocket-client.
"""

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request

import websocket

FLAGS = ["--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--remote-debugging-port=0",
         "--remote-allow-origins=*", "--window-size=1300,1000"]


class Browser:
    """A browser, spoken to by its DevTools protocol."""

    def __init__(self):
        program = next(p for p in map(shutil.which, ["chromium", "chromium-browser", "google-chrome"]) if p)
        self.profile = tempfile.TemporaryDirectory()
        self.process = subprocess.Popen([program, *FLAGS, f"--user-data-dir={self.profile.name}", "about:blank"],
                                        stderr=subprocess.DEVNULL)
        port = os.path.join(self.profile.name, "DevToolsActivePort")
        while not os.path.exists(port) or not open(port).read().strip():
            time.sleep(0.1)
        number = open(port).read().split()[0]
        pages = json.load(urllib.request.urlopen(f"http://127.0.0.1:{number}/json"))
        address = next(p for p in pages if p["type"] == "page")["webSocketDebuggerUrl"]
        self.socket, self.count, self.errors = websocket.create_connection(address, timeout=120), 0, []
        for domain in ["Page", "Runtime", "Log"]:
            self.call(f"{domain}.enable")

    def call(self, method, **parameters):
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.recv())
            self.note(message)
            if message.get("id") == self.count:
                return message.get("result", {})

    def note(self, message):
        kind, about = message.get("method"), message.get("params", {})
        if kind == "Runtime.exceptionThrown":
            self.errors.append(about["exceptionDetails"].get("exception", {}).get("description", "exception"))
        if kind == "Runtime.consoleAPICalled" and about["type"] == "error":
            self.errors.append(str(about["args"]))
        if kind == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.errors.append(about["entry"]["text"])

    def run(self, script):
        return self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)["result"].get("value")

    def picture(self, path):
        data = self.call("Page.captureScreenshot", captureBeyondViewport=True)["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))

    def close(self):
        self.process.terminate()
        self.process.wait()


TURN = """(async () => {
  const frame = () => new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(r)));
  const results = [];
  for (const canvas of document.querySelectorAll("canvas")) {
    canvas.scrollIntoView(); await frame();
    const seen = () => { const gl = canvas.getContext("webgl2"), p = new Uint8Array(4 * canvas.width * canvas.height);
      gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, p); return p; };
    const press = async (key) => { canvas.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true })); await frame(); };
    const differs = (a, b) => { let n = 0; for (let i = 0; i < a.length; i += 4) if (a[i] !== b[i] || a[i + 3] !== b[i + 3]) n++; return n; };
    const before = seen(); let drawn = 0; for (let i = 3; i < before.length; i += 4) if (before[i]) drawn++;
    canvas.focus(); const start = performance.now();
    for (let i = 0; i < 10; i++) await press("ArrowLeft");
    const turned = seen(), milliseconds = (performance.now() - start) / 10;
    await press("c"); const cut = seen(); await press("+"); const zoomed = seen();
    results.push({ label: canvas.getAttribute("aria-label").split(".")[0], focused: document.activeElement === canvas, drawn,
      turned: differs(before, turned), cut: differs(turned, cut), zoomed: differs(cut, zoomed), milliseconds });
  }
  return JSON.stringify(results);
})()"""

arguments = sys.argv[1:]
pictures = None
if "--pictures" in arguments:
    at = arguments.index("--pictures")
    pictures = arguments[at + 1]
    os.makedirs(pictures, exist_ok=True)
    del arguments[at : at + 2]
browser, bad = Browser(), 0
for page in arguments:
    browser.errors.clear()
    browser.call("Page.navigate", url="file://" + os.path.abspath(page))
    time.sleep(1.5)
    sections = json.loads(browser.run("JSON.stringify([...document.querySelectorAll('section > h2')].map((h) => h.textContent))"))
    print(f"{page}: {len(sections)} sections: {', '.join(sections)}")
    for r in json.loads(browser.run(TURN)):
        fine = r["focused"] and min(r["drawn"], r["turned"], r["zoomed"]) > 100 and r["cut"] > 0
        bad += not fine
        print(f"  {'ok ' if fine else 'BAD'} {r['label']}: {r['drawn']} pixels, {r['turned']} change by turning, {r['cut']} by "
              f"cutting, {r['zoomed']} by zooming; {r['milliseconds']:.0f} ms a frame (software)")
    back = "getComputedStyle(document.body).backgroundColor"
    light = browser.run(back)
    browser.run("document.getElementById('theme').click()")
    bad += light == browser.run(back)
    fetched = browser.run("performance.getEntriesByType('resource').filter((e) => !e.name.startsWith('data:')).length")
    bad += fetched != 0 or bool(browser.errors)
    print(f"  {fetched} requests, errors: {browser.errors or 'none'}")
    if pictures:
        name = os.path.splitext(os.path.basename(page))[0]
        browser.run("window.scrollTo(0, 0)")
        browser.picture(os.path.join(pictures, f"{name}-dark.png"))
browser.close()
sys.exit(1 if bad else 0)
