#!/usr/bin/env python3
"""Works with `rayrep studio` in Chromium without a window, by mouse and keys.

    check_page.py RAYREP [--pictures FOLDER]

Ends with 77, which ctest takes for skipped, where there is no Chromium. Meshes are those of examples/; --pictures leaves there what
was seen.
"""

import json
import os
import pathlib
import re
import select
import shutil
import subprocess
import sys
import tempfile
import time

kRoot = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(kRoot / "tests" / "report"))

import browser  # noqa: E402
from browser import expect, kBegun, problems  # noqa: E402

kSkipped = 77


class Server:
    """rayrep studio, and where it answers."""

    def __init__(self, tool, folder, *arguments):
        self.process = subprocess.Popen([tool, "studio", *arguments, "--port", "0", "--no-open"], cwd=folder,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        told = b""
        until = time.monotonic() + 60
        self.address = None
        while not self.address:
            if not select.select([self.process.stdout], [], [], max(0, until - time.monotonic()))[0]:
                raise RuntimeError(f"rayrep studio does not tell its address: {told}")
            got = os.read(self.process.stdout.fileno(), 4096)
            if not got:
                raise RuntimeError(f"rayrep studio has ended: {told}")
            told += got
            found = re.search(rb"http://127\.0\.0\.1:\d+/[0-9a-f]{32}/(?=\s)", told)
            self.address = found and found.group().decode()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(20)


class Page:
    """The studio in a browser."""

    def __init__(self, chromium, address, pictures, downloads):
        self.chromium = chromium
        self.pictures = pictures
        self.downloads = downloads
        chromium.local += (address,)
        chromium.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(downloads))
        chromium.visit(address)

    def js(self, text):
        return self.chromium.evaluate(text)

    def of(self, text):
        """Of the studio itself."""
        return self.js(f"window.rayrep.studio.{text}")

    def settings(self):
        return json.loads(self.js("JSON.stringify(window.rayrep.studio.draft.settings)"))

    def wait(self, condition, words, seconds=120):
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            if self.js(f"Boolean({condition})"):
                self.chromium.settle()
                return
            time.sleep(0.05)
        problem = self.js("document.querySelector('.refusal')?.textContent ?? ''")
        if self.pictures:
            self.look("stuck")
        raise RuntimeError(f"waited for in vain: {words}. {problem}")

    def centre(self, selector):
        return self.js(f"""(element => {{
          element.scrollIntoView({{block: 'nearest', behavior: 'instant'}});
          const {{x, y, width, height}} = element.getBoundingClientRect();
          return [x + width / 2, y + height / 2];
        }})(document.querySelector({json.dumps(selector)}))""")

    def click(self, selector):
        x, y = self.centre(selector)
        self.chromium.mouse("mousePressed", x, y)
        self.chromium.mouse("mouseReleased", x, y)
        self.chromium.settle()

    def type(self, name, text):
        """Into the field of a setting, and Enter."""
        self.js(f"""(input => {{
          for (let fold = input.closest('details:not([open])'); fold; fold = input.closest('details:not([open])')) fold.open = true;
          input.focus();
          input.select();
        }})(document.querySelector('#setting-{name}'))""")
        self.chromium.call("Input.insertText", text=text)
        self.chromium.key("Enter")
        self.chromium.settle()

    def drag(self, selector, way, steps):
        """Takes hold, moves, and leaves the button pressed. @returns where the hand is, and what was shown at each step"""
        x, y = self.resting(selector)
        self.chromium.mouse("mousePressed", x, y)
        seen = []
        for _ in range(steps):
            x, y = x + way[0], y + way[1]
            self.chromium.mouse("mouseMoved", x, y)
            time.sleep(0.12)
            seen.append((self.of("previewCount"), self.of("preview?.sequence ?? 0"), self.figures(), self.verdict()))
        return (x, y), seen

    def resting(self, selector):
        """Where the middle of something is that may still be moving."""
        place = None
        for _ in range(50):
            self.chromium.settle()
            last, place = place, self.centre(selector)
            if place == last:
                break
            time.sleep(0.1)
        return place

    def release(self, at):
        self.chromium.mouse("mouseReleased", *at)
        self.chromium.settle()

    def figures(self):
        return self.js("document.querySelector('.preview .figures')?.textContent ?? ''")

    def verdict(self):
        return self.js("document.querySelector('.status .verdict .word')?.textContent.replace(/[^A-Z ]/g, '') ?? ''")

    def wait_for_preview(self):
        self.wait("window.rayrep.studio.isCurrent(window.rayrep.studio.preview)", "the preview")

    def wait_for_run(self):
        self.wait("window.rayrep.studio.isCurrent(window.rayrep.studio.last)", "the verdict of a full run", 240)

    def undo(self, by=-1):
        self.chromium.key("z", "KeyZ", control=True, shift=by > 0)
        self.chromium.settle()

    def downloaded(self, name):
        until = time.monotonic() + 30
        while time.monotonic() < until:
            path = self.downloads / name
            if path.exists() and not list(self.downloads.glob("*.crdownload")):
                return path
            time.sleep(0.1)
        raise RuntimeError(f"{name} was not downloaded; there are {os.listdir(self.downloads)}")

    def look(self, name):
        if self.pictures:
            (self.pictures / f"{name}.png").write_bytes(self.chromium.picture())

    def complaints(self):
        """Without those that Chromium makes of every answer that refuses something."""
        return [one for one in self.chromium.complaints() if not re.match(r"Failed to load resource: .* status of 4\d\d", one)]


