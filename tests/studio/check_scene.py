#!/usr/bin/env python3
"""Looks at pages of `rayrep motion --html`, and works with `rayrep studio SCENE`, in Chromium without a window.

    check_scene.py RAYREP [--pictures FOLDER]

Ends with 77, which ctest takes for skipped, where there is no Chromium. Scenes are made here, of boxes; --pictures leaves there what
was seen.
"""

import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import urllib.request

kRoot = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(1, str(kRoot / "tests" / "report"))

import browser  # noqa: E402
from browser import expect, kBegun, problems  # noqa: E402
from check_page import Server, kSkipped  # noqa: E402  of the studio: it lies beside


def box(low, high):
    """As OBJ."""
    corners = [[(low, high)[n >> k & 1][k] for k in range(3)] for n in range(8)]
    faces = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]
    return "".join("v %r %r %r\n" % tuple(map(float, p)) for p in corners) + "".join("f %d %d %d\n" % tuple(v + 1 for v in f) for f in faces)


def write_scene(folder, name, boxes, states, transitions, **more):
    parts = {}
    for part, (low, high) in boxes.items():
        (folder / f"{name}_{part}.obj").write_text(box(low, high))
        parts[part] = {"mesh": f"{name}_{part}.obj"}
    path = folder / f"{name}.json"
    path.write_text(json.dumps({"parts": parts, "states": states, "transitions": transitions, **more}))
    return path


def crossing(folder, name, wall_y):
    """A bar that goes along x and one that goes along z meet in the middle; a wall beside them hides that from one side. And a lid
    that turns, on another way."""
    return write_scene(
        folder, name,
        {"along": ([-30, -2, -2], [-20, 2, 2]), "down": ([-2, -2, 20], [2, 2, 30]), "wall": ([-60, wall_y - 1, -60], [60, wall_y + 1, 60]),
         "lid": ([40, -30, 70], [60, -10, 74])},
        {"apart": {}, "over": {"poses": {"along": {"at": [50, 0, 0]}, "down": {"at": [0, 0, -50]}}},
         "turned": {"poses": {"lid": {"axis": [1, 0, 0], "deg": 80}}}},
        [{"name": "cross", "from": "apart", "to": "over"},
         {"name": "turn", "from": "apart", "to": "turned",
          "motions": {"lid": {"translation": [{"time": 0.25, "at": [0, -5, 9], "in": [0, 0, 5], "out": [3, -9, 11]}]}}}])


def passing(folder):
    """A block that goes through a post between two gates; over the way another post hangs."""
    return write_scene(
        folder, "passing",
        {"block": ([-35, -3, -3], [-29, 3, 3]), "post": ([-2, -20, -8], [2, 20, 8]), "beam": ([-4, -20, 16], [4, 20, 22])},
        {"left": {}, "right": {"poses": {"block": {"at": [64, 0, 0]}}}}, [{"name": "go by", "from": "left", "to": "right"}])


def crane(folder):
    """A tower with an arm on a hinge: it hangs, its arm balanced or not, stands, and falls over; and what it is then on a way."""
    on_hinge = {"hinges": [{"point": [5, 0, 80], "axis": "y", "parts": ["arm"]}]}
    return write_scene(
        folder, "crane", {"tower": ([-15, -15, 0], [15, 15, 60]), "arm": ([-25, -8, -8], [35, 8, 8])},
        {"hung": {"poses": {"arm": {"at": [0, 0, 80]}}, "rests": {"kind": "hangs", "point": [1.11, 0, 110]}, **on_hinge},
         "standing": {"poses": {"arm": {"at": [0, 0, 80]}}, "rests": "stands"},
         "falling": {"poses": {"arm": {"at": [80, 0, 80]}}, "rests": "stands"}, "free": {"poses": {"arm": {"at": [0, 0, 90]}}}},
        [{"name": "lift", "from": "hung", "to": "falling"}])


def told(tool, scene, *arguments):
    done = subprocess.run([tool, "motion", str(scene), "--json", *arguments], cwd=scene.parent, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 4):
        raise RuntimeError(f"rayrep motion {scene}: {done.stderr}")
    return json.loads(done.stdout)


def intervals(pairs):
    return [[(one["kind"], one["from"], one["to"]) for one in pair["intervals"]] for pair in pairs]


