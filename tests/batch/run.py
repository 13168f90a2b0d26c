#!/usr/bin/env python3
"""Batches of jobs, as they are run on a machine and on a cluster.

  tests/batch/run.py RAYREP [basics] [kills] [parallel] [slurm] [throughput] [--short] [--jobs N]

basics      every kind of end has its line: done, refused, crashed, took too long; the table; what is wrong with a file of jobs
kills       kill -9 at random moments and gone on until all is done: one line a job, and every byte that an unbroken run writes
            but seconds and memory, for several numbers of shards
parallel    the shards as jobs of GNU parallel
slurm       the shards as a Slurm array on this machine (slurmctld and slurmd are started for it, as root)
throughput  jobs a second over those of xargs -P with the same command lines
Parts whose programs are missing are skipped and said so. The exit code is 1 if anything failed.
"""
import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

OWN = ("seconds", "cpu_seconds", "memory_mb")  # another value every time


def tetrahedron(path, size):
    """A closed mesh, OBJ."""
    path.write_text("".join("v %r %r %r\n" % tuple(size * c for c in p) for p in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)))
                    + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n")


def octahedron(path, a, b, c):
    corners = [(a, 0, 0), (-a, 0, 0), (0, b, 0), (0, -b, 0), (0, 0, c), (0, 0, -c)]
    faces = [(1, 3, 5), (3, 2, 5), (2, 4, 5), (4, 1, 5), (3, 1, 6), (2, 3, 6), (4, 2, 6), (1, 4, 6)]
    path.write_text("".join("v %r %r %r\n" % p for p in corners) + "".join("f %d %d %d\n" % f for f in faces))