def check_columns(page):
    """The inside of a preview is drawn as a closed surface that faces into the void and encloses as much as the columns do."""
    open_edges, enclosed, volume = page.of("""preview && (({surface: {positions: p, triangles: t}, columns}) => {
      const edges = new Map();
      let six = 0;
      for (let n = 0; n < t.length; n += 3) {
        for (let k = 0; k < 3; ++k) {
          const from = t[n + k], to = t[n + (k + 1) % 3], key = Math.min(from, to) * 1e7 + Math.max(from, to);
          edges.set(key, (edges.get(key) ?? 0) + Math.sign(to - from));
        }
        const [a, b, c] = [0, 1, 2].map(k => [0, 1, 2].map(m => p[3 * t[n + k] + m]));
        six += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
      }
      const bytes = Uint8Array.from(atob(columns.bytes), c => c.charCodeAt(0)), numbers = new DataView(bytes.buffer);
      let length = 0;
      for (let at = 0; at < bytes.length; at += 12) length += numbers.getFloat32(at + 8, true) - numbers.getFloat32(at + 4, true);
      return [[...edges.values()].filter(sum => sum).length, -six / 6, length * columns.spacing_mm ** 2];
    })(window.rayrep.studio.preview)""")
    expect(open_edges == 0, f"the inside of a preview is closed: {open_edges} open edges")
    expect(abs(enclosed / volume - 1) < 0.02, f"and holds {enclosed:.0f} mm3, its columns {volume:.0f} mm3")


def check_float(page, tool, duck):
    page.chromium.choose("#file", duck)
    page.wait("window.rayrep.studio.draft.mesh", "the duck")
    expect(page.js("document.querySelector('h1').textContent") == "duck.stl", "a file that is chosen is shown")
    page.look("mesh")
    page.click("label:has(input[name=goal][value=float])")
    page.wait_for_preview()
    check_columns(page)
    page.type("resolution", "40")
    page.wait_for_run()
    expect(page.verdict() == "VERIFIED", "a goal is chosen, and a full run is made")
    page.look("verified")

    before = page.of("previewCount")
    hand, seen = page.drag(".handle.waterline", (0, -3), 15)
    page.look("dragging")
    sequences = [sequence for _, sequence, _, _ in seen]
    expect(seen[-1][0] - before > 3, f"while the waterline is dragged, previews come: {seen[-1][0] - before} in 15 steps")
    expect(sequences == sorted(sequences) and sequences[-1] > sequences[0], f"in their order: {sequences}")
    expect(len({figures for _, _, figures, _ in seen if figures}) > 3, "and the figures follow the hand")
    expect(not any(verdict for *_, verdict in seen), "none of which is shown as verified")
    page.release(hand)
    page.wait_for_run()
    expect(page.verdict() == "VERIFIED", "let go, it is made in full")
    page.look("made")
    waterline = page.settings()["waterline"]
    page.click(".downloads a.main")
    path = page.downloaded("duck_float.3mf")
    judged = subprocess.run([tool, "verify", str(path), "--waterline", waterline, "--original", str(duck), "-q"], capture_output=True,
                            text=True, check=False)
    expect(judged.returncode == 0, f"verify accepts the 3MF that was downloaded, at {waterline} mm {judged.stderr}")