# ------------------------------------------------------------------------------------------------------------------- mathematics


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def turned(q, v):
    """By its matrix, which the page does not use."""
    w, x, y, z = q
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    return [dot(row, v) for row in rows]


def pose_at(motion, t):
    """By Bernstein's polynomials, and by turning from one attitude on about the axis to the next."""
    def piece(keys):
        n = next(n for n in range(len(keys) - 1) if t <= keys[n + 1]["time"])
        return keys[n], keys[n + 1], (t - keys[n]["time"]) / (keys[n + 1]["time"] - keys[n]["time"])

    a, b, f = piece(motion["translation"])
    weights = [(1 - f)**3, 3 * (1 - f)**2 * f, 3 * (1 - f) * f * f, f**3]
    x = [sum(w * p[k] for w, p in zip(weights, (a["at"], a["out"], b["in"], b["at"]))) for k in range(3)]
    a, b, f = piece(motion["rotation"])
    p, q = a["rotation"], b["rotation"]
    c = [p[0], -p[1], -p[2], -p[3]]
    by = product(q, c)
    if by[0] < 0:
        by = [-n for n in by]
    half = math.atan2(math.hypot(*by[1:]), by[0])
    axis = [n / (math.hypot(*by[1:]) or 1) for n in by[1:]]
    return x, product([math.cos(f * half)] + [math.sin(f * half) * n for n in axis], p)


def product(a, b):
    return [a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]]


# -------------------------------------------------------------------------------------------------------------------------- page


class Page:
    def __init__(self, chromium, pictures):
        self.chromium = chromium
        self.pictures = pictures
        self.page = "window.rayrep.page"

    def js(self, text):
        value = self.chromium.evaluate(text)
        self.chromium.settle()
        return value

    def of(self, text):
        return json.loads(self.js(f"JSON.stringify({self.page}.{text})"))

    def rect(self, selector):
        return self.js(f"""(element => {{
          element.scrollIntoView({{block: 'nearest', behavior: 'instant'}});
          const {{x, y, width, height}} = element.getBoundingClientRect();
          return [x, y, width, height];
        }})(document.querySelector({json.dumps(selector)}))""")

    def click(self, selector):
        x, y, width, height = self.rect(selector)
        self.press(x + width / 2, y + height / 2)

    def press(self, x, y):
        self.chromium.mouse("mousePressed", x, y)
        self.chromium.mouse("mouseReleased", x, y)
        self.chromium.settle()

    def drag(self, selector, way, steps=4):
        x, y, width, height = self.rect(selector)
        x, y = x + width / 2, y + height / 2
        self.chromium.mouse("mousePressed", x, y)
        for n in range(steps):
            self.chromium.mouse("mouseMoved", x + way[0] * (n + 1) / steps, y + way[1] * (n + 1) / steps)
            self.chromium.settle()
        self.chromium.mouse("mouseReleased", x + way[0], y + way[1])
        self.chromium.settle()

    def seen(self, selector=".stage"):
        x, y, width, height = self.rect(selector)
        return self.chromium.picture({"x": x, "y": y, "width": width, "height": height})

    def look(self, name):
        if self.pictures:
            (self.pictures / f"scene-{name}.png").write_bytes(self.chromium.picture(whole=True))

    def wait(self, condition, words, seconds=60):
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            if self.js(f"Boolean({condition})"):
                return
            time.sleep(0.05)
        self.look("stuck")
        raise RuntimeError(f"waited for in vain: {words}")


def reds(png):
    """Pixels that are marked."""
    width, _, rows, step = browser.pixels(png)
    return sum(row[n] > 170 and row[n + 1] < 90 and row[n + 2] < 90 for row in rows for n in range(0, width * step, step))


def check_poses(page):
    """The page puts parts where the scene says."""
    scene = page.of("scene")
    worst = 0
    for n, way in enumerate(scene["transitions"]):
        for t in (0, 0.1, 0.25, 0.37, 0.8, 1):
            poses = page.of(f"posesAt({{transition: {n}, time: {t}, state: null}})")
            for motion, pose in zip(way["motions"], poses):
                x, q = pose_at(motion, t)
                worst = max(worst, math.dist(x, pose["translation"]), 1 - abs(dot(q, pose["rotation"])))
    expect(worst < 1e-9, f"parts are where Bezier curves and slerp have them, to {worst:.1g}")


