"""Open pages in headless Chromium: no error on the console, pictures draw and turn, keys work, light and dark.

python drive.py PAGE.html … [--pictures FOLDER] [--studio URL]; needs Chromium and the package websocket-client. With a studio its
form is filled in as a person does: pictures change, a wrong tensor keeps the last picture, files come down.
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
        self.socket, self.count, self.errors = websocket.create_connection(address, timeout=300), 0, []
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
    // Two fingers move apart.
    const finger = (kind, pointerId, x) => canvas.dispatchEvent(new PointerEvent(kind, { pointerId, pointerType: "touch", clientX: x, clientY: 100, bubbles: true }));
    canvas.setPointerCapture = () => {};
    finger("pointerdown", 8, 100); finger("pointerdown", 9, 140); finger("pointermove", 9, 180); finger("pointerup", 8, 100); finger("pointerup", 9, 180); await frame();
    const pinched = seen();
    const mine = new KeyboardEvent("keydown", { key: "+", ctrlKey: true, bubbles: true, cancelable: true });
    const left = canvas.dispatchEvent(mine);
    results.push({ label: canvas.getAttribute("aria-label").split(".")[0], focused: document.activeElement === canvas, drawn,
      turned: differs(before, turned), cut: differs(turned, cut), zoomed: differs(cut, zoomed), pinched: differs(zoomed, pinched), left, milliseconds });
  }
  return JSON.stringify(results);
})()"""

STUDIO = """(async () => {
  const wait = async (what, done) => { for (let i = 0; i < 600; i++) { if (done()) return; await new Promise((r) => setTimeout(r, 50)); } throw new Error(`never: ${what}`); };
  const at = (id) => document.getElementById(id), out = {};
  const type = (id, value) => { at(id).focus(); at(id).value = value; at(id).dispatchEvent(new Event("input", { bubbles: true })); };
  const answered = async (change) => { const before = document.body.dataset.answered; change(); await wait("an answer", () => document.body.dataset.answered !== before); };
  const frame = () => new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(r)));
  const seen = async () => { await frame(); const canvas = document.querySelector("#scene canvas"), gl = canvas.getContext("webgl2"), p = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, p); return p.reduce((a, x, i) => (a * 31 + x * (i % 97 + 1)) >>> 0, 7); };
  const title = () => at("title").textContent, error = () => at("scene").querySelector("figcaption").textContent;
  await wait("the first answer", () => document.body.dataset.answered);
  out.first = title(); const first = await seen();
  await answered(() => { type("kind-of-tensor", "matrix"); type("name", "typed"); type("matrix", "49 13 13 0 0 0\\n13 49 13 0 0 0\\n13 13 49 0 0 0\\n0 0 0 13 0 0\\n0 0 0 0 13 0\\n0 0 0 0 0 13"); });
  out.matrix = title(); const cubic = await seen(); out.changed = cubic !== first;
  await answered(() => type("matrix", "49 13 13 0 0 0\\n13 49 13 0 0 0\\n13 13 4x 0 0 0\\n0 0 0 13 0 0\\n0 0 0 0 13 0\\n0 0 0 0 0 13"));
  out.wrong = at("wrong").hidden ? "" : at("wrong").textContent; out.kept = title() === "typed" && (await seen()) === cubic;
  await answered(() => { type("kind-of-tensor", "components"); type("class", "cubic"); for (const [n, v] of [["c11", "49"], ["c12", "13"], ["c44", "13"]]) { const input = document.querySelector(`#constants [aria-label=${n}]`); input.value = v; input.dispatchEvent(new Event("input", { bubbles: true })); } });
  out.components = at("wrong").hidden; out.same = (await seen()) === cubic;
  await answered(() => { type("kind-of-tensor", "engineering"); type("class", "isotropic"); for (const [n, v] of [["e", "70"], ["nu", "0.25"]]) { const input = document.querySelector(`#constants [aria-label=${n}]`); input.value = v; input.dispatchEvent(new Event("input", { bubbles: true })); } });
  out.engineering = at("wrong").hidden;
  await answered(() => { type("kind-of-tensor", "text"); });
  out.text = at("text").value.includes("[engineering]") && at("wrong").hidden;
  await answered(() => { type("model", "hybrid"); type("horizon", "3"); });
  out.command = at("command").textContent;
  // Many keys in a row: the last one is what stands there in the end.
  await answered(() => { type("kind-of-tensor", "name"); for (const name of ["K", "KI", "KIO", "KIO3", "Te2", "Te2W"]) type("builtin", name); });
  await wait("the last of many", () => title() === "Te2W");
  out.last = title(); out.state = at("state").textContent;
  out.files = []; for (const a of document.querySelectorAll("#files a")) { const r = await fetch(a.href); out.files.push([a.textContent, r.status, (await r.blob()).size]); }
  out.canvases = document.querySelectorAll("canvas").length;
  at("save").click(); await wait("saved", () => at("saved").textContent.startsWith("saved in"));
  out.saved = at("saved").textContent;
  out.named = [...document.querySelectorAll("form :is(input,select,textarea)")].every((e) => e.labels?.length || e.getAttribute("aria-label"));
  return JSON.stringify(out);
})()"""


