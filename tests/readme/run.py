#!/usr/bin/python3
"""What the documents say holds: tests/readme/run.py RAYREP.

Every relative link of every *.md leads somewhere, and so does every path of this repository that is named. Every command line of rayrep
in them makes sense to the command. Every command of console blocks in the README and docs/commands.md is run, and says what is shown
there: a line that ends in "..." is the beginning of one, a line "..." any number of them.
"""
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SERVES = "studio"  # until it is ended
NEEDS = {"--slicer": "prusa-slicer", "duck_float.gcode": "prusa-slicer"}


def documents():
    """In the folders that git knows; builds and packages of npm bring others."""
    inside = [ROOT / name for name in ("docs", "examples", "tools/report", "tests", "benchmarks", "fuzz", "python")]
    return sorted([*ROOT.glob("*.md"), *(path for folder in inside for path in folder.rglob("*.md"))])


def without_code(text):
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", "`", re.sub(r"^    .*$", "", text, flags=re.M))


def anchors(text):
    """As GitHub makes them of headings."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings}


def broken_links(path, text):
    for target in re.findall(r"\]\(([^)\s]+)\)", without_code(text)):
        if re.match(r"[a-z]+:", target):
            continue
        file, _, anchor = target.partition("#")
        there = path.parent / file if file else path
        if not there.exists():
            yield f"{target} is not there"
        elif anchor and anchor not in anchors(there.read_text()):
            yield f"{target}: there is no such heading"


def wrong_paths(text):
    """Of this repository's files that are named without a link."""
    for path in re.findall(r"`((?:src|include|tests|tools|docs|benchmarks|fuzz|cmake|examples)/[\w./-]+)`", text):
        if not any((ROOT / path).parent.glob((ROOT / path).name + "*")):
            yield f"{path} is not there"


def advised(text):
    """Command lines of rayrep as words; not what only shows a form, as FILE or ... do. Of what names a command without a mesh, its help."""
    lines = re.findall(r"^(?:    |\$ )(rayrep .*)$", text, flags=re.M) + re.findall(r"`(rayrep [a-z][^`\n]*)`", text)
    for line in lines:
        words = shlex.split(re.split(r" [|>] ", line)[0], comments=True)
        if len(words) < 3 or words[2].startswith("-"):
            words = [*words[:2], "--help"]
        if not any(word == "..." or re.fullmatch(r"[A-Z][A-Z_/.a-z]*", word) for word in words) and words[1] != SERVES:
            yield words


def shown(text):
    """Of console blocks each command with the lines that are shown of what it says."""
    for block in re.findall(r"^```console\n(.*?)^```", text, flags=re.M | re.S):
        for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
            command, *lines = part.rstrip("\n").split("\n")
            yield shlex.split(command), lines


def not_said(lines, said):
    """The first line that is not there, or not where it is shown; none."""
    said = [line.rstrip() for line in said.split("\n")]
    place, skipped = 0, True  # what comes first is left out without a word: a summary begins with the mesh
    for line in lines:
        if line == "...":
            skipped = True
            continue
        fits = (lambda text: text.startswith(line[:-4])) if line.endswith(" ...") else (lambda text: text == line)
        found = next((n for n in range(place, len(said)) if fits(said[n])), None)
        if found is None or (found > place and not skipped):
            return line
        place, skipped = found + 1, False
    return None


class Checks:
    def __init__(self, rayrep):
        self.rayrep, self.failed, self.counts = rayrep, 0, {}

    def check(self, kind, what, problem):
        self.counts[kind] = self.counts.get(kind, 0) + 1
        if problem:
            self.failed += 1
            print(f"FAILED  {what}: {problem}", flush=True)

    def run(self, words, folder):
        return subprocess.run([self.rayrep, *words[1:]], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)

    def links(self, path, text):
        problems = [*broken_links(path, text), *(wrong_paths(text) if path.name != "CHANGELOG.md" else [])]
        self.check("documents", path.relative_to(ROOT), "; ".join(problems))

    def command_lines(self, path, text):
        for words in advised(text):
            with tempfile.TemporaryDirectory() as folder:
                ended = self.run(words, folder)
            problem = ended.stdout if ended.returncode in (1, 2) else None
            self.check("command lines", f"{path.relative_to(ROOT)}: {shlex.join(words)}", problem)

    def answers(self, text):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("examples", "benchmarks"):
                (Path(folder) / name).symlink_to(ROOT / name)
            for words, lines in shown(text):
                needed = next((program for sign, program in NEEDS.items() if sign in words), None)
                if needed and not shutil.which(needed):
                    print(f"skipped: {shlex.join(words)}: there is no {needed}")
                    continue
                said = self.run(words, folder).stdout
                missing = not_said(lines, said)
                self.check("answers", shlex.join(words), missing and f"does not say\n  {missing}\nwhere it is shown, but\n{said}")


def checks_can_fail():
    """The checks themselves, on what is wrong."""
    assert list(broken_links(ROOT / "README.md", "[a](nowhere.md) [b](LICENSE) [c](docs/commands.md#exit-codes) [d](#nothing)")) == [
        "nowhere.md is not there", "#nothing: there is no such heading"]
    assert list(wrong_paths("`src/base`, `docs/nowhere.md`, `tests/print/test_print`")) == ["docs/nowhere.md is not there"]
    lines = "`rayrep float MESH`, `rayrep pose`\n    rayrep spin a.stl # b\n$ rayrep stand 'a b'\n`rayrep studio`"
    assert [words[1:3] for words in advised(lines)] == [["spin", "a.stl"], ["stand", "a b"], ["pose", "--help"]]
    assert not_said(["b ...", "...", "d"], "a\nb c\nx\nd\n") is None
    assert not_said(["b", "d"], "a\nb\nc\nd") == "d" and not_said(["c", "b"], "a\nb\nc") == "b" and not_said(["b"], "a\nb c") == "b"


def main():
    checks_can_fail()
    checks = Checks(str(Path(sys.argv[1]).resolve()))
    for path in documents():
        text = path.read_text()
        checks.links(path, text)
        checks.command_lines(path, text)
    for name in ("README.md", "docs/commands.md"):
        checks.answers((ROOT / name).read_text())
    print(", ".join(f"{count} {kind}" for kind, count in checks.counts.items()) + f": {checks.failed} failed")
    return 1 if checks.failed or len(checks.counts) < 3 else 0


if __name__ == "__main__":
    sys.exit(main())