def check_steps(page):
    """Undo, old answers, cancel, keys."""
    waterline = page.settings()["waterline"]
    page.js("window.rayrep.studio.status.auto.click()")
    page.js("document.querySelector('.field[data-name=wall] input[type=range]').focus()")
    page.chromium.key("ArrowRight")
    page.wait_for_preview()
    expect("wall" in page.settings(), f"an arrow key moves the slider of the wall: {page.settings()}")
    expect(page.verdict() == "", "then nothing is shown as verified")
    expect(page.js("getComputedStyle(document.querySelector('.old-words')).display") != "none", "and the run before is marked as old")
    page.look("old")
    page.undo()
    expect("wall" not in page.settings(), "Ctrl+Z takes it back")
    expect(page.verdict() == "VERIFIED", "what was verified before is shown again")
    page.undo()
    expect("waterline" not in page.settings() and page.settings().get("resolution") == "40", f"and so on: {page.settings()}")
    page.undo(1)
    expect(page.settings().get("waterline") == waterline, "Ctrl+Shift+Z brings it again")
    page.js("document.querySelector('.handle.waterline').focus()")
    page.chromium.key("ArrowUp")
    page.wait_for_preview()
    moved = page.settings()["waterline"]
    expect(float(moved) > float(waterline), f"an arrow key moves the waterline: {waterline} mm to {moved} mm")
    page.type("resolution", "400")  # so that the hand is faster than the run
    page.wait_for_preview()
    page.click(".run .main")
    page.wait("window.rayrep.studio.running?.number", "a run")
    page.click(".progress button")
    page.wait("!window.rayrep.studio.running", "the end of a run", 20)
    expect(page.verdict() == "" and page.js("!document.querySelector('.run .main').hidden"), "a run can be cancelled, and begun again")
    page.type("resolution", "40")
    page.wait_for_preview()
    page.click(".run .main")
    page.wait_for_run()
    expect(page.verdict() == "VERIFIED", "which does what the first would have done")


def check_handles(page):
    hand, _ = page.drag(".handle.up", (5, 0), 8)
    page.look("tilting")
    page.release(hand)
    up = page.settings().get("up", "")
    expect(re.fullmatch(r"(-?[\d.]+,){2}-?[\d.]+", up) is not None, f"what is up is dragged: {up}")
    page.wait("!window.rayrep.studio.previews.busy", "an answer")
    page.undo()
    page.wait("!window.rayrep.studio.previews.busy", "an answer")
    expect("up" not in page.settings(), "and taken back")
    page.click("label:has(input[name=cut][value=x])")
    count, at = page.of("previewCount"), page.of("stage.cutAt.textContent")
    hand, _ = page.drag(".handle.cut", (-6, 0), 6)
    page.look("cut")
    page.release(hand)
    expect(page.of("stage.cutAt.textContent") != at, f"the cut is dragged from {at} to {page.of('stage.cutAt.textContent')}")
    expect(page.of("previewCount") == count, "which asks for nothing")
    page.click("label:has(input[name=cut][value=none])")