def check_report(page, tool, folder):
    scene = crossing(folder, "front", -12)
    html = folder / "front.html"
    report = told(tool, scene, "--html", str(html))
    page.chromium.open(html)
    expect(page.chromium.complaints() == [], f"nothing is complained of, nothing asked of a network {page.chromium.complaints()}")
    page.look("first")
    expect(page.js("document.querySelector('.verdict .word').textContent").endswith("OVERLAPS") and not report["pass"], "the verdict comes first")
    expect(intervals(page.of("found.pairs")) == intervals(report["pairs"]), "the page has the intervals of the report")
    check_poses(page)
    before = page.seen()
    expect(reds(before) == 0, "in a state nothing is marked")
    page.click(".interval.overlap")
    page.chromium.settle()
    chosen = page.of("chosen")
    worst = chosen["pair"]["intervals"][chosen["interval"]]["worst"]
    expect(page.of("now.time") == worst["time"], f"a click on an interval goes to its worst moment, {worst['time']:.3f}")
    page.wait("!document.querySelector('canvas') || (window.rayrep.page.view.waiting === 0)", "the drawing")
    after = page.seen()
    expect(reds(after) > 50, f"and box and contour are drawn: {reds(after)} pixels")
    page.look("collision")
    towards = page.of("view.orbit.pose().towards")
    expect(towards[1] > 0.99, f"the camera looks across both motions, from the side without a wall: {towards}")
    ghosts = page.of(f"momentOf({page.page}.now, {page.page}.chosen).ghosts")
    expect([len(one["list"]) for one in ghosts] == [2, 2], "ghosts of both parts at the ends of the collision")
    page.click(".segments input[value=off]")
    expect(page.seen() != after, "which can be taken away")
    expect(page.chromium.complaints() == [], f"without complaints {page.chromium.complaints()[:3]}")
    other = crossing(folder, "back", 12)
    told(tool, other, "--html", str(folder / "back.html"))
    page.chromium.open(folder / "back.html")
    page.click(".interval.overlap")
    towards = page.of("view.orbit.pose().towards")
    expect(towards[1] < -0.99, f"with the wall at the other side from the other side: {towards}")


def balanced(tool, folder, *arguments):
    done = subprocess.run([tool, "balance", *arguments, "--json"], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 4):
        raise RuntimeError(f"rayrep balance {arguments}: {done.stderr}")
    return json.loads(done.stdout)


def nodes(page):
    """What the graph says of each state."""
    return page.js("[...document.querySelectorAll('.graph .node')].map(node => node.classList[1] ?? '').join()").replace("now", "")


def oranges(png):
    """Pixels in the colour of cavities."""
    width, _, rows, step = browser.pixels(png)
    return sum(row[n] > row[n + 1] + 30 > row[n + 2] + 40 for row in rows for n in range(0, width * step, step))


