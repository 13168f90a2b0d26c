#!/usr/bin/env python3
"""Hostile files, faults of disk and limits, kills, determinism and cost: what must hold of the rayrep command whatever happens.

    tests/faults/run.py BINARY [--short] [--seed N] [KIND ...]

Prints a table of what held and what failed, and ends with 1 if anything failed. --short is what ctest runs; without it there are
more random files and kills, and the cost of large meshes is measured at n and 2 n (on an idle machine)."""

import argparse
import json
import os
import random
import re
import resource
import signal
import stat
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import meshes

CONTROL = re.compile(rb"[\x00-\x09\x0b-\x1f\x7f]|\xc2[\x80-\x9f]")
DUBIOUS = re.compile(r"\bnan\b|-nan|\d{40}|0\.000 mm|max_size|std::|terminate|assert", re.I)
SIGNALS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}
LIMITED_S = 30


class Ended:
    def __init__(self, code, out, err, seconds, cpu_s):
        self.code, self.out, self.err, self.seconds, self.cpu_s = code, out, err, seconds, cpu_s


class Table:
    def __init__(self):
        self.rows, self.failed = {}, []

    def note(self, kind, name, problems):
        row = self.rows.setdefault(kind, [0, 0, 0.0])
        row[1 if problems else 0] += 1
        for problem in problems:
            self.failed.append("%s: %s: %s" % (kind, name, problem.strip()))

    def show(self):
        print("%-34s %8s %8s %8s" % ("kind", "held", "failed", "seconds"))
        for kind, (held, failed, seconds) in self.rows.items():
            print("%-34s %8d %8d %8.1f" % (kind, held, failed, seconds))
        for line in self.failed[:60]:
            print("FAILED  " + line)


def lawful(ended, codes):
    """What holds of every run, however it ends."""
    problems = []
    err = ended.err.decode("utf-8", "replace")
    if ended.code not in codes:
        problems.append("exit code %s, wanted %s: %s" % (ended.code, sorted(codes), err[:300]))
    for text in (ended.out, ended.err):
        if found := CONTROL.search(text):
            problems.append("control character %r in %r" % (found.group(), text[:200]))
    # What a message quotes, and the names of files, are not its own words.
    own = re.sub(r"'[^'\n]*'|[\w.]*nan\.\w+|NaN or infinity|it is nan\.", "", err)
    if found := DUBIOUS.search(own):
        problems.append("%r in: %s" % (found.group(), err[:300]))
    if ended.code != 0 and "rayrep: " not in err:
        problems.append("no message")
    if ended.code == 1 and "memory" not in err:
        problems.append("an internal error: " + err[:300])
    return problems