def check_refusals(page):
    page.wait_for_run()
    lead = page.js("document.querySelector('.verdict .lead').textContent")
    page.type("waterline", "0.4")
    page.wait("document.querySelector('.refusal')", "a refusal")
    words = page.js("document.querySelector('.refusal').textContent")
    expect(len(words) > 30, f"a refusal is told in words: {words}")
    expect(page.verdict() == "" and page.js("document.querySelector('.look').classList.contains('old')"), "what is seen is marked as old")
    expect(page.js("document.querySelector('.preview.old .lead').textContent") == lead, "and is still there, in words too")
    page.look("refused")
    page.undo()
    page.type("wall", "-1")
    page.wait("document.querySelector('.refusal')", "a complaint")
    fault = page.js("document.querySelector('.field[data-name=wall] .fault').textContent")
    expect("positive" in fault, f"a setting that makes no sense is told beside it: {fault}")
    page.undo()
    expect(page.js("document.querySelector('.refusal') === null && document.querySelector('.field[data-name=wall] .fault').hidden"),
           "and no longer when it is taken back")


def check_files(page, folder, duck):
    hostile = folder / "<img src=x onerror=window.owned=1>.stl"
    shutil.copy(duck, hostile)
    x, y = page.centre(".look")
    page.chromium.drop(hostile, x, y)
    page.wait("window.rayrep.studio.draft.mesh.name.startsWith('<img')", "a file that is dropped")
    expect(page.js("document.querySelector('h1').textContent") == hostile.name, "a hostile name is shown as it is")
    page.wait_for_preview()
    expect(page.js("window.owned") is None, "and nothing of it is run")
    expect("waterline" not in page.settings(), "a waterline of another mesh is forgotten")
    page.undo()
    page.wait("window.rayrep.studio.draft.mesh.name === 'duck.stl'", "the mesh before")
    page.wait_for_preview()
    expect("waterline" in page.settings(), "undo brings back the mesh and its waterline")

    given = page.settings()
    page.js("[...document.querySelectorAll('.top button')].find(button => button.textContent === 'Save settings').click()")
    saved = page.downloaded("duck_float.json")
    config = json.loads(saved.read_text())
    expect(config["mesh"] == "duck.stl" and str(config["waterline"]) == given["waterline"], f"settings are saved: {config}")
    page.type("waterline", "")
    page.chromium.drop(saved, x, y)
    page.wait("'waterline' in window.rayrep.studio.draft.settings", "settings that are dropped")
    expect(page.settings() == given, "and are as before when they are dropped")
    return saved


def check_spin(page, bird):
    x, y = page.centre(".look")
    page.chromium.drop(bird, x, y)
    page.wait("window.rayrep.studio.draft.mesh.name === 'bird.stl'", "the bird")
    page.click("label:has(input[name=goal][value=spin])")
    page.wait_for_preview()
    before = page.of("previewCount")
    hand, seen = page.drag(".handle.point", (0.5, 0), 12)
    page.look("spin")
    expect(seen[-1][0] > before, "previews follow the contact point")
    page.release(hand)
    point = page.settings().get("point", "")
    expect(re.fullmatch(r"-?[\d.]+,-?[\d.]+,-?[\d.]+", point) is not None, f"the contact point is dragged to {point}")
    off = page.js(f"""(p => {{
      const {{positions: v, triangles: t}} = window.rayrep.studio.stage.bodies[0].mesh;
      let least = Infinity;
      for (let n = 0; n < t.length; n += 3) {{
        const [a, b, c] = [0, 1, 2].map(k => [0, 1, 2].map(m => v[3 * t[n + k] + m]));
        const e = b.map((x, m) => x - a[m]), f = c.map((x, m) => x - a[m]), g = p.map((x, m) => x - a[m]);
        const dot = (x, y) => x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
        const normal = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
        const size = Math.sqrt(dot(normal, normal));
        const det = dot(e, e) * dot(f, f) - dot(e, f) ** 2;
        const u = (dot(f, f) * dot(e, g) - dot(e, f) * dot(f, g)) / det, w = (dot(e, e) * dot(f, g) - dot(e, f) * dot(e, g)) / det;
        if (u > -0.01 && w > -0.01 && u + w < 1.01) least = Math.min(least, Math.abs(dot(g, normal)) / size);
      }}
      return least;
    }})([{point}])""")
    expect(off < 0.02, f"which lies on the surface: {off:.4f} mm off it")
    page.wait("!window.rayrep.studio.previews.busy", "its preview")
    page.js("[...document.querySelectorAll('.top button')].find(button => button.textContent === 'Copy command').click()")
    page.wait("document.querySelector('.shared textarea')", "a command line")
    command = page.js("document.querySelector('.shared textarea').value")
    expect(command.startswith("rayrep spin bird.stl") and f"--point {point}".replace("--point -", "--point=-") in command,
           f"the command line is there to be copied: {command}")