def studio(browser, url, pictures):
    """Fills in the form; the number of things that are wrong."""
    browser.errors.clear()
    browser.call("Page.navigate", url=url)
    time.sleep(1)
    answer = browser.run(STUDIO)
    out = json.loads(answer) if answer else {}
    bad = 0
    for name, fine in {
        "a built-in material is shown": out.get("first") == "KIO3",
        "a typed matrix is calibrated": out.get("matrix") == "typed",
        "its picture is another": out.get("changed"),
        "a wrong number is said": "row 3 column 3" in out.get("wrong", ""),
        "and the last picture stays": out.get("kept"),
        "components of a class": out.get("components"),
        "are the same tensor": out.get("same"),
        "engineering constants": out.get("engineering"),
        "become the text of a file": out.get("text"),
        "the command is told": "--model hybrid" in out.get("command", "") and "--horizon 3" in out.get("command", ""),
        "of many keys the last counts": out.get("last") == "Te2W",
        "files come down": len(out.get("files", [])) >= 8 and all(f[1] == 200 and f[2] > 0 for f in out["files"]),
        "old pictures are not left": out.get("canvases") == 2,
        "all is saved": "Te2W-hybrid" in out.get("saved", ""),
        "every field has a name": out.get("named"),
        "no error on the console": not browser.errors,
    }.items():
        bad += not fine
        print(f"  {'ok ' if fine else 'BAD'} {name}")
    if bad:
        print(out, browser.errors)
    if pictures:
        browser.picture(os.path.join(pictures, "studio.png"))
    return bad


arguments = sys.argv[1:]
pictures = None
if "--pictures" in arguments:
    at = arguments.index("--pictures")
    pictures = arguments[at + 1]
    os.makedirs(pictures, exist_ok=True)
    del arguments[at : at + 2]
address = None
if "--studio" in arguments:
    at = arguments.index("--studio")
    address = arguments[at + 1]
    del arguments[at : at + 2]
browser, bad = Browser(), 0
for page in arguments:
    browser.errors.clear()
    browser.call("Page.navigate", url="file://" + os.path.abspath(page))
    for _ in range(100):
        if browser.run("document.readyState === 'complete' && document.querySelectorAll('section').length"):
            break
        time.sleep(0.1)
    time.sleep(0.5)
    sections = json.loads(browser.run("JSON.stringify([...document.querySelectorAll('section > h2')].map((h) => h.textContent))"))
    print(f"{page}: {len(sections)} sections: {', '.join(sections)}")
    bad += not sections
    for r in json.loads(browser.run(TURN)):
        fine = r["focused"] and r["left"] and min(r["drawn"], r["turned"], r["zoomed"], r["pinched"]) > 100 and r["cut"] > 0
        bad += not fine
        print(f"  {'ok ' if fine else 'BAD'} {r['label']}: {r['drawn']} pixels, {r['turned']} change by turning, {r['cut']} by "
              f"cutting, {r['zoomed']} by zooming, {r['pinched']} by two fingers; {r['milliseconds']:.0f} ms a frame (software)")
    back = "getComputedStyle(document.body).backgroundColor"
    light = browser.run(back)
    browser.run("document.getElementById('theme').click()")
    bad += light == browser.run(back)
    fetched = browser.run("performance.getEntriesByType('resource').filter((e) => !/^(data|blob):/.test(e.name)).length")
    # On paper: every picture has a copy, which is not empty, and nothing of it is left afterwards.
    copies = browser.run("""dispatchEvent(new Event('beforeprint')); const copies = [...document.querySelectorAll('.paper')];
      const filled = copies.filter((c) => new Set(c.getContext('2d').getImageData(0, 0, c.width, c.height).data).size > 8).length;
      dispatchEvent(new Event('afterprint')); [filled, document.querySelectorAll('.view').length, document.querySelectorAll('.paper').length].join()""")
    filled, views, kept = map(int, copies.split(","))
    bad += filled != views or kept != 0
    print(f"  {filled} of {views} pictures on paper")
    bad += fetched != 0 or bool(browser.errors)
    print(f"  {fetched} requests, errors: {browser.errors or 'none'}")
    if pictures:
        name = os.path.splitext(os.path.basename(page))[0]
        browser.run("window.scrollTo(0, 0)")
        browser.picture(os.path.join(pictures, f"{name}-dark.png"))
if address:
    print(address.rsplit("/", 2)[0] + "/…: the studio")
    bad += studio(browser, address, pictures)
browser.close()
sys.exit(1 if bad else 0)
