#!/usr/bin/env python3
"""The studio, asked over HTTP as a page asks it, and as nobody should.

  tests/studio/run.py RAYREP [refusals] [meshes] [previews] [runs] [ends]

refusals  who may ask and what: Host, Origin, token, methods, sizes, settings that name programs or files; slow clients
meshes    garbage, holes, several bodies, names
previews  what they tell, twice the same, and that the latest one wins
runs      one at a time; cancelled, failed; to the byte what the command line gives
ends      signals, a port that is taken, a mesh that cannot be read: nothing is left behind
The exit code is 1 if anything failed.
"""
import base64
import concurrent.futures
import http.client
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import urllib.parse
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parent.parent.parent / "examples"
PATIENCE_S = 240  # on a machine that does other things, too


def octahedron(a, b, c, x=0.0):
    corners = [(a, 0, 0), (-a, 0, 0), (0, b, 0), (0, -b, 0), (0, 0, c), (0, 0, -c)]
    faces = [(1, 3, 5), (3, 2, 5), (2, 4, 5), (4, 1, 5), (3, 1, 6), (2, 3, 6), (4, 2, 6), (1, 4, 6)]
    return [(p[0] + x, p[1], p[2]) for p in corners], faces


def obj(*bodies):
    text, before = "", 0
    for corners, faces in bodies:
        text += "".join("v %r %r %r\n" % p for p in corners) + "".join("f %d %d %d\n" % tuple(n + before for n in f) for f in faces)
        before += len(corners)
    return text.encode()


