#!/usr/bin/python3
"""Every kind of JSON that the command writes against docs/report.schema.json: tests/schema/run.py RAYREP (package python3-jsonschema)."""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
RUNS = [
    ("float", "duck.stl", "--resolution", "40"), ("float", "duck.stl", "--resolution", "40", "--infill", "15", "--phases", "-o", "sparse.3mf"),
    ("spin", "bird.stl", "--resolution", "40", "--certify"), ("spin", "heart.stl", "--yoyo", "--up", "y", "--resolution", "40"),
    ("float", "duck.stl", "--cut", "auto", "--resolution", "40"),
    ("spin", "sumo.stl", "--core-material", "tin", "--resolution", "40"), ("stand", "teapot.stl", "--resolution", "40"),
    ("stand", "couple.stl", "--deform-limit", "3", "--resolution", "40"), ("stand", "heart.stl", "--balls", "2", "--resolution", "40"),
    ("target", "duck.stl", "--mass", "50", "--resolution", "40"), ("pose", "die.stl", "--stand", "z", "--stand", "x", "--resolution", "40"),
    ("dice", "die.stl", "--resolution", "40"), ("verify", "duck.stl", "--goal", "float", "--density", "0.5", "--waterline", "20"), ("inspect", "duck.stl"),
    ("float", "duck.stl", "--resolution", "40", "--resin"),
    ("float", "duck.stl", "--resolution", "40", "--waterline", "2", "--allow", "waterline"),
    ("stand", "teapot.stl", "--resolution", "40", "--self-supporting", "--print-direction", "y"),
]

# Two parts, of which one passes the other.
SCENE = {
    "parts": {"duck": {"mesh": str(EXAMPLES / "duck.stl")}, "heart": {"mesh": str(EXAMPLES / "heart.stl"), "pivot": [0, 0, 10], "printed": False, "density": 2}},
    "states": {"left": {"up": "z", "poses": {"heart": {"at": [-200, 0, 0]}}}, "right": {"poses": {"heart": {"at": [200, 0, 0], "axis": "z", "deg": 90}}}},
    "transitions": [{"from": "left", "to": "right", "motions": {"heart": {"translation": [{"time": 0.5, "at": [0, 0, 5], "in": [-80, 0, 0], "out": [80, 0, 0]}]}}}],
    "may_touch": [{"parts": ["duck", "heart"], "clearance": 0.2}], "room": [[-300, -300, -300], [300, 300, 300]],
}
SCENE_RUNS = [("motion", "scene.json"), ("scene", "check", "scene.json"), ("scene", "import", str(EXAMPLES / "scenes/arm.urdf")), ("scene", "export", "scene.json"), ("carve", "scene.json", "--part", "duck", "--by", "heart", "--tolerance", "4"),
              ("balance", str(EXAMPLES / "scenes/giraffe.json"), "--resolution", "40", "-o", "balanced")]


def check_scenes(tool, schema, validator):
    """The scene against its schema, and what is told of it."""
    of_scenes = validator(json.loads((ROOT / "docs/scene.schema.json").read_text()))
    failed = [error for scene in [SCENE, *(json.loads(p.read_text()) for p in sorted((EXAMPLES / "scenes").glob("*.json")))] for error in of_scenes.iter_errors(scene)]
    for words in SCENE_RUNS:
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "scene.json").write_text(json.dumps(SCENE))
            ended = subprocess.run([tool, *words, "--json"], cwd=folder, capture_output=True, text=True)
        told = json.loads(ended.stdout)
        of_kind = validator({"$ref": "#/$defs/" + words[0], "$defs": schema["$defs"]})
        errors = list(of_kind.iter_errors(told))
        print(("FAILED  " if errors or of_kind.is_valid({**told, "another": 1}) else "ok      ") + " ".join(words))
        failed += errors
    for error in failed[:5]:
        print("        %s: %s" % ("/".join(map(str, error.absolute_path)), error.message[:200]))
    return len(failed)


def main():
    try:
        import jsonschema
    except ImportError:
        print("skipped: there is no python3-jsonschema")
        return 0
    schema = json.loads((ROOT / "docs/report.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    failed = check_scenes(str(Path(sys.argv[1]).resolve()), schema, jsonschema.Draft202012Validator)
    for command, mesh, *more in RUNS:
        with tempfile.TemporaryDirectory() as folder:
            ended = subprocess.run([str(Path(sys.argv[1]).resolve()), command, str(EXAMPLES / mesh), *more, "--json"], cwd=folder, capture_output=True, text=True)
        words = " ".join((command, mesh, *more))
        kind = command if command in ("inspect", "measure") else "run"
        try:
            report = json.loads(ended.stdout)
        except ValueError:
            print("FAILED  %s: no JSON, exit code %d: %s" % (words, ended.returncode, ended.stderr[-300:]))
            failed += 1
            continue
        errors = list(jsonschema.Draft202012Validator({"$ref": "#/$defs/" + kind, "$defs": schema["$defs"]}).iter_errors(report))
        # A schema that lets everything pass is none.
        report["another"] = 1
        loose = jsonschema.Draft202012Validator({"$ref": "#/$defs/" + kind, "$defs": schema["$defs"]}).is_valid(report)
        print(("FAILED  " if errors or loose else "ok      ") + words)
        for error in errors[:5]:
            print("        %s: %s" % ("/".join(map(str, error.absolute_path)), error.message[:200]))
        failed += bool(errors or loose)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