def check_balance(page, tool, folder):
    """The page of `rayrep balance --html`: of each state how it rests."""
    scene = crane(folder)
    report = balanced(tool, folder, scene.name, "--as-is", "--html", "crane.html")
    page.chromium.open(folder / "crane.html")
    expect(page.chromium.complaints() == [], f"nothing is complained of {page.chromium.complaints()}")
    expect([one["pass"] for one in report["states"]] == [True, True, False] and nodes(page) == "good,good,bad,",
           f"states have the colours of their verdicts, one that need not rest has none: {nodes(page)}")
    words = page.js("[...document.querySelectorAll('.verdict .word')].map(one => one.textContent).join()")
    expect(words.endswith("FREE") and "DOES NOT REST" in words, f"the verdict of both comes first: {words}")
    expect(page.of("now.state") == 2 and "falls over" in page.js("document.querySelector('.resting').textContent"), "the state that fails is shown first, in words")
    page.look("balance-falling")
    page.js("document.querySelectorAll('.line.good')[0].click()")
    hung = report["states"][0]["after"]
    items = page.of("overlay.items.map(({group, kind, at, from, to}) => ({group, kind, at, from, to}))")
    centre = next(one["at"] for one in items if one["group"] == "mass")
    expect(page.of("now.state") == 0 and math.dist(centre, hung["centre_of_mass_mm"]) < 1e-9, f"a click on a line goes there; the centre of mass: {centre}")
    plumb = next(one for one in items if one["group"] == "spin" and one["kind"] == "line")
    expect(plumb["to"] == [1.11, 0, 110] and math.dist(plumb["from"], [1.11, 0, centre[2]]) < 1e-9, f"point and plumb line: {plumb}")
    hinge = next(one for one in items if one["group"] == "hinge" and one["kind"] == "line")
    expect(hinge["from"][0] == hinge["to"][0] == 5 and hinge["from"][2] == hinge["to"][2] == 80, "and the hinge")
    page.js("document.querySelectorAll('.graph .node')[1].dispatchEvent(new MouseEvent('click'))")
    foot = page.of("overlay.items.find(({group}) => group === 'support').corners")
    expect(sorted(foot) == [[-15, -15, 0], [-15, 15, 0], [15, -15, 0], [15, 15, 0]], f"of what stands the foot: {foot}")
    page.js("document.querySelectorAll('.graph .node')[3].dispatchEvent(new MouseEvent('click'))")
    expect(page.of("overlay.items") == [] and page.js("document.querySelector('.marked').children.length") == 0, "nothing is marked where it need not rest")


def check_insides(page, tool, folder):
    """What floats has water, and what is hollow is seen."""
    boat = kRoot / "examples/scenes/boat.json"
    report = balanced(tool, folder, str(boat), "--resolution", "40", "-o", "boat", "--html", "boat.html")
    page.chromium.open(folder / "boat.html")
    expect(page.chromium.complaints() == [], f"nothing is complained of {page.chromium.complaints()}")
    expect(report["pass"] and nodes(page) == "good,good", "a boat that floats in both states is told so")
    height = page.of("momentOf(window.rayrep.page.now, null).attitude.waterline")
    # By Archimedes: below the waterline lie as many mm3 as it weighs mg. Its lowest point is at 0 in its first state.
    after = report["states"][0]["after"]
    expect(abs(after["pose_1_displaced_mass_g"] / report["mass_g"] - 1) < 1e-3 and 0 < height < 18.3, f"water stands at {height:.2f} mm")
    seen = page.seen()
    page.js("(range => { range.value = 100; range.dispatchEvent(new Event('input')); })(document.querySelector('input[aria-label^=\"How opaque\"]'))")
    shut = page.seen()
    expect(oranges(seen) > 400 > 20 > oranges(shut), f"cavities are seen through the outside, {oranges(seen)} pixels, or not, {oranges(shut)}")
    page.look("balance-boat")


def check_keys(page):
    key = page.chromium.key
    page.js("document.activeElement.blur()")
    for _ in range(40):
        key("Tab")
        if page.js("document.activeElement.getAttribute('role')") == "slider":
            break
    expect(page.js("document.activeElement.matches('.ruler:focus-visible')"), "Tab leads to the time, and that is seen")
    key("Home")
    key("ArrowRight")
    expect(abs(page.of("now.time") - 0.01) < 1e-9, "an arrow key moves it by a hundredth")
    key("n")
    expect(page.of("chosen") is not None, "n goes to the next collision")
    key("Escape")
    expect(page.of("chosen") is None, "Esc leaves it")
    x, y, width, height = page.rect(".ruler")
    page.press(x + 0.75 * width, y + height / 2)
    expect(abs(page.of("now.time") - 0.75) < 0.01, f"a click on the ruler moves it there: {page.of('now.time'):.3f}")
    page.js("document.querySelectorAll('.graph .node')[2].dispatchEvent(new MouseEvent('click'))")
    now = page.of("now")
    expect(now["state"] == 2 and now["transition"] == 1 and page.of(f"posesAt({page.page}.now)") == page.of("scene.states[2].poses"),
           f"a click on a state shows it, on a way that ends there: {now}")
    expect(page.js("[...document.querySelectorAll('.graph .edge')].map(e => e.classList[1]).join()") == "overlap,free", "ways are told by colour")
    page.js("document.querySelector('.play').click()")
    page.wait(f"{page.page}.now.time > 0.05 && {page.page}.now.state === null", "play", 10)
    page.js("document.querySelector('.play').click()")
    stopped = page.of("now.time")
    time.sleep(0.2)
    expect(page.of("now.time") == stopped, "it plays, and stops")


