#!/usr/bin/env python3
"""Looks at pages of `rayrep --html` in Chromium without a window.

    check_page.py RAYREP [--pictures FOLDER]

Ends with 77, which ctest takes for skipped, where there is no Chromium. Pages are made of examples/ in a temporary folder;
--pictures leaves there what was seen.
"""

import hashlib
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time

import browser
from browser import expect, kBegun, problems

kRoot = pathlib.Path(__file__).resolve().parents[2]
kSkipped = 77


def check_sources():
    """The page that is committed is made of the sources that are."""
    digest = hashlib.sha256()
    folder = kRoot / "tools" / "report"
    for path in sorted(folder.iterdir(), key=lambda path: path.name):
        if re.search(r"\.(m?js|css|html|json)$", path.name):
            digest.update(f"{path.name}\n".encode() + path.read_bytes())
    told = re.search(r'name="rayrep-page-sources" content="(\w+)"', (kRoot / "src/report/page.html").read_text()).group(1)
    expect(told == digest.hexdigest(), "src/report/page.html is made of tools/report as it is (else run tools/report/bundle.sh)")


def run(tool, folder, *arguments, code=0):
    done = subprocess.run([tool, *arguments, "-q"], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != code:
        raise RuntimeError(f"rayrep {' '.join(arguments)} ended with {done.returncode}: {done.stderr}")


def triangles_in(stl):
    """Of a binary STL file."""
    data = stl.read_bytes()
    for n in range(struct.unpack_from("<I", data, 80)[0]):
        yield [struct.unpack_from("<3f", data, 84 + 50 * n + 12 + 12 * k) for k in range(3)]


def volume(stl):
    """mm3, by the divergence theorem."""
    return sum(a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
               for a, b, c in triangles_in(stl)) / 6


def section_area(stl, y):
    """Across y, mm2, by Green's theorem over the stretches that triangles cut."""
    area = 0.0
    for corners in triangles_in(stl):
        above = [p[1] >= y for p in corners]
        if all(above) or not any(above):
            continue
        into, out = None, None
        for k in range(3):
            p, q = corners[k], corners[(k + 1) % 3]
            if above[k] == above[(k + 1) % 3]:
                continue
            part = (y - p[1]) / (q[1] - p[1])
            point = (p[0] + part * (q[0] - p[0]), p[2] + part * (q[2] - p[2]))
            if above[k]:
                out = point
            else:
                into = point
        area += 0.5 * (into[0] * out[1] - into[1] * out[0])
    return abs(area)


class Page:
    """One page in a browser."""

    def __init__(self, chromium, pictures):
        self.chromium = chromium
        self.pictures = pictures

    def js(self, text):
        value = self.chromium.evaluate(text)
        self.chromium.settle()
        return value

    def look(self, name):
        """The canvas alone."""
        clip = self.js("""(stage => {
          stage.scrollIntoView({block: 'start', behavior: 'instant'});
          const {x, y, width, height} = stage.getBoundingClientRect();
          return {x: x + scrollX, y: y + scrollY, width, height};
        })(document.querySelector('.stage'))""")
        picture = self.chromium.picture(clip)
        if self.pictures:
            (self.pictures / f"{name}.png").write_bytes(picture)
        return picture

    def open(self, path, name):
        self.chromium.open(path)
        self.js("document.querySelector('.overlay').style.visibility = 'hidden'")
        expect(self.chromium.complaints() == [], f"{name}: nothing is complained of, nothing asked of a network "
               f"{self.chromium.complaints()}")
        if self.pictures:
            (self.pictures / f"{name}-page.png").write_bytes(self.chromium.picture(whole=True))


def colors_in(png):
    width, _, rows, step = browser.pixels(png)
    return {row[n:n + 3] for row in rows for n in range(0, width * step, step)}


def check_view(page):
    js, look, key = page.js, page.look, page.chromium.key
    first = look("first")
    expect(len(colors_in(first)) > 500, f"the view is not blank: {len(colors_in(first))} colors")
    expect(js("document.querySelector('.verdict .word').textContent").endswith("VERIFIED"), "the verdict comes first")
    # By keys alone: to the view, then to the cut.
    for _ in range(12):
        key("Tab")
        if js("document.activeElement.tagName") == "CANVAS":
            break
    expect(js("document.activeElement.matches('canvas:focus-visible')"), "Tab leads to the view, and that is seen")
    key("ArrowLeft")
    turned = look("turned")
    expect(turned != first, "an arrow key turns the body")
    key("Home")
    for _ in range(12):
        key("Tab")
        if js("document.activeElement.type") == "range":
            break
    expect(js("document.activeElement.getAttribute('aria-label')") == "Position of the cut", "Tab leads on to the cut")
    whole = look("whole")
    key("ArrowRight")
    cut = look("cut")
    place = js("document.activeElement.getAttribute('aria-valuetext')")
    expect(cut != whole, "an arrow key cuts the body")
    for _ in range(8):
        key("ArrowLeft")
    expect(look("moved") != cut, "and moves the cut")
    expect(js("document.activeElement.getAttribute('aria-valuetext')") != place, "which is told, too")
    before = look("before")
    js("document.querySelector('.legend input').focus()")
    key(" ", "Space")
    expect(look("hidden") != before, "the outside can be hidden")
    key(" ", "Space")
    expect(page.chromium.complaints() == [], f"still nothing is complained of {page.chromium.complaints()}")


def check_meshes(page, stl):
    read = page.js("""window.rayrep.page.bodies.reduce((sum, {mesh: {positions: p, triangles: t}}) => {
      for (let n = 0; n < t.length; n += 3) {
        const [a, b, c] = [0, 1, 2].map(k => [0, 1, 2].map(m => p[3 * t[n + k] + m]));
        sum += (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
      }
      return sum;
    }, 0)""")
    given = volume(stl)
    expect(abs(read / given - 1) < 1e-4, f"what the page has read encloses {read:.2f} mm3, the file {given:.2f} mm3")


def check_caps(page, stl):
    """Seen along y, the plane of a cut is drawn to scale: what is filled has the area of the section."""
    page.js("""(() => {
      const {page} = window.rayrep;
      document.querySelector('.stage').style.background = '#000';
      const colors = Object.fromEntries(Object.keys(page.view.colors).map(name => [name, '#000000']));
      page.view.paint({...colors, cap: '#00ff00', 'cap-hatch': '#00ff00'});
      page.view.hide('water', true);
      document.querySelector('input[name=cut][value=y]').click();
      page.lookFrom('Front');  // from -y: the half beyond the plane stays
      page.flipped = true;
    })()""")
    for step in (100, 70):
        y = page.js(f"""(() => {{
          const {{page}} = window.rayrep;
          page.range.value = {step};
          page.cut();
          page.view.outlines = null;
          page.view.applyCut();
          page.view.outlines = [];
          return page.view.cutBy.offset * page.view.cutBy.normal[1];
        }})()""")
        scale = page.js("""(() => {
          const {view} = window.rayrep.page, pose = view.orbit.pose();
          const far = pose.position[1] - view.cutBy.offset * view.cutBy.normal[1];
          return view.size[1] / (2 * Math.tan(pose.field / 2) * Math.abs(far));
        })()""")
        _, _, rows, bytes_a_pixel = browser.pixels(page.look(f"cap-{step}"))
        # Shine is white.
        colors = ((row[n], row[n + 1]) for row in rows for n in range(0, len(row), bytes_a_pixel))
        seen = sum(max(0, green - red) for red, green in colors) / 255 / scale**2
        area = section_area(stl, y)
        expect(abs(seen / area - 1) < 0.02, f"cut at y = {y:.2f} mm: filled {seen:.1f} mm2, the section has {area:.1f} mm2")


def check_layout(page):
    for width, dark in ((400, True), (700, False), (1600, True)):
        page.chromium.size(width, 900, dark, True)
        page.chromium.settle()
        over = page.js("document.documentElement.scrollWidth") - width
        expect(over <= 0, f"fits {width} pixels{', dark' if dark else ''}")
        crossing = page.js("""(() => {
          const boxes = [...document.querySelectorAll('.label:not([hidden]), .chart text')].map(one => one.getBoundingClientRect());
          const meet = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 3 && b.top < a.bottom - 3;
          return boxes.flatMap((a, n) => boxes.slice(0, n).filter(b => meet(a, b))).length;
        })()""")
        expect(crossing == 0, f"no label lies on another at {width} pixels")
    paper = "getComputedStyle(document.body).backgroundColor"
    dark = page.js(paper)
    page.chromium.size(1000, 900, False, True)
    expect(page.js(paper) != dark, "dark where that is preferred")


def main():
    arguments = sys.argv[1:]
    pictures = None
    if "--pictures" in arguments:
        pictures = pathlib.Path(arguments.pop(arguments.index("--pictures") + 1))
        arguments.remove("--pictures")
        pictures.mkdir(parents=True, exist_ok=True)
    check_sources()
    if problems:
        return 1
    if not browser.program():
        print("there is no Chromium: skipped")
        return kSkipped
    tool = os.path.abspath(arguments[0])
    folder = pathlib.Path(tempfile.mkdtemp(prefix="rayrep-pages-"))
    try:
        duck = kRoot / "examples" / "duck.stl"
        # A path that ends a script, if it is let.
        hostile = folder / "x<" / "script><script>window.owned=1<"
        hostile.mkdir(parents=True)
        shutil.copy(duck, hostile / "script><img src=x onerror=window.owned=2>.stl")
        run(tool, folder, "float", str(duck), "--resolution", "40", "-o", "duck.stl", "--html", "duck.html")
        run(tool, folder, "stand", str(kRoot / "examples/teapot.stl"), "--resolution", "40", "-o", "t.stl", "--html", "teapot.html")
        owned = hostile.relative_to(folder) / "script><img src=x onerror=window.owned=2>.stl"
        run(tool, folder, "verify", str(owned), "--waterline", "20", "--html", "failed.html", code=4)
        with browser.Browser() as chromium:
            page = Page(chromium, pictures)
            chromium.size(480, 480, False, True)
            page.open(folder / "duck.html", "duck")
            check_view(page)
            check_meshes(page, folder / "duck.stl")
            check_caps(page, folder / "duck.stl")
            page.open(folder / "teapot.html", "teapot")
            check_layout(page)
            page.open(folder / "failed.html", "failed")
            word = page.js("document.querySelector('.verdict .word').textContent")
            expect(word.endswith("NOT VERIFIED"), "what fails is not verified")
            expect("does not weigh" in page.js("document.querySelector('.failed').textContent"), "and it is told why")
            expect(page.js("window.owned") is None, "nothing of a file's name is run")
            expect("<img src=x" in page.js("document.querySelector('h1').textContent"), "but it is shown")
        with browser.Browser(webgl=False) as chromium:
            page = Page(chromium, pictures)
            chromium.size(1000, 900, False, True)
            page.open(folder / "duck.html", "without-webgl")
            expect("does not draw in 3D" in page.js("document.querySelector('.warning').textContent"), "without WebGL that is told")
            expect(page.js("document.querySelectorAll('.figures tbody tr').length") > 5, "all figures are there")
            expect(len(page.js("document.querySelector('.section .material').getAttribute('d')")) > 1000, "and a section")
    finally:
        shutil.rmtree(folder)
    print(f"{len(problems)} problems, {time.monotonic() - kBegun:.0f} s")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