def check_layout(page):
    for width, dark in ((400, True), (400, False), (1600, True), (1600, False)):
        page.chromium.size(width, 900, dark, True)
        page.chromium.settle()
        over = page.js("document.documentElement.scrollWidth") - width
        expect(over <= 0, f"fits {width} pixels{', dark' if dark else ''}")
        outside = page.js("[...document.querySelectorAll('.handle:not([hidden])')].filter(handle => {"
                          "const a = handle.getBoundingClientRect(), b = document.querySelector('.stage').getBoundingClientRect();"
                          "return a.left < b.left || a.right > b.right || a.top < b.top || a.bottom > b.bottom; }).length")
        expect(outside == 0, "with all handles in the view")
        page.look(f"layout-{width}{'-dark' if dark else ''}")


def check_without_webgl(page, bird):
    page.wait("window.rayrep.studio.draft.mesh", "the mesh of the command line")
    page.click("label:has(input[name=goal][value=float])")
    page.wait_for_preview()
    expect(page.js("document.querySelectorAll('.preview .figures tr').length") > 2, "without WebGL there are figures")
    expect(page.js("document.querySelector('.section .material').getAttribute('d').length") > 500, "and a section")
    page.look("without-webgl")
    page.js("window.rayrep.studio.status.auto.click()")
    page.chromium.choose("#file", bird)
    page.wait("window.rayrep.studio.draft.mesh.name === 'bird.stl'", "the bird")
    page.undo()
    page.wait("window.rayrep.studio.draft.mesh.name === 'duck.stl'", "the duck of the command line")
    page.wait_for_preview()
    expect(page.js("document.querySelector('h1').textContent") == "duck.stl", "undo goes back to the mesh of the command line")
    expect(page.complaints() == [], f"nothing is complained of {page.complaints()}")


def main():
    arguments = sys.argv[1:]
    pictures = None
    if "--pictures" in arguments:
        pictures = pathlib.Path(arguments.pop(arguments.index("--pictures") + 1))
        arguments.remove("--pictures")
        pictures.mkdir(parents=True, exist_ok=True)
    if not browser.program():
        print("there is no Chromium: skipped")
        return kSkipped
    tool = os.path.abspath(arguments[0])
    folder = pathlib.Path(tempfile.mkdtemp(prefix="rayrep-studio-"))
    duck, bird = kRoot / "examples" / "duck.stl", kRoot / "examples" / "bird.stl"
    try:
        with Server(tool, folder) as server, browser.Browser() as chromium:
            (folder / "downloads").mkdir()
            chromium.size(1400, 1000, False, True)
            page = Page(chromium, server.address, pictures, folder / "downloads")
            page.look("empty")
            check_float(page, tool, duck)
            check_steps(page)
            check_handles(page)
            check_refusals(page)
            check_files(page, folder, duck)
            check_spin(page, bird)
            check_layout(page)
            expect(page.complaints() == [], f"nothing is complained of, nothing asked of another host {page.complaints()}")
            server.process.terminate()
            server.process.wait(20)
            page.type("wall", "2")
            page.wait("document.querySelector('.refusal')", "word of the end")
            expect("does not answer" in page.js("document.querySelector('.refusal').textContent"), "that the server has ended is told")
        with Server(tool, folder, str(duck)) as server, browser.Browser(webgl=False) as chromium:
            chromium.size(1400, 1000, False, True)
            check_without_webgl(Page(chromium, server.address, pictures, folder / "downloads"), bird)
    finally:
        shutil.rmtree(folder)
    print(f"{len(problems)} problems, {time.monotonic() - kBegun:.0f} s")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