def check_widths(page, html):
    for width, dark in ((400, True), (1600, False)):
        page.chromium.size(width, 900, dark=dark, still=True)
        page.chromium.open(html)
        page.click(".interval.overlap")
        page.look(f"{width}-{'dark' if dark else 'light'}")
        wide = page.js("document.documentElement.scrollWidth")
        expect(wide <= width, f"{width} pixels are wide enough: {wide}")
    page.chromium.size(1000, 760, still=True)


def check_without_webgl(html):
    with browser.Browser(webgl=False) as chromium:
        chromium.size(1000, 900)
        page = Page(chromium, None)
        chromium.open(html)
        page.click(".interval.overlap")
        expect(page.js("Boolean(document.querySelector('.warning')) && !document.querySelector('canvas')"), "without WebGL it says so")
        expect("overlap" in page.js("document.querySelector('.told').textContent"), "and timeline and words are there")
        expect(chromium.complaints() == [], f"without complaints {chromium.complaints()}")


# ------------------------------------------------------------------------------------------------------------------------ studio


def complete(page):
    page.wait("!window.rayrep.studio.checks.busy && window.rayrep.studio.page.found.stage === 'complete'", "the check")


def saved(page, folder):
    """What would be saved, as a scene of its own."""
    text = page.js("""fetch('scene/file', {method: 'POST', body: JSON.stringify(window.rayrep.studio.edited)})
      .then(answer => answer.text())""")
    path = folder / "saved.json"
    path.write_text(text)
    return path


def alike(some, others):
    """Intervals, to within twice the tolerance."""
    return len(some) == len(others) and all(
        len(a) == len(b) and all(p[0] == q[0] and abs(p[1] - q[1]) < 2e-3 and abs(p[2] - q[2]) < 2e-3 for p, q in zip(a, b))
        for a, b in zip(some, others))


def is_as_told(page, tool, folder, words):
    mine, anew = intervals(page.of("found.pairs")), intervals(told(tool, saved(page, folder))["pairs"])
    expect(alike(mine, anew), f"{words} {mine if mine == anew else (mine, anew)}")


def post(page, path, body):
    """Status, and what was said in lines."""
    status, text = page.js(f"fetch({json.dumps(path)}, {{method: 'POST', body: {json.dumps(body)}}}).then(async a => [a.status, await a.text()])")
    return status, [json.loads(line) for line in text.splitlines()]


def check_refusals(page):
    good = json.loads(page.js("JSON.stringify({transitions: window.rayrep.studio.transitions})"))
    status, lines = post(page, "scene/check", json.dumps(good))
    expect(status == 200 and [one["stage"] for one in lines][-1] == "complete" and len(lines) > 1, f"answers come in {len(lines)} lines, the last one complete")

    def spoilt(change):
        copy = json.loads(json.dumps(good))
        change(copy["transitions"][0]["motions"][0])
        return json.dumps(copy)

    bad = [("{", "no JSON"), ('{"transitions": []}', "no ways"), (spoilt(lambda m: m["translation"][0].update(at=[1, 2])), "a point of two numbers"),
           (spoilt(lambda m: m["translation"][0].update(at=[1, 2, 3])), "a begin that is not the state's"),
           (spoilt(lambda m: m["translation"].reverse()), "times that do not ascend"),
           (spoilt(lambda m: m["rotation"][0].update(rotation=[0, 0, 0, 0])), "a rotation that is none"),
           (json.dumps({**good, "states": []}), "another number of states"), (json.dumps({**good, "states": [{"poses": []}] * 2}), "a state without parts")]
    for body, words in bad:
        _, lines = post(page, "scene/check", body)
        expect(len(lines) == 1 and lines[0].get("error", {}).get("kind") == "usage", f"{words} is refused: {lines[0]}")