class Batches:
    def __init__(self, binary, folder, short, count):
        self.binary, self.folder, self.short, self.count = binary, Path(folder), short, count
        self.failed = 0

    def law(self, holds, words):
        print(("ok      " if holds else "FAILED  ") + words, flush=True)
        self.failed += not holds

    def run(self, *arguments, **more):
        return subprocess.run([self.binary, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True, **more)

    def study(self, name, count):
        """Jobs that end well and jobs that are refused."""
        octahedron(self.folder / "eight.obj", 30, 30, 25)
        tetrahedron(self.folder / "four.obj", 20)
        lines = []
        for n in range(count):
            goal, mesh = (("stand", "four.obj"), ("float", "eight.obj"), ("spin", "eight.obj"))[n % 3]
            options = {"resolution": 20 + n % 7, "wall": round(0.8 + 0.01 * (n % 40), 3)}
            if n % 10 == 9:
                options["wall"] = 30  # no room for a cavity
            lines.append(json.dumps({"id": "job-%04d" % n, "command": goal, "mesh": mesh, "options": options}))
        (self.folder / name).write_text("\n".join(lines) + "\n")
        return count

    def contents(self, out):
        """Every file of a batch with its bytes, without what is another one each time."""
        found = {}
        for path in sorted(out.rglob("*")):
            if not path.is_file() or path.name == ".lock":
                continue
            data = path.read_bytes()
            if path.parent.name == "lines" or path.name == "results.jsonl":
                lines = [json.loads(line) for line in data.decode().splitlines()]
                for line in lines:
                    for name in OWN:
                        line.pop(name)
                data = json.dumps(lines).encode().replace(str(out).encode(), b"OUT").replace(out.name.encode(), b"OUT")
            found[str(path.relative_to(out))] = data.replace(out.name.encode(), b"OUT")
        return found

    # --------------------------------------------------------------------------------------------------------------- basics

    def basics(self):
        octahedron(self.folder / "eight.obj", 30, 30, 25)
        jobs = [{"id": "good", "command": "float", "mesh": "eight.obj", "options": {"resolution": 20}},
                {"id": "refused", "command": "float", "mesh": "eight.obj", "options": {"resolution": 20, "wall": 30}},
                {"id": "missing", "command": "float", "mesh": "nothing.obj"},
                {"id": "slow", "command": "float", "mesh": "eight.obj", "options": {"resolution": 1000, "size": 2000, "wall": 4}},
                {"id": "seen", "command": "inspect", "mesh": "eight.obj"}]
        (self.folder / "b.jsonl").write_text("\n".join(map(json.dumps, jobs)))
        ended = self.run("batch", "b.jsonl", "-o", "b", "--timeout", "3", "--summary", "b.csv")
        self.law(ended.returncode == 0, "a batch ends well whatever its jobs do: " + ended.stdout.splitlines()[0] if ended.stdout else ended.stderr)
        lines = {line["id"]: line for line in map(json.loads, (self.folder / "b/results.jsonl").read_text().splitlines())}
        self.law([line for line in lines] == [job["id"] for job in jobs], "one line a job, in their order")
        self.law([lines[job["id"]]["exit"] for job in jobs] == [0, 4, 3, 124, 0], "exit codes: done, refused, unreadable, too long, done")
        self.law(lines["good"]["pass"] is True and lines["good"]["figures"]["mass_g"] > 0, "figures of what was made")
        self.law(lines["good"]["outputs"] == ["good.stl"] and (self.folder / "b/good.stl").exists(), "and its mesh")
        self.law("ended" in lines["slow"], "what took too long says so")
        digest = subprocess.run(["sha256sum", "eight.obj"], cwd=self.folder, capture_output=True, text=True).stdout.split()[0]
        self.law(lines["good"]["input_sha256"] == digest, "the hash of the mesh is that of sha256sum")
        self.law(not [p for p in (self.folder / "b").iterdir() if p.name.startswith(".work")], "nothing is left behind")
        rows = (self.folder / "b.csv").read_text().splitlines()
        self.law(len(rows) == len(jobs) + 1 and rows[0].startswith("id,command,mesh,exit"), "a table of all")
        again = self.run("batch", "b.jsonl", "-o", "b")
        self.law("0 of them run now" in again.stdout, "what has its line is not run again")
        octahedron(self.folder / "eight.obj", 31, 30, 25)
        again = self.run("batch", "b.jsonl", "-o", "b", "--timeout", "3")
        self.law("4 of them run now" in again.stdout, "but with another mesh it is: " + again.stdout.splitlines()[0])
        again = self.run("batch", "b.jsonl", "-o", "b", "--timeout", "3", "--format", "ply")
        self.law("4 of them run now" in again.stdout and (self.folder / "b/good.ply").exists(), "and in another format")
        octahedron(self.folder / "outside.obj", 31, 30, 25)
        (self.folder / "v.jsonl").write_text(json.dumps({"command": "verify", "mesh": "eight.obj", "options": {"original": "outside.obj", "density": 0.5}}))
        self.run("batch", "v.jsonl", "-o", "v")
        octahedron(self.folder / "outside.obj", 31, 30, 26)
        again = self.run("batch", "v.jsonl", "-o", "v")
        self.law("1 of them run now" in again.stdout, "nor with another file that an option names: " + again.stdout.splitlines()[0])
        for text, words in (('{"command": "float"}', "mesh"), ('{"command": "float", "mesh": "a", "optoins": {}}', "options"), ("{", "line 1"),
                            ('{"command": "float", "mesh": "eight.obj", "options": {"wal": 1}}', "--wall"),
                            ('{"id": "../x", "command": "float", "mesh": "a"}', "id"),
                            ('{"command": "float", "mesh": "eight.obj", "options": {"output": "x.stl"}}', "output")):
            (self.folder / "bad.jsonl").write_text(text)
            ended = self.run("batch", "bad.jsonl", "-o", "bad")
            self.law(ended.returncode in (2, 3) and words in ended.stderr, "refused: " + ended.stderr.strip()[:150])
        swept = self.run("sweep", "float", "eight.obj", "--resolution", "20", "--vary", "wall=0.8..1.2/3", "--vary", "up=z|0,1,1")
        jobs = [json.loads(line) for line in swept.stdout.splitlines()]
        self.law([(j["options"]["wall"], j["options"]["up"]) for j in jobs] == [(w, u) for w in (0.8, 1, 1.2) for u in ("z", "0,1,1")],
                 "a study is all combinations")
        (self.folder / "swept.jsonl").write_text(swept.stdout)
        self.law(self.run("batch", "swept.jsonl", "-o", "swept", "--format", "3mf").returncode == 0 and
                 (self.folder / "swept" / (jobs[0]["id"] + ".3mf")).exists(), "and runs: " + jobs[0]["id"])

    # ---------------------------------------------------------------------------------------------------------------- kills

    def kills(self):
        count = self.study("k.jsonl", 12 if self.short else 60)
        begin = time.monotonic()
        unbroken = self.run("batch", "k.jsonl", "-o", "zz-whole")
        took = time.monotonic() - begin
        whole = self.contents(self.folder / "zz-whole")
        self.law(unbroken.returncode == 0 and len(whole["results.jsonl"]) > 0, "unbroken: %d jobs in %.1f s" % (count, took))
        draw = random.Random(7)
        for shards in (1, 3):
            out = "zz-killed-%d" % shards
            killed = 0
            for _ in range(3 if self.short else 20):
                running = [subprocess.Popen([self.binary, "batch", "k.jsonl", "-o", out, "--shard", "%d/%d" % (n + 1, shards), "--quiet"],
                                            cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for n in range(shards)]
                time.sleep(draw.uniform(0, took / 6))
                for process in running:
                    if process.poll() is None:
                        process.send_signal(signal.SIGKILL)
                        killed += 1
                for process in running:
                    process.wait()
            ends = [self.run("batch", "k.jsonl", "-o", out, "--shard", "%d/%d" % (n + 1, shards)).returncode for n in range(shards)]
            self.law(ends == [0] * shards, "gone on after %d kills of %d shards" % (killed, shards))
            after = self.contents(self.folder / out)
            self.law(sorted(after) == sorted(whole), "the files of an unbroken run: %s" % sorted(set(after) ^ set(whole))[:4])
            self.law(all(after.get(name) == data for name, data in whole.items()), "and their bytes: %s"
                     % [name for name, data in whole.items() if after.get(name) != data][:4])
        # Stopped by hand it leaves nothing half done.
        process = subprocess.Popen([self.binary, "batch", "k.jsonl", "-o", "zz-stopped", "--quiet"], cwd=self.folder, stderr=subprocess.PIPE)
        time.sleep(took / 3)
        process.send_signal(signal.SIGINT)
        process.communicate()
        self.law(process.returncode in (0, 130) and not list((self.folder / "zz-stopped").glob(".work*")), "Ctrl-C leaves no work behind")

    # ------------------------------------------------------------------------------------------------------- parallel and Slurm

    def compare(self, out, how):
        if not (self.folder / "zz-whole").exists():
            self.study("k.jsonl", 12 if self.short else 60)
            self.run("batch", "k.jsonl", "-o", "zz-whole")
        self.law(self.contents(self.folder / out) == self.contents(self.folder / "zz-whole"), how + ": the bytes of one run")

    def parallel(self):
        if not shutil.which("parallel"):
            print("skipped GNU parallel: it is not here")
            return
        self.study("k.jsonl", 12 if self.short else 60)
        ended = subprocess.run(["parallel", self.binary + " batch k.jsonl -o zz-par --shard {}/4 --jobs 1", ":::", "1", "2", "3", "4"],
                               cwd=self.folder, capture_output=True, text=True)
        self.law(ended.returncode == 0, "GNU parallel: " + ended.stderr.strip()[-200:])
        self.compare("zz-par", "GNU parallel")

    def slurm(self):
        missing = [p for p in ("slurmctld", "slurmd", "munged", "sbatch") if not shutil.which(p)]
        if missing or os.geteuid() != 0:
            print("skipped Slurm: " + (", ".join(missing) + " missing" if missing else "not root"))
            return
        self.study("k.jsonl", 12 if self.short else 60)
        place = self.folder / "slurm"
        place.mkdir()
        host = subprocess.run(["hostname", "-s"], capture_output=True, text=True).stdout.strip()
        (place / "munge").mkdir(mode=0o700)
        (place / "munge/key").write_bytes(random.Random(1).randbytes(1024))
        (place / "munge/key").chmod(0o400)
        sock = place / "munge.sock"
        (place / "slurm.conf").write_text(
            "ClusterName=one\nSlurmctldHost=%s(127.0.0.1)\nSlurmUser=root\nSlurmdUser=root\nAuthType=auth/munge\nAuthInfo=socket=%s\n"
            "CredType=cred/munge\nStateSaveLocation=%s/state\nSlurmdSpoolDir=%s/spool\nSlurmctldPidFile=%s/ctl.pid\nSlurmdPidFile=%s/d.pid\n"
            "SlurmctldPort=16817\nSlurmdPort=16818\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nMpiDefault=none\n"
            "SelectType=select/cons_tres\nReturnToService=2\nSlurmctldLogFile=%s/ctl.log\nSlurmdLogFile=%s/d.log\nJobAcctGatherType=jobacct_gather/none\n"
            "NodeName=%s NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN\nPartitionName=all Nodes=ALL Default=YES State=UP\n"
            % (host, sock, place, place, place, place, place, place, host))
        (place / "state").mkdir()
        (place / "spool").mkdir()
        environment = dict(os.environ, SLURM_CONF=str(place / "slurm.conf"))
        daemons = []

        def daemon(*words):
            daemons.append(subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

        try:
            daemon("munged", "--foreground", "--force", "--key-file=%s/munge/key" % place, "--socket=%s" % sock, "--pid-file=%s/munge.pid" % place,
                   "--log-file=%s/munge.log" % place, "--seed-file=%s/munge.seed" % place)
            time.sleep(1)
            daemon("slurmctld", "-D")
            daemon("slurmd", "-D", "-N", host)
            deadline = time.monotonic() + 60
            while time.monotonic() < deadline:
                state = subprocess.run(["sinfo", "-h", "-o", "%t"], env=environment, capture_output=True, text=True).stdout
                if "idle" in state:
                    break
                time.sleep(1)
            else:
                print("skipped Slurm: its daemons do not start here: " + "".join(
                    log.read_text()[-300:] for log in (place / "ctl.log", place / "d.log") if log.exists()))
                return
            script = self.folder / "array.sh"
            script.write_text("#!/bin/sh\n#SBATCH --array=1-4\n#SBATCH --ntasks=1\n#SBATCH --output=slurm-%a.log\n"
                              "exec '" + self.binary + "' batch k.jsonl -o zz-arr --shard \"$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT\" --jobs 1\n")
            ended = subprocess.run(["sbatch", "--wait", str(script)], cwd=self.folder, env=environment, capture_output=True, text=True, timeout=300)
            self.law(ended.returncode == 0, "a Slurm array of 4: " + (ended.stdout + ended.stderr).strip()[-200:])
            for log in sorted(self.folder.glob("slurm-*.log")):
                print("        " + log.name + ": " + log.read_text().strip().replace("\n", "\n        ")[-300:])
            self.compare("zz-arr", "Slurm")
        finally:
            for process in reversed(daemons):
                process.terminate()
            for process in daemons:
                try:
                    process.wait(10)
                except subprocess.TimeoutExpired:
                    process.kill()

    # ----------------------------------------------------------------------------------------------------------- throughput

    def throughput(self):
        count = self.study("t.jsonl", self.count)
        cores = os.cpu_count()
        (self.folder / "plain").mkdir()
        lines = []
        for line in (self.folder / "t.jsonl").read_text().splitlines():
            job = json.loads(line)
            words = [self.binary, job["command"], job["mesh"]] + ["--%s=%s" % pair for pair in job["options"].items()]
            lines.append(" ".join(words + ["--output=plain/%s.stl" % job["id"], "--report=plain/%s.json" % job["id"], "--no-advice", "--quiet",
                                           "--threads=1"]))
        begin = time.monotonic()
        subprocess.run(["xargs", "-P", str(cores), "-I", "{}", "sh", "-c", "{} || true"], cwd=self.folder, input="\n".join(lines), text=True,
                       stderr=subprocess.DEVNULL)
        plain = time.monotonic() - begin
        begin = time.monotonic()
        self.run("batch", "t.jsonl", "-o", "t", "--quiet")
        batch = time.monotonic() - begin
        print("        %d jobs: %.1f s, by xargs -P %d %.1f s: %.3f of its throughput" % (count, batch, cores, plain, plain / batch))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("parts", nargs="*", default=[])
    parser.add_argument("--short", action="store_true", help="few jobs and few kills")
    parser.add_argument("--jobs", type=int, default=1000, help="of throughput")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        batches = Batches(os.path.abspath(arguments.binary), folder, arguments.short, arguments.jobs)
        for part in arguments.parts or ["basics", "kills", "parallel", "slurm", "throughput"]:
            getattr(batches, part)()
    return 1 if batches.failed else 0


if __name__ == "__main__":
    sys.exit(main())