class Runs:
    def __init__(self, binary, table, folder, short, seed):
        self.binary, self.table, self.short = binary, table, short
        self.draw = random.Random(seed)
        self.folder = Path(folder)
        self.count = 0

    def place(self):
        """A folder of its own."""
        self.count += 1
        path = self.folder / str(self.count)
        path.mkdir()
        return path

    def start(self, arguments, folder, limits=(), **more):
        def prepare():
            for which, size in limits:
                resource.setrlimit(which, (size, size))

        return subprocess.Popen([self.binary] + [os.fspath(a) for a in arguments], cwd=folder, stdin=subprocess.DEVNULL,
                                preexec_fn=prepare, **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **more})

    def run(self, arguments, folder, limits=(), **more):
        begin = time.monotonic()
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        process = self.start(arguments, folder, limits, **more)
        try:
            out, err = process.communicate(timeout=LIMITED_S)
        except subprocess.TimeoutExpired:
            process.kill()
            out, err = process.communicate()
            err = b"(killed after %d s) " % LIMITED_S + (err or b"")
        now = resource.getrusage(resource.RUSAGE_CHILDREN)
        return Ended(process.returncode, out or b"", err or b"", time.monotonic() - begin,
                     now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime)

    # -------------------------------------------------------------------------------------------------------------- hostile

    def hostile(self):
        kind = "hostile files"
        folder = self.place()
        either = {"open.stl", "lies.stl", "nul.obj", "elements.ply", "properties.ply", "empty.ply", "bombs.3mf", "noise.stl", "zeros.stl"}
        files = meshes.hostile(20 if self.short else 300)
        for name, data in files.items():
            (folder / name).write_bytes(data)
            for command in (["inspect", name], ["float", name, "-o", "out.stl", "--resolution", "20", "--no-advice"]):
                ended = self.run(command + (["--memory", "10MB"] if name.startswith("bomb") else []), folder)
                problems = lawful(ended, {0, 3, 4} if name in either else {3})
                if ended.seconds > 10:
                    problems.append("took %.1f s" % ended.seconds)
                if ended.code != 0 and (folder / "out.stl").exists():
                    problems.append("wrote something")
                (folder / "out.stl").unlink(missing_ok=True)
                self.table.note(kind, " ".join(command[:2]), problems)
            (folder / name).unlink()
        self.left(kind, folder, set())
        kind = "files with random changes"
        body = meshes.egg((30, 22, 16), 6, 8)
        for ending, encode in meshes.ENCODINGS.items():
            whole = encode(body)
            for n in range(12 if self.short else 250):
                name = "changed%d.%s" % (n, ending)
                (folder / name).write_bytes(meshes.mutated(whole, self.draw))
                problems = lawful(self.run(["inspect", name], folder), {0, 3})
                self.table.note(kind, name, problems)
                if problems:
                    (self.folder.parent / ("rayrep_faults_" + name)).write_bytes((folder / name).read_bytes())
                (folder / name).unlink()

    def names(self):
        kind = "names with control characters"
        folder = self.place()
        names = (b"a\x1b[31mred.stl", b"a\nb.stl", b"a\x7f.stl", b"a\xc2\x9b31m.stl", b"not\xff utf8.stl", b"'quote\".stl", b"-dash.stl", b"a b.stl")
        for name in names[:5] if self.short else names:
            path = folder / os.fsdecode(name)
            path.write_bytes(meshes.stl(meshes.egg()))
            given = b"./" + name
            out = b"./out_" + name
            runs = ([b"inspect", given], [b"inspect", given, b"--json"], [b"inspect", given + b"x"],
                    [b"float", given, b"-o", out, b"--resolution", b"20", b"-v", b"--report", out + b".json"],
                    [b"float", given, b"-o", out, b"--waterline", b"1", b"--resolution", b"20"])
            for arguments in runs:
                ended = self.run([os.fsdecode(a) for a in arguments], folder)
                self.table.note(kind, repr(arguments), lawful(ended, {0, 3, 4}))
            self.table.note(kind, "output", [] if (folder / os.fsdecode(out)).exists() else ["not there"])

    def sizes(self):
        kind = "sizes and numbers out of reach"
        folder = self.place()
        (folder / "egg.stl").write_bytes(meshes.stl(meshes.egg()))
        for size in ("1e-300", "1e-12", "1e300", "1e12", "0", "-1", "nan", "inf", "9" * 300):
            for command in ("inspect", "float", "stand", "spin"):
                ended = self.run([command, "egg.stl", "--size", size], folder)
                self.table.note(kind, command + " --size " + size[:20], lawful(ended, {2}))
        for option in ("--wall", "--density", "--waterline", "--fluid"):
            for value in ("1e-300", "1e300", "nan", "-1", "1e12", "9" * 300):
                ended = self.run(["float", "egg.stl", option, value, "--no-advice", "--resolution", "20"], folder)
                self.table.note(kind, option + " " + value[:20], lawful(ended, {2, 3, 4}))
        self.left(kind, folder, {"egg.stl"})

    # --------------------------------------------------------------------------------------------------------------- faults

    def left(self, kind, folder, allowed):
        found = {p.name for p in folder.iterdir()} - allowed
        self.table.note(kind, "what is left", ["left behind: %s" % sorted(found)] if found else [])

    def refused_before(self, kind, folder, output, name):
        """An output that cannot be written is found out before the work."""
        ended = self.run(["float", "egg.stl", "-o", output, "-v"], folder)
        problems = lawful(ended, {6})
        if b"rayrep: domain" in ended.err:
            problems.append("found out after the work")
        self.table.note(kind, name, problems)

    def disk(self):
        kind = "faults of the disk"
        folder = self.place()
        (folder / "egg.stl").write_bytes(meshes.stl(meshes.egg()))
        (folder / "folder.stl").mkdir()
        os.mkfifo(folder / "fifo.stl")
        os.symlink("/dev/full", folder / "full.stl")
        os.symlink("/dev/null", folder / "null.stl")
        os.symlink("loop.stl", folder / "loop.stl")
        (folder / "locked.stl").write_bytes(b"old")
        os.chmod(folder / "locked.stl", 0o444)
        (folder / "shut").mkdir()
        os.chmod(folder / "shut", 0o555)
        before = {p.name for p in folder.iterdir()}
        wrong = ["no/such/folder.stl", "folder.stl", "fifo.stl", "full.stl", "null.stl", "loop.stl", "egg.stl/x.stl", "x" * 252 + ".stl",
                 "/" + "y/" * 3000 + "x.stl"]
        if os.geteuid() != 0:  # to root nothing is locked
            wrong += ["locked.stl", "shut/x.stl", "/proc/x.stl"]
        for output in wrong:
            self.refused_before(kind, folder, output, output[:30])
        float_to = lambda name, *more: ["float", "egg.stl", "-o", name, "--resolution", "30", *more]
        ended = self.run(float_to("a.stl", "--report", "/dev/full"), folder)
        self.table.note(kind, "report to a full device", lawful(ended, {6}))
        ended = self.run(float_to("a.stl", "--report", "/dev/stdout", "-q"), folder)
        problems = lawful(ended, {0})
        try:
            json.loads(ended.out)
        except ValueError as error:
            problems.append("no JSON: %s" % error)
        self.table.note(kind, "report to a pipe", problems)
        with open(folder / "both", "w+b") as both:
            ended = self.run(float_to("a.stl", "--report", "/dev/fd/1"), folder, stdout=both)
            both.seek(0)
            text = both.read()
        self.table.note(kind, "report and summary to one file", lawful(ended, {0}) +
                        ([] if text.startswith(b"{") and b"VERIFIED" in text else ["%r" % text[:80]]))
        read = []
        os.mkfifo(folder / "pipe.json")
        reader = threading.Thread(target=lambda: read.append((folder / "pipe.json").read_bytes()))
        reader.start()
        ended = self.run(float_to("a.stl", "--report", "pipe.json"), folder)
        reader.join(5)
        self.table.note(kind, "report to a named pipe", lawful(ended, {0}) + ([] if read and read[0].startswith(b"{") else ["nothing came"]))
        (folder / "both").unlink()
        (folder / "pipe.json").unlink()
        for name, more in (("full", {"stdout": open("/dev/full", "wb")}), ("gone", {"stdout": self.closed_pipe()})):
            (folder / "a.stl").unlink(missing_ok=True)
            ended = self.run(float_to("a.stl"), folder, **more)
            problems = lawful(ended, {6})
            if b"verified and in place" not in ended.err or not (folder / "a.stl").exists():
                problems.append("%r" % ended.err)
            self.table.note(kind, "standard output " + name, problems)
        whole = (folder / "a.stl").read_bytes()
        ended = self.run(["-c", 'exec "%s" float egg.stl -o a.stl --resolution 30 >&-' % self.binary], folder, executable="/bin/sh")
        self.table.note(kind, "standard output closed", lawful(ended, {6}) + ([] if (folder / "a.stl").read_bytes() == whole else ["other bytes"]))
        for size in (0, 1000, 20000):
            ended = self.run(float_to("a.stl", "--report", "r.json"), folder, [(resource.RLIMIT_FSIZE, size)])
            self.table.note(kind, "files of %d bytes at most" % size, lawful(ended, {6}) +
                            ([] if (folder / "a.stl").read_bytes() == whole else ["the old output is gone"]))
        for files in (0, 3, 4, 5, 8, 12):
            ended = self.run(float_to("a.stl"), folder, [(resource.RLIMIT_NOFILE, files)])
            if b"shared librar" not in ended.err:
                self.table.note(kind, "%d open files" % files, lawful(ended, {0, 3, 6}))
        self.left(kind, folder, before | {"a.stl"})

    @staticmethod
    def closed_pipe():
        read, write = os.pipe()
        os.close(read)
        return write

    def memory(self):
        kind = "too little memory"
        folder = self.place()
        (folder / "egg.stl").write_bytes(meshes.stl(meshes.egg(rows=60, columns=90)))
        (folder / "a.stl").write_bytes(b"old")
        megabytes = list(range(60, 700, 80 if self.short else 10))
        for size in megabytes:
            for command in (["inspect", "egg.stl"], ["float", "egg.stl", "-o", "a.stl", "--no-advice"]):
                if self.short and command[0] == "inspect" and size > 300:
                    continue
                ended = self.run(command, folder, [(resource.RLIMIT_AS, size * 1000000)])
                # It did not begin: log4cplus, which OpenVDB links, starts threads before main, and rayrep has words of its own for
                # what ends it later.
                if ended.code == 127 or b"shared librar" in ended.err or b"terminate called" in ended.err:
                    continue
                problems = lawful(ended, {0, 1})
                if ended.code != 0 and (folder / "a.stl").read_bytes() != b"old":
                    problems.append("the old output is gone")
                self.table.note(kind, "%s in %d MB" % (command[0], size), problems)
                (folder / "a.stl").write_bytes(b"old")
        self.left(kind, folder, {"egg.stl", "a.stl"})

    # ---------------------------------------------------------------------------------------------------------------- kills

    def kills(self):
        folder = self.place()
        (folder / "egg.stl").write_bytes(meshes.stl(meshes.egg()))
        big = meshes.egg(rows=300 if self.short else 1000, columns=500 if self.short else 1000)
        for ending in ("stl", "obj", "ply", "3mf"):
            (folder / ("big." + ending)).write_bytes(meshes.ENCODINGS[ending](big))
        (folder / "boxes.stl").write_bytes(meshes.stl(meshes.crossing_boxes(90, 0.1)))
        before = {p.name for p in folder.iterdir()}
        hollow = lambda name, n, *more: ["float", name, "-o", "a.stl", "--resolution", str(n), *more]
        commands = [hollow("egg.stl", 300), hollow("boxes.stl", 60), ["inspect", "boxes.stl"], ["inspect", "big.3mf"], hollow("big.stl", 100),
                    hollow("big.obj", 100), ["inspect", "big.ply"], ["spin", "egg.stl", "-o", "a.stl", "--certify"],
                    hollow("egg.stl", 200, "--waterline", "1", "--no-advice"), hollow("egg.stl", 400)]
        for command in commands:
            for n in range(1 if self.short else 30):
                which = self.draw.choice(list(SIGNALS))
                self.kill(folder, command, which, self.draw.uniform(0, 1) ** 2 * (1.5 if self.short else 6))
        self.left("signals", folder, before | {"a.stl"})
        self.murders(folder, before, hollow("egg.stl", 300))

    def kill(self, folder, command, which, after):
        kind = "signals"
        (folder / "a.stl").write_bytes(b"old")
        process = self.start(command, folder)
        time.sleep(0.02 + after)  # before that its own handler may not be there yet
        began = process.poll() is None
        process.send_signal(which)
        sent = time.monotonic()
        try:
            out, err = process.communicate(timeout=LIMITED_S)
        except subprocess.TimeoutExpired:
            process.kill()
            out, err = process.communicate()
        took = time.monotonic() - sent
        code = process.returncode
        problems = []
        # A signal in the first moments meets no handler yet: the shell sees the same number.
        code = 128 - code if code < 0 and code == -which else code
        if code not in ({0, SIGNALS[which]} if began else {0, 4}) and not (code == 4 and b"rayrep: " in err):
            problems.append("exit code %s, wanted %d: %r" % (code, SIGNALS[which], err[:200]))
        if took > 1.5:
            problems.append("took %.2f s to end" % took)
        if code != 0 and (folder / "a.stl").read_bytes() != b"old":
            problems.append("the old output is gone")
        hidden = [p.name for p in folder.iterdir() if p.name.startswith(".")]
        if hidden:
            problems.append("left %s" % hidden)
        self.table.note(kind, "%s after %.2f s of %s" % (which.name, after, " ".join(command)), problems)

    def murders(self, folder, before, command):
        kind = "SIGKILL, and the run after it"
        for n in range(4 if self.short else 60):
            (folder / "a.stl").write_bytes(b"old")
            process = self.start(command, folder)
            time.sleep(self.draw.uniform(0, 1.5))
            process.kill()
            process.communicate()
            problems = []
            if process.returncode != 0 and (folder / "a.stl").read_bytes() != b"old":
                problems.append("the old output is gone")
            self.table.note(kind, "killed", problems)
        for hidden in folder.glob(".rayrep-*"):
            os.utime(hidden, (time.time() - 7200, time.time() - 7200))
        dead = subprocess.Popen(["true"])
        dead.wait()
        kept = [".rayrep-%d-0.stl" % os.getpid(), ".rayrep-%d-1.stl" % dead.pid, ".rayrep-x-0.stl", ".rayrep-5", "rayrep-%d-0.stl" % dead.pid]
        gone = [".rayrep-%d-0.stl" % dead.pid, ".rayrep-%d-17" % dead.pid]
        for name in kept + gone:
            (folder / name).write_bytes(b"")
            if not name.endswith("-1.stl"):  # which is young
                os.utime(folder / name, (time.time() - 7200, time.time() - 7200))
        ended = self.run(["float", "egg.stl", "-o", "a.stl", "--resolution", "30"], folder)
        problems = lawful(ended, {0})
        problems += ["%s is gone" % name for name in kept if not (folder / name).exists()]
        problems += ["%s is still there" % name for name in gone if (folder / name).exists()]
        self.table.note(kind, "a later run", problems)
        self.left(kind, folder, before | {"a.stl"} | set(kept))

    # --------------------------------------------------------------------------------------------------------- determinism

    def determinism(self):
        kind = "same bytes"
        folder = self.place()
        (folder / "egg.stl").write_bytes(meshes.stl(meshes.egg()))
        (folder / "boxes.stl").write_bytes(meshes.stl(meshes.crossing_boxes(40, 0.1)))
        installed = subprocess.run(["locale", "-a"], capture_output=True).stdout.decode().split()
        german = [l for l in installed if l.lower().startswith("de_de")][:1]
        surroundings = [(threads, locale) for threads in ("1", "2") for locale in ["C"] + german] + [("2", "C")]
        commands = [["inspect", "egg.stl", "--json"], ["inspect", "boxes.stl", "--json"], ["float", "egg.stl"], ["float", "boxes.stl"],
                    ["spin", "egg.stl"], ["stand", "egg.stl"], ["target", "egg.stl", "--mass", "40"]]
        endings = ("stl",) if self.short else ("stl", "obj", "ply", "3mf")
        for command in commands:
            for ending in endings if command[0] != "inspect" else ("none",):
                results = set()
                problems = []
                for threads, locale in surroundings:
                    output = folder / ("a." + ending)
                    output.unlink(missing_ok=True)
                    more = [] if ending == "none" else ["-o", output.name, "--resolution", "50", "-q"]
                    ended = self.run(command + ["--threads", threads] + more, folder, env={**os.environ, "LC_ALL": locale})
                    problems += lawful(ended, {0, 3, 4})
                    text = ended.out + (output.read_bytes() if output.exists() else b"") + ended.err
                    if ending == "3mf" and output.exists():
                        text = meshes.zipfile.ZipFile(output).read("3D/3dmodel.model")
                    results.add(text)
                if len(results) > 1:
                    problems.append("%d different results" % len(results))
                self.table.note(kind, " ".join(command) + " ." + ending, problems)

    # ---------------------------------------------------------------------------------------------------------------- cost

    def cost(self):
        """Twice the triangles take about twice the time: three times at most, which is far from the four of quadratic work."""
        if self.short:
            return
        kind = "cost at n and 2 n"
        folder = self.place()
        elements = lambda n: meshes.ply_header(8, 12, more="".join("element e%d 0\nproperty float x\n" % k for k in range(n))) + meshes.ply(
            meshes.box()).split(b"end_header\n", 1)[1]
        properties = lambda n: meshes.ply_header(8, 12, more="element e 0\n" + "".join("property float x%d\n" % k for k in range(n))) + meshes.ply(
            meshes.box()).split(b"end_header\n", 1)[1]
        cases = {
            "fans.stl": (lambda n: meshes.stl(meshes_triangles(meshes.cylinder(n))), 20000),
            "thin.obj": (lambda n: meshes.obj(meshes.cylinder(n, height=0.01)), 20000),
            "polygons.obj": (lambda n: meshes.obj(meshes.cylinder(n, False)), 20000),
            "polygons.off": (lambda n: meshes.off(meshes.cylinder(n, False)), 20000),
            "polygons.ply": (lambda n: meshes.ply(meshes.cylinder(n, False)), 20000),
            "elements.ply": (elements, 20000), "properties.ply": (properties, 20000),
            "objects.3mf": (meshes.many_objects, 3000), "bodies.stl": (lambda n: meshes.stl(meshes.separate_boxes(n)), 10000),
            "crossing.stl": (lambda n: meshes.stl(meshes.crossing_boxes(n, 0.1)), 40),
            "egg.stl": (lambda n: meshes.stl(meshes.egg(rows=n, columns=500)), 400)}
        for name, (make, n) in cases.items():
            spent = []
            for count in (n, 2 * n):
                (folder / name).write_bytes(make(count))
                ended = min((self.run(["inspect", name, "--threads", "1"], folder) for _ in range(2)), key=lambda e: e.cpu_s)
                self.table.note(kind, name, lawful(ended, {0}))
                spent.append(max(ended.cpu_s - 0.03, 0.05))
            ratio = spent[1] / spent[0]
            print("%-16s n = %6d: %6.2f s, 2 n: %6.2f s, ratio %.2f" % (name, n, spent[0], spent[1], ratio), flush=True)
            self.table.note(kind, name, ["ratio %.2f" % ratio] if ratio > 3 else [])


def meshes_triangles(mesh):
    points, faces = mesh
    return points, [(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)]


def main():
    kinds = ("hostile", "names", "sizes", "disk", "memory", "kills", "determinism", "cost")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(kinds))
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    table = Table()
    with tempfile.TemporaryDirectory(prefix="rayrep_faults_") as folder:
        runs = Runs(os.path.abspath(options.binary), table, folder, options.short, options.seed)
        for kind in options.kinds or kinds:
            begin = time.monotonic()
            known = set(table.rows)
            getattr(runs, kind)()
            added = [k for k in table.rows if k not in known]
            if added:
                table.rows[added[0]][2] = time.monotonic() - begin
    table.show()
    return 1 if table.failed else 0


if __name__ == "__main__":
    sys.exit(main())