def check_edits(page, tool, folder):
    complete(page)
    page.look("studio")
    expect(page.chromium.complaints() == [], f"nothing is complained of {page.chromium.complaints()}")
    is_as_told(page, tool, folder, "the studio finds what the command finds")
    first = page.of("found.pairs")
    page.js("window.rayrep.studio.page.goTime(0.5)")
    page.click(".rows.keys button.small")
    complete(page)
    expect(alike(intervals(page.of("found.pairs")), intervals(first)), "a key that is added changes nothing")
    expect(page.js("window.rayrep.studio.key?.number") == 1, "and is chosen")
    page.js("document.activeElement.blur()")
    page.drag(".key.translation[data-place='0-translation-1']", (80, 0))
    complete(page)
    key = json.loads(page.js("JSON.stringify(window.rayrep.studio.motions[0].translation[1])"))
    width = page.rect(".ruler")[2]
    expect(abs(key["time"] - 0.5 - 80 / width) < 0.01, f"dragged on the timeline it is as much later: {key['time']:.3f}")
    is_as_told(page, tool, folder, "the check has followed")
    page.wait("!document.querySelector('.handle').hidden", "the handle")
    start = page.of("view.orbit.pose()")
    page.drag(".handle", (0, -140))
    complete(page)
    moved = json.loads(page.js("JSON.stringify(window.rayrep.studio.motions[0].translation[1])"))
    by = [b - a for a, b in zip(key["at"], moved["at"])]
    up = start["above"]
    expect(dot(by, up) > 5 and abs(dot(by, start["towards"])) < 1e-6 * math.hypot(*by) and abs(dot(by, start["aside"])) < 1e-6 * math.hypot(*by),
           f"dragged up in the view it goes up there: {by}")
    is_as_told(page, tool, folder, "the check has followed")
    page.look("dragged")


def check_picture(page, tool, folder):
    """An edit that leads around one collision and into another one."""
    for _ in range(3):
        page.chromium.key("z", "KeyZ", control=True)
    page.chromium.key("z", "KeyZ", control=True, shift=True)
    complete(page)
    page.js("window.rayrep.studio.choose({part: 0, kind: 'translation', number: 1})")
    fields = page.js("document.querySelectorAll('.numbers input').length")
    expect(fields == 4, "a key has fields")
    page.js("""(inputs => ['50', '32', '0', '19'].forEach((text, n) => {
      inputs[n].value = text;
    }))(document.querySelectorAll('.numbers input'))""")
    page.js("document.querySelectorAll('.numbers input')[3].dispatchEvent(new Event('change'))")
    complete(page)
    is_as_told(page, tool, folder, "around the post it goes into the beam")
    effect = json.loads(page.js("JSON.stringify(window.rayrep.studio.effect)"))
    pair = effect and effect["pair"]
    expect(effect and effect["kind"] == "new" and (pair["first"], pair["second"]) == (0, 2), f"the new collision is noticed: {effect and effect['kind']}")
    page.wait("!document.querySelector('.inset').hidden", "the picture")
    expect(reds(page.seen(".inset")) > 20, f"and shown in the corner: {reds(page.seen('.inset'))} marked pixels")
    expect(page.js("!document.querySelector('.marker.second').hidden"), "with a marker of its own")
    page.look("corner")
    page.click(".inset .seen")
    chosen = page.of("chosen")
    expect(chosen and chosen["pair"]["second"] == 2 and page.of("now.time") == chosen["pair"]["intervals"][chosen["interval"]]["worst"]["time"],
           "a click on it goes there")
    edited = page.js("JSON.stringify(window.rayrep.studio.transitions)")
    found = intervals(page.of("found.pairs"))
    for _ in range(4):
        page.chromium.key("z", "KeyZ", control=True)
    complete(page)
    expect(len(json.loads(page.js("JSON.stringify(window.rayrep.studio.motions[0].translation)"))) == 2, "undo takes all edits back")
    is_as_told(page, tool, folder, "and what was found then is found again")
    for _ in range(4):
        page.chromium.key("z", "KeyZ", control=True, shift=True)
    complete(page)
    expect(page.js("JSON.stringify(window.rayrep.studio.transitions)") == edited and intervals(page.of("found.pairs")) == found, "redo brings them again")