def box(a, b, c):
    corners = [(x * a, y * b, z * c) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    return corners, [(1, 3, 4), (1, 4, 2), (5, 6, 8), (5, 8, 7), (1, 2, 6), (1, 6, 5), (3, 7, 8), (3, 8, 4), (1, 5, 7), (1, 7, 3), (2, 4, 8), (2, 8, 6)]


EIGHT = obj(octahedron(30, 30, 25))
TWO = obj(octahedron(30, 30, 25), octahedron(30, 30, 25, 100.0))
corners, faces = octahedron(30, 30, 25)
OPEN = obj((corners, faces[2:]))  # bent


class Answer:
    def __init__(self, response):
        self.status, self.headers, self.bytes = response.status, response.headers, response.read()

    def json(self):
        return json.loads(self.bytes)

    def error(self):
        return self.json()["error"]


class Studio:
    """One that runs, with folders of its own for what is temporary and to stand in."""

    def __init__(self, binary, folder, *arguments, **environment):
        self.folder = Path(tempfile.mkdtemp(dir=folder))
        self.temporary = self.folder / "tmp"
        self.current = self.folder / "here"
        self.temporary.mkdir()
        self.current.mkdir()
        without = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
        environment = dict(without, TMPDIR=str(self.temporary), **environment)
        self.process = subprocess.Popen([binary, "studio", *map(str, arguments)], cwd=self.current, env=environment,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.line = self.process.stdout.readline()
        found = re.fullmatch(r"studio: http://127\.0\.0\.1:(\d+)/([0-9a-f]{32})/\n", self.line)
        self.port, self.token = (int(found[1]), found[2]) if found else (0, "")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop(signal.SIGKILL)

    def stop(self, how):
        """The exit code, and how long that took."""
        begun = time.monotonic()
        self.process.send_signal(how)
        code = self.process.wait(PATIENCE_S)
        took = time.monotonic() - begun
        self.said = self.process.stderr.read() if not self.process.stderr.closed else ""
        self.process.stdout.close()
        self.process.stderr.close()
        return code, took

    def ask(self, method, place, body=None, headers=None, token=None, host=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        try:
            connection.putrequest(method, "/%s/%s" % (token or self.token, place), skip_host=True, skip_accept_encoding=False)
            for value in [host or "127.0.0.1:%d" % self.port] if not isinstance(host, list) else host:
                connection.putheader("Host", value)
            body = body.encode() if isinstance(body, str) else body
            if body is not None or method == "POST":
                connection.putheader("Content-Length", str(len(body or b"")))
            for name, value in (headers or {}).items():
                connection.putheader(name, value)
            connection.endheaders()
            try:
                if body:
                    connection.send(body)
            except OSError:
                pass  # answered already
            return Answer(connection.getresponse())
        finally:
            connection.close()

    def get(self, place, **more):
        return self.ask("GET", place, **more)

    def post(self, place, body=b"", **more):
        return self.ask("POST", place, json.dumps(body) if isinstance(body, dict) else body, **more)

    def load(self, name, data):
        return self.post("mesh?" + urllib.parse.urlencode({"name": name}), data)

    def preview(self, goal="float", sequence=0, **settings):
        return self.post("preview", {"goal": goal, "settings": {k.replace("_", "-"): v for k, v in settings.items()},
                                     "sequence": sequence})

    def run(self, goal="float", **settings):
        return self.post("run", {"goal": goal, "settings": {k.replace("_", "-"): v for k, v in settings.items()}})

    def ended(self):
        """The state of the run once it does not go on."""
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            state = self.get("run").json()
            if state["state"] != "running":
                return state
            time.sleep(0.05)
        return {"state": "never"}

    def left_behind(self):
        return [str(p) for folder in (self.temporary, self.current) for p in folder.rglob("*")]

    def children(self):
        """Of this studio, by where they work."""
        found = []
        for entry in Path("/proc").iterdir():
            try:
                if entry.name.isdigit() and str((entry / "cwd").resolve()).startswith(str(self.temporary)):
                    found.append(entry.name)
            except OSError:
                pass
        return found


class Laws:
    def __init__(self, binary, folder):
        self.binary, self.folder = str(Path(binary).resolve()), folder
        self.failed = 0

    def law(self, holds, words, *seen):
        print(("ok      " if holds else "FAILED  ") + words + ("" if holds else "".join("\n          " + repr(s)[:600] for s in seen)),
              flush=True)
        self.failed += not holds

    def studio(self, *arguments):
        return Studio(self.binary, self.folder, "--port", "0", "--no-open", *arguments)

    def command(self, folder, *arguments):
        return subprocess.run([self.binary, *map(str, arguments)], cwd=folder, capture_output=True, text=True)

    # ---------------------------------------------------------------------------------------------------------------------

    def refusals(self):
        with self.studio("--max-upload", "2MB") as s:
            self.law(s.port > 0, "the address is printed", s.line)
            page = s.get("")
            self.law(page.status == 200 and b'id="rayrep-studio"' in page.bytes, "the page is there", page.status)
            policy = page.headers["Content-Security-Policy"]
            self.law("default-src 'none'" in policy and "script-src 'sha256-" in policy and "connect-src 'self'" in policy
                     and "frame-ancestors 'none'" in policy and "unsafe" not in policy, "with its policy", policy)
            self.law(b"http-equiv" not in page.bytes.split(b"<style", 1)[0], "which it does not say itself")
            wanted = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
                      "X-Frame-Options": "DENY", "Cross-Origin-Resource-Policy": "same-origin"}
            for place in ("", "run", "nothing"):
                answer = s.get(place)
                self.law(all(answer.headers[k] == v for k, v in wanted.items()), "headers of '%s'" % place, dict(answer.headers))
            block = json.loads(re.search(rb'id="rayrep-studio">(.*?)</script>', page.bytes, re.S)[1])
            self.law([g["name"] for g in block["goals"]] == ["float", "spin", "stand", "target", "pose", "dice"] and block["mesh"] is None
                     and block["contract"] == 1, "its block names the goals", block.keys())
            rows = {r["name"]: r for r in block["goals"][0]["settings"]}
            self.law(rows["waterline"]["kind"] == "number" and rows["repair"]["kind"] == "flag" and "pla" in rows["material"]["choices"]
                     and rows["wall"]["default"] == "1.2" and rows["wall"]["lo"] == 0, "and the rows that set them", rows["wall"])

            for place in ("", "run", "result", "download/x"):
                self.law(s.get(place, token="0" * 32).status == 404, "another token: '%s' is not there" % place)
                self.law(s.get(place, token=s.token[:-1]).status == 404, "nor with part of it")
            for place in ("", "../", "%2e%2e/", "etc/passwd", "mesh/", "run/1"):
                status = s.get(place + "x" if place else "x").status
                self.law(status == 404, "nothing else is there: '%s'" % place, status)
            for host in ("evil.example:%d" % s.port, "127.0.0.1", "127.0.0.1:1", "localhost.evil.example:%d" % s.port, "[::1]:%d" % s.port,
                         ["127.0.0.1:%d" % s.port, "evil.example"], []):
                self.law(s.get("", host=host).status == 403, "Host %s is refused" % host)
            self.law(s.get("", host="localhost:%d" % s.port).status == 200, "Host localhost is not")
            for origin in ("http://evil.example", "null", "https://127.0.0.1:%d" % s.port, "http://127.0.0.1", "http://127.0.0.1:%d.evil" % s.port):
                self.law(s.post("cancel", headers={"Origin": origin}).status == 403, "Origin %s is refused" % origin)
            self.law(s.post("cancel", headers={"Origin": "http://localhost:%d" % s.port}).status == 204, "its own is not")
            for method, place in (("GET", "preview"), ("PUT", "preview"), ("POST", ""), ("POST", "result"), ("PUT", "mesh"), ("DELETE", "run"), ("OPTIONS", "run")):
                status = s.ask(method, place).status
                self.law(status in (400, 404, 405), "%s %s is refused" % (method, place), status)
            self.law(s.post("mesh?name=x.stl", b"x" * 2_000_001).status == 413, "what is larger than --max-upload is refused")
            self.law(s.post("preview", b"{" + b" " * 70000).status == 413, "and settings of 70 kB")
            self.law(s.post("mesh?name=x.stl", b"\x1f\x8b", headers={"Content-Encoding": "gzip"}).status == 415, "and what is compressed")

            answer = s.preview()
            self.law(answer.status == 409 and "no mesh yet" in answer.error()["message"], "a preview of nothing", answer.bytes)
            self.law(s.run().status == 409, "a run of nothing")
            self.law(s.get("result").status == 409 and s.get("download/x").status == 409, "the result of nothing")
            self.law(s.get("run").json()["state"] == "none", "no run")
            s.load("eight.obj", EIGHT)
            for body in (b"", b"[]", b"{", b'{"goal": 3}', b'{"goal": "flaot"}', b'{"goal": "float", "settings": []}', b"\xff", b"[" * 60000):
                answer = s.post("preview", body)
                self.law(answer.status == 422 and answer.error()["kind"] == "usage", "%r is refused" % body[:40], answer.bytes)
            for name, value in (("slicer", "/bin/true"), ("fixed", "/etc/passwd=1"), ("profile", "/etc/passwd"), ("output", "/tmp/x.stl"),
                                ("html", "x"), ("save-config", "x"), ("config", "x"), ("deform-fixed", "/etc/passwd"), ("memory", "1GB"),
                                ("each", True), ("as-sliced", "x"), ("urdf", "x"), ("help", True), ("no-such", 1)):
                for place in ("preview", "run"):
                    answer = s.post(place, {"goal": "target" if name == "urdf" else "float", "settings": {name: value}})
                    self.law(answer.status == 422 and "no setting" in answer.error()["message"], "%s of --%s is refused" % (place, name), answer.bytes)
            for settings, words in (({"waterline": "a"}, "--waterline"), ({"wall": -1}, "--wall must be a positive number"),
                                    ({"waterline": 3, "submerged": 0.5}, "not both"), ({"waterline": {"a": []}}, "--waterline takes")):
                answer = s.post("preview", {"goal": "float", "settings": settings})
                self.law(answer.status == 422 and words in answer.error()["message"], "%r: in the command's words" % settings, answer.bytes)
            answer = s.preview(waterline=1)
            self.law(answer.status == 422 and answer.error()["kind"] == "goal", "what cannot be is refused by the goal", answer.bytes)
            self.law(s.preview(waterline="").status == 200, "an empty text is none")
            self.slow_clients(s)

    def slow_clients(self, s):
        halves = []
        for n in range(20):
            half = socket.create_connection(("127.0.0.1", s.port))
            if n % 2:
                half.sendall(b"POST /%s/mesh?name=x.stl HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nContent-Length: 1000\r\n\r\nabc" % (s.token.encode(), s.port))
            elif n % 4:
                half.sendall(b"GET /")
            halves.append(half)
        begun = time.monotonic()
        status = s.get("run").status
        self.law(status == 200 and time.monotonic() - begun < 60, "clients that are slow do not keep it", status, time.monotonic() - begun)
        for half in halves:
            half.close()
        self.law(s.preview().status == 200, "and the mesh is still there")

    # ---------------------------------------------------------------------------------------------------------------------

    def meshes(self):
        with self.studio() as s:
            answer = s.load("duck.stl", (EXAMPLES / "duck.stl").read_bytes())
            mesh = answer.json()
            self.law(answer.status == 200 and mesh["name"] == "duck.stl" and mesh["summary"]["usable"] and mesh["summary"]["format"].startswith("STL"),
                     "a mesh is loaded", mesh.get("summary"))
            self.law(list(mesh["blocks"]) == [m["id"] for m in mesh["view"]["meshes"]] and mesh["view"]["meshes"][0]["what"] == "shell"
                     and len(mesh["view"]["size_mm"]) == 3, "with what is shown", mesh["view"])
            self.law(s.get("mesh").bytes == (EXAMPLES / "duck.stl").read_bytes(), "its bytes can be had again")
            page = s.get("").bytes
            block = json.loads(re.search(rb'id="rayrep-studio">(.*?)</script>', page, re.S)[1])
            self.law(block["mesh"] == mesh, "the page that is loaded again has it")
            for name, data, words in (("x.stl", b"garbage" * 100, "x.stl"), ("x.obj", b"", "x.obj"), ("x.3mf", b"PK\3\4garbage", "x.3mf"),
                                      ("x.gcode", b"G1 X1", "a file for a printer"), ("x.json", b"{}", "x.json"), ("", b"\0" * 84, "mesh")):
                answer = s.load(name, data)
                said = answer.error()["message"]
                self.law(answer.status == 422 and words in said and str(s.temporary) not in said, "'%s' is refused in words" % name, said)
            self.law(s.preview(waterline=30).status == 200, "the one before is still there")
            answer = s.load("open.obj", OPEN)
            self.law(answer.status == 200 and not answer.json()["summary"]["usable"] and answer.json()["summary"]["refusal"]
                     and answer.json()["view"]["marks"], "a surface with a hole is shown with its marks", answer.bytes[:300])
            answer = s.preview()
            self.law(answer.status == 422 and answer.error()["kind"] == "input" and answer.error()["message"].startswith("open.obj: "),
                     "and refused by a preview", answer.bytes[:300])
            s.load("two.obj", TWO)
            answer = s.preview()
            self.law(answer.status == 422 and "2 bodies" in answer.error()["message"], "two bodies are refused", answer.bytes[:300])
            self.law(s.preview(rigid=True).status == 200, "but as one rigid one")
            answer = s.run("float")
            state = s.ended()
            self.law(state["state"] == "failed" and state["error"]["kind"] == "input" and "two.obj: There are 2 bodies" in state["error"]["message"],
                     "by the run, too", state)
            s.load("eight.obj", EIGHT)
            half, whole = s.preview(size=30).json(), s.preview().json()
            self.law(abs(half["scale"] - 0.5) < 1e-9 and abs(whole["scale"] - 1) < 1e-12, "--size is told as a scale", half["scale"])
            self.law(abs(s.preview(unit="cm").json()["scale"] - 10) < 1e-9, "and --unit")
            for given, kept in (("../../evil.obj", "evil.obj"), ("a\\b.obj", "b.obj"), (".hidden.obj", "mesh.hidden.obj"), ("-o.obj", "mesh-o.obj"),
                                ("测试 Würfel.obj", "测试 Würfel.obj"), ("a\nb.obj", "ab.obj"), ("x" * 300 + ".obj", "x" * 116 + ".obj")):
                answer = s.load(given, EIGHT)
                self.law(answer.status == 200 and answer.json()["name"] == kept, "%r is called %r" % (given[:30], kept[:30]), answer.bytes[:200])
            self.law(len(list(s.temporary.glob("*/mesh-*"))) == 1, "one mesh is kept", list(s.temporary.glob("*/mesh-*")))

    # ---------------------------------------------------------------------------------------------------------------------

    def previews(self):
        duck = EXAMPLES / "duck.stl"
        with self.studio(duck) as s:
            answer = s.preview(sequence=17, waterline=20)
            told = answer.json()
            self.law(answer.status == 200 and told["sequence"] == 17 and told["spec"]["waterline"] == "20" and told["told"], "a preview tells", answer.bytes[:300])
            figures = {f[3]: f for f in told["figures"]}
            self.law(all(len(f) == 4 for f in told["figures"]) and abs(figures["mass_g"][2] - figures["displaced_mass_g"][2]) < 1e-3,
                     "the body weighs what it displaces", figures.keys())
            columns = told["columns"]
            data = base64.b64decode(columns["bytes"])
            stretches = list(struct.iter_unpack("<hhff", data))
            self.law(len(stretches) == columns["count"] > 100 and all(w0 < w1 and i >= 0 and j >= 0 for i, j, w0, w1 in stretches),
                     "with the stretches of its rays", columns["count"])
            void = columns["spacing_mm"]**2 * sum(w1 - w0 for _, _, w0, w1 in stretches)
            solid = json.loads(subprocess.run([self.binary, "inspect", duck, "--json"], capture_output=True).stdout)["mass_properties"]["volume_mm3"]
            self.law(abs((solid - void) * 1.24e-3 / figures["mass_g"][2] - 1) < 1e-3, "which are what is left out of it", void, solid)
            axes = [columns["axes"][3 * n:3 * n + 3] for n in range(3)]
            dots = [[sum(a * b for a, b in zip(p, q)) for q in axes] for p in axes]
            self.law(all(abs(dots[m][n] - (m == n)) < 1e-12 for m in range(3) for n in range(3)), "in a frame that is one", axes)
            low = [min(self.at(columns, s1, k) for s1 in stretches) for k in range(3)]
            high = [max(self.at(columns, s1, k) for s1 in stretches) for k in range(3)]
            view = json.loads(s.get("").bytes.split(b'id="rayrep-studio">')[1].split(b"</script>")[0])["mesh"]["view"]
            self.law(all(view["low_mm"][k] < low[k] and high[k] < view["low_mm"][k] + view["size_mm"][k] for k in range(3)), "inside the body", low, high)
            self.law(told["attitude"]["kind"] == "floats" and told["attitude"]["waterline_mm"] == 20, "and how it floats", told["attitude"])
            other = s.preview(waterline=24, wall=2).json()
            again = s.preview(sequence=17, waterline=20).json()
            for answer in (told, again):
                answer.pop("seconds")
            self.law(told == again and other["columns"] != told["columns"], "twice the same, whatever came between")
            config = {"goal": "float", "settings": {"waterline": 20.0, "repair": False, "reserve": None}}
            same = s.post("preview", config).json()
            self.law(same["columns"] == told["columns"], "numbers, false and null are taken as in a file of settings")
            self.latest(s)
            s.load("box.obj", obj(box(30, 30, 30)))
            for goal, settings, kind in (("float", {}, "floats"), ("spin", {"prefer": "smallest", "point": "15,15,0"}, "spins"), ("stand", {}, "stands"),
                                         ("target", {"mass": 25}, ""), ("pose", {"stand": ["z", [1, 0, 0]]}, "stands"), ("dice", {}, "")):
                answer = s.post("preview", {"goal": goal, "settings": settings})
                told = answer.json()
                self.law(answer.status == 200 and told["figures"] and told["columns"]["count"] > 0 and told["attitude"]["kind"] == kind, "a preview of " + goal,
                         answer.bytes[:300])

    @staticmethod
    def at(columns, stretch, k):
        i, j, w0, _ = stretch
        u, v, w = (columns["axes"][3 * n:3 * n + 3] for n in range(3))
        return columns["origin_mm"][k] + columns["spacing_mm"] * (i * u[k] + j * v[k]) + w0 * w[k]

    def latest(self, s):
        with concurrent.futures.ThreadPoolExecutor(12) as pool:
            asked = []
            for n in range(12):
                asked.append(pool.submit(s.preview, sequence=n, waterline=18 + 0.3 * n, wall=1 + 0.05 * n))
                time.sleep(0.01)
            answers = [a.result() for a in asked]
        self.law(answers[-1].status == 200 and answers[-1].json()["sequence"] == 11, "of many the latest is answered", answers[-1].bytes[:200])
        late = [a for a in answers if a.status != 200]
        self.law(late and all(a.status == 409 and a.error()["kind"] == "superseded" for a in late), "and others are superseded",
                 [a.status for a in answers])
        self.law(all(a.json()["sequence"] == n for n, a in enumerate(answers) if a.status == 200), "each with its own answer")

    # ---------------------------------------------------------------------------------------------------------------------

    def runs(self):
        with self.studio() as s:
            s.load("duck.stl", (EXAMPLES / "duck.stl").read_bytes())
            answer = s.run(waterline=20, resolution=60)
            self.law(answer.status == 202 and answer.json() == {"run": 1}, "a run begins", answer.bytes)
            answer = s.run(waterline=20, resolution=60)
            self.law(answer.status == 409 and answer.error()["kind"] == "running", "a second one does not", answer.bytes)
            self.law(s.get("result").status == 409, "nor is there a result yet")
            self.law(s.preview(waterline=22).status == 200, "previews go on")
            state = s.ended()
            self.law(state["state"] == "done" and state["share"] == 1, "it ends", state)
            result = s.get("result").json()
            self.law(result["command"] == "rayrep float duck.stl --waterline 20 --resolution 60", "its command line is told", result["command"])
            self.law(result["config"] == {"mesh": "duck.stl", "resolution": 60, "waterline": 20}, "and its settings", result["config"])
            self.same_as_command(s, result)
            self.other_ends(s)

    def same_as_command(self, s, result):
        here = s.folder / "command"
        here.mkdir()
        shutil.copy(EXAMPLES / "duck.stl", here)
        words = result["command"].split()[1:]
        self.command(here, *words, "-o", "duck_float.3mf", "--html", "page.html")
        self.command(here, *words, "-o", "duck_float.stl")
        files = [f["name"] for f in result["files"]]
        self.law(files[0] == "duck_float.3mf" and {"duck_float.stl", "duck_float.html", "duck_float.config.json"} <= set(files), "its files are told", files)
        for name in ("duck_float.3mf", "duck_float.stl"):
            got = s.get("download/" + name)
            self.law(got.status == 200 and got.bytes == (here / name).read_bytes() and name in got.headers["Content-Disposition"]
                     and got.headers["Content-Type"] == "application/octet-stream", name + " is what the command writes, to the byte", got.status)
        page = (here / "page.html").read_text()
        data = json.loads(re.search(r'id="rayrep-data">(.*?)</script>', page, re.S)[1])
        blocks = dict(re.findall(r'octet-stream" id="([^"]+)">([^<]*)</script>', page))
        mine = result["data"]
        for report in (data["report"], mine["report"]):
            report.pop("timings_s")
            report.pop("peak_memory_mb")
            report["solver"].pop("seconds")
        self.law(mine == data, "and so is what its page is told", [k for k in data if data[k] != mine[k]])
        self.law(result["blocks"] == blocks and len(blocks) == 2, "and shown", list(blocks))
        (here / "settings.json").write_bytes(s.get("download/duck_float.config.json").bytes)
        self.command(here, "float", "settings.json", "-o", "by_config.3mf")
        self.law((here / "by_config.3mf").read_bytes() == (here / "duck_float.3mf").read_bytes(), "its settings do the same by --config")
        html = s.get("download/duck_float.html")
        self.law(html.bytes.startswith(b"<!doctype html>"), "the page can be taken home")
        for name in ("", "..", "../mesh-1/duck.stl", "%2e%2e%2fmesh-1%2fduck.stl", "duck.stl", "duck_float.3mf/", "x" * 300):
            self.law(s.get("download/" + name).status == 404, "download/%s is not there" % name[:40])

    def other_ends(self, s):
        s.run(waterline=20, resolution=400)
        time.sleep(0.3)
        self.law(s.post("cancel").status == 204, "a run is cancelled")
        state = s.get("run").json()
        self.law(state["state"] == "cancelled" and not s.children(), "and has ended then", state, s.children())
        self.law(s.get("result").status == 409, "without a result")
        self.law(s.post("cancel").status == 204, "cancelling nothing is none")
        s.run("float", waterline=2, resolution=60)
        state = s.ended()
        here = s.folder / "refused"
        here.mkdir()
        shutil.copy(EXAMPLES / "duck.stl", here)
        said = self.command(here, "float", "duck.stl", "--waterline", "2", "--resolution", "60", "--no-advice").stderr
        self.law(state["state"] == "failed" and state["error"]["kind"] == "goal" and "rayrep: " + state["error"]["message"] + "\n" == said,
                 "one that fails says what the command says", state, said)
        s.run(waterline=21, resolution=60)
        self.law(s.ended()["state"] == "done" and s.get("run").json()["run"] == 4, "and one goes well after that")
        s.run("float", waterline=30, resolution=60, infill=15)
        state = s.ended()
        files = [f["name"] for f in s.get("result").json()["files"]] if state["state"] == "done" else []
        self.law(files and "duck_float.stl" not in files, "what is sparse is not offered as STL", state, files)
        s.load("eight.obj", EIGHT)
        self.law(s.get("result").status == 200, "another mesh leaves the result")
        self.law(len(list(s.temporary.glob("*/run-*"))) == 1, "one run is kept", list(s.temporary.glob("*/run-*")))

    # ---------------------------------------------------------------------------------------------------------------------

    def ends(self):
        for how in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            for busy in (False, True):
                with self.studio(EXAMPLES / "duck.stl") as s:
                    half = socket.create_connection(("127.0.0.1", s.port))
                    half.sendall(b"GET /")
                    if busy:
                        s.run(resolution=400)
                        with concurrent.futures.ThreadPoolExecutor(2) as pool:
                            asked = pool.submit(s.preview)
                            time.sleep(0.05)
                            code, took = s.stop(how)
                            asked.exception()
                    else:
                        s.preview()
                        code, took = s.stop(how)
                    words = "%s ends it%s" % (how.name, " at work" if busy else "")
                    self.law(code == 0 and took < 5 and s.said == "", words, code, took, s.said)
                    self.law(s.left_behind() == [] and s.children() == [], "and nothing is left", s.left_behind(), s.children())
                    half.close()
        with self.studio() as s:
            other = subprocess.run([self.binary, "studio", "--no-open", "--port", str(s.port)], capture_output=True, text=True, timeout=PATIENCE_S)
            self.law(other.returncode == 2 and "Port %d of 127.0.0.1 is taken" % s.port in other.stderr, "a port that is taken is told", other.stderr)
            self.law(s.get("run").status == 200, "and the first one goes on")
            addresses = {Studio(self.binary, self.folder, "--port", "0", "--no-open") for _ in range(2)}
            tokens = {one.token for one in addresses} | {s.token}
            self.law(len(tokens) == 3, "each start has a token of its own", tokens)
            for one in addresses:
                one.stop(signal.SIGTERM)
        garbage = Path(self.folder) / "garbage.stl"
        garbage.write_bytes(b"garbage" * 100)
        for arguments, code, words in ((["no_such.stl"], 3, "Cannot read 'no_such.stl'"), ([garbage], 3, "garbage.stl"), (["--port", "70000"], 2, "--port"),
                                       (["--max-upload", "5"], 2, "--max-upload takes"), (["--wall", "2"], 2, "--wall"), ([self.folder], 3, "Cannot read")):
            temporary = Path(tempfile.mkdtemp(dir=self.folder))
            ended = subprocess.run([self.binary, "studio", "--no-open", *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE_S,
                                   env=dict(os.environ, TMPDIR=str(temporary)))
            self.law(ended.returncode == code and words in ended.stderr and not list(temporary.iterdir()), "studio %s is refused" % " ".join(map(str, arguments))[-40:],
                     ended.returncode, ended.stderr, list(temporary.iterdir()))
        programs = Path(self.folder) / "programs"
        programs.mkdir()
        (programs / "xdg-open").write_text("#!/bin/sh\ncp \"$1\" '%s/opened'\n" % programs)
        (programs / "xdg-open").chmod(0o755)
        with Studio(self.binary, self.folder, DISPLAY=":77", PATH="%s:%s" % (programs, os.environ["PATH"])) as s:
            opened = programs / "opened"
            until = time.monotonic() + PATIENCE_S
            while not opened.exists() and time.monotonic() < until:
                time.sleep(0.05)
            said = s.process.stdout.readline()
            self.law(said == "Ctrl-C ends it.\n", "nobody has to open it", said)
            self.law("url=http://127.0.0.1:%d/%s/\"" % (s.port, s.token) in opened.read_text(), "the browser is sent to the address by a file")
            folders = [p for p in s.temporary.iterdir()]
            self.law(len(folders) == 1 and folders[0].stat().st_mode & 0o777 == 0o700, "that nobody else can read", folders)
        (programs / "xdg-open").write_text("#!/bin/sh\nexit 3\n")
        with Studio(self.binary, self.folder, DISPLAY=":77", PATH="%s:%s" % (programs, os.environ["PATH"])) as s:
            said = s.process.stdout.readline()
            self.law("Open this address" in said, "without a browser it is told to be opened", said)
        with Studio(self.binary, self.folder) as s:
            self.law(s.port > 0 and "Open this address" in s.process.stdout.readline(), "without a display it is told to be opened")


def main():
    parts = ("refusals", "meshes", "previews", "runs", "ends")
    if len(sys.argv) < 2 or set(sys.argv[2:]) - set(parts):
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        laws = Laws(sys.argv[1], folder)
        for part in sys.argv[2:] or parts:
            print("-- " + part, flush=True)
            getattr(laws, part)()
    print("%d failed" % laws.failed)
    sys.exit(laws.failed > 0)


if __name__ == "__main__":
    main()