def check_turn(page):
    """A part that turns about an axis on its way is turned about that."""
    complete(page)
    page.js("window.rayrep.studio.page.goTransition(1)")
    page.js("window.rayrep.studio.page.goTime(0.5)")
    page.js("window.rayrep.studio.add(3, 'rotation')")
    complete(page)
    before = page.of("scene.transitions[1].motions[3].rotation[1].rotation")
    page.drag(".handle", (0, 40))
    complete(page)
    after = page.of("scene.transitions[1].motions[3].rotation[1].rotation")
    by = product(after, [before[0], -before[1], -before[2], -before[3]])
    expect(abs(by[1]) > 0.05 and math.hypot(by[2], by[3]) < 1e-9, f"a key of a turn is dragged about the axis of its way: {by}")
    page.js("document.querySelector('.handle').focus()")
    page.chromium.key("Delete")
    complete(page)
    expect(page.of("scene.transitions[1].motions[3].rotation.length") == 2, "and removed by Delete")


def judged(page):
    page.wait("window.rayrep.studio.page.balance && !window.rayrep.studio.page.balanceOld", "the balance")


def check_judging(page):
    """The balance of the scene as it is, in the background."""
    judged(page)
    expect(nodes(page) == "good,good,bad,", f"the graph has the balance of the parts as they are: {nodes(page)}")


def put(page, *values):
    """Types where the part that is chosen shall be in its state."""
    page.js(f"""({json.dumps([str(value) for value in values])}.forEach((text, n) => {{
      document.querySelectorAll('.numbers input')[n].value = text;
    }}), document.querySelectorAll('.numbers input')[2].dispatchEvent(new Event('change')))""")
    complete(page)


def check_states(page, tool, folder):
    """A part is dragged in a state; the ways that end there, what overlaps, and the balance follow."""
    arm = "scene.states[2].poses[1]"
    page.js("document.querySelectorAll('.graph .node')[2].dispatchEvent(new MouseEvent('click'))")
    page.js("document.querySelectorAll('.keying .part')[1].click()")
    page.wait("!document.querySelector('.handle').hidden", "the handle")
    before, others, pose = page.of(f"{arm}.translation"), page.of("scene.states.slice(0, 2)"), page.of("view.orbit.pose()")
    x, y, width, height = page.rect(".handle")
    page.chromium.mouse("mousePressed", x + width / 2, y + height / 2)
    page.chromium.mouse("mouseMoved", x + width / 2 - 30, y + height / 2)
    page.chromium.mouse("mouseMoved", x + width / 2 - 60, y + height / 2)
    page.chromium.settle()
    expect(nodes(page) == "old,old,old," and page.of("balanceOld") == 1, "while the hand moves it, what was judged is old, by one edit")
    page.chromium.mouse("mouseReleased", x + width / 2 - 60, y + height / 2)
    complete(page)
    judged(page)
    after = page.of(f"{arm}.translation")
    by = [b - a for a, b in zip(before, after)]
    expect(dot(by, pose["aside"]) < -5 and abs(dot(by, pose["above"])) < 1e-6 * math.hypot(*by), f"a part is dragged in a state: {by}")
    ends = page.of("scene.transitions[0].motions[1].translation")
    middle = page.of("posesAt({transition: 0, time: 0.5, state: null})[1].translation")
    expect(ends[-1]["at"] == after and ends[0]["at"] == [0, 0, 80] and math.dist(middle, [(a + b) / 2 for a, b in zip(ends[0]["at"], after)]) < 1e-9,
           "the way that ends there ends there still, straight")
    expect(page.of("scene.states.slice(0, 2)") == others, "other states stay")
    is_as_told(page, tool, folder, "the check has followed")
    put(page, 10, 0, 80)
    judged(page)
    expect(nodes(page) == "good,good,good,", f"nearer to the tower it stands: {nodes(page)}")
    expect(balanced(tool, folder, saved(page, folder).name, "--as-is")["states"][2]["pass"], "in the scene that is saved, too")
    put(page, 10, 0, 60)
    expect(nodes(page).split(",")[2] == "overlap" and "tower and arm overlap" in page.js("document.querySelector('.graph-around + * + .collisions').textContent"),
           f"where parts overlap in a state that is told: {nodes(page)}")
    page.wait("document.querySelector('p.refusal')?.textContent.includes('overlap')", "the balance that is refused")
    page.look("state-overlap")
    for _ in range(3):
        page.chromium.key("z", "KeyZ", control=True)
    complete(page)
    judged(page)
    expect(page.of(f"{arm}.translation") == before and nodes(page) == "good,good,bad,", f"undo takes it all back: {nodes(page)}")
    page.js("window.rayrep.studio.put(1, 'rotation')")
    page.drag(".handle", (0, 40))
    complete(page)
    turn = page.of(f"{arm}.rotation")
    end = page.of("scene.transitions[0].motions[1].rotation").pop()["rotation"]
    expect(abs(turn[0]) < 0.999 and end == turn, f"and it is turned: {turn}")


def check_making(page, tool, folder):
    """rayrep balance, run from the page: what it gives rests, beside the scene it came from."""
    page.js("[...document.querySelectorAll('.making button')].find(one => one.textContent === 'Balance the parts').click()")
    page.wait("document.querySelector('.making .downloads')", "the balanced parts")
    names = json.loads(page.js("JSON.stringify([...document.querySelectorAll('.making a')].map(one => one.download))"))
    expect(names == ["boat.json", "port.stl", "starboard.stl", "boat.html"], f"the scene, its parts and the page can be had: {names}")
    put = folder / "put"
    put.mkdir()
    for name in names:
        link = page.js(f"[...document.querySelectorAll('.making a')].find(one => one.download === {json.dumps(name)}).href")
        with urllib.request.urlopen(link) as answer:
            (put / name).write_bytes(answer.read())
    report = balanced(tool, put, "boat.json", "--as-is")
    expect(report["pass"] and all(part["cavities"] for part in report["parts"]), "put into a folder they are verified again")
    page.look("made")


def check_studio(chromium, pictures, tool, folder):
    scene = passing(folder)
    with Server(tool, folder, scene.name) as server:
        chromium.local += (server.address,)
        chromium.visit(server.address)
        page = Page(chromium, pictures)
        page.page = "window.rayrep.studio.page"
        check_edits(page, tool, folder)
        check_picture(page, tool, folder)
        expect(chromium.complaints() == [], f"nothing is complained of {chromium.complaints()[:3]}")
        check_refusals(page)
    with Server(tool, folder, "front.json") as server:
        chromium.local += (server.address,)
        chromium.visit(server.address)
        check_turn(page)
    with Server(tool, folder, "crane.json") as server:
        chromium.local += (server.address,)
        chromium.visit(server.address)
        check_judging(page)
        check_states(page, tool, folder)
        expect(chromium.complaints() == [], f"nothing is complained of {chromium.complaints()[:3]}")
    for part in ("boat.json", "boat_port.stl", "boat_starboard.stl"):
        (folder / part).write_bytes((kRoot / "examples/scenes" / part).read_bytes())
    with Server(tool, folder, "boat.json") as server:
        chromium.local += (server.address,)
        chromium.visit(server.address)
        judged(page)
        expect(nodes(page) == "bad,bad", f"solid it sinks: {nodes(page)}")
        check_making(page, tool, folder)
        expect(chromium.complaints() == [], f"nothing is complained of {chromium.complaints()[:3]}")
    with Server(tool, folder) as server:
        chromium.local += (server.address,)
        chromium.visit(server.address)
        status, lines = post(page, "scene/check", "{}")
        expect(status == 404 and "no scene" in lines[0]["error"]["message"], f"a studio without a scene says so: {lines}")


def main():
    tool = str(pathlib.Path(sys.argv[1]).resolve())
    pictures = pathlib.Path(sys.argv[3]) if sys.argv[2:3] == ["--pictures"] else None
    if not browser.program():
        print("skipped: there is no Chromium")
        sys.exit(kSkipped)
    with tempfile.TemporaryDirectory() as name, browser.Browser() as chromium:
        folder = pathlib.Path(name)
        chromium.size(1000, 760, still=True)
        page = Page(chromium, pictures)
        check_report(page, tool, folder)
        check_keys(page)
        check_widths(page, folder / "front.html")
        check_balance(page, tool, folder)
        check_insides(page, tool, folder)
        check_without_webgl(folder / "front.html")
        check_studio(chromium, pictures, tool, folder)
    print(f"{len(problems)} problems, {time.monotonic() - kBegun:.1f} s")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
