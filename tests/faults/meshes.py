"""Meshes as bytes, sound and hostile, for run.py. Everything is made here."""

import io
import math
import random
import struct
import zipfile

BOX = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]


def box(low=(0, 0, 0), high=(40, 30, 20)):
    return [tuple(float((low, high)[k >> a & 1][a]) for a in range(3)) for k in range(8)], BOX


def egg(radii=(30, 22, 16), rows=24, columns=36):
    """An ellipsoid."""
    points = [(0.0, 0.0, float(radii[2]))]
    for i in range(1, rows):
        for j in range(columns):
            a, b = math.pi * i / rows, 2 * math.pi * j / columns
            points.append((radii[0] * math.sin(a) * math.cos(b), radii[1] * math.sin(a) * math.sin(b), radii[2] * math.cos(a)))
    points.append((0.0, 0.0, -float(radii[2])))
    at = lambda i, j: 1 + (i - 1) * columns + j % columns
    faces = [(0, at(1, j), at(1, j + 1)) for j in range(columns)]
    for i in range(1, rows - 1):
        for j in range(columns):
            faces += [(at(i, j), at(i + 1, j), at(i + 1, j + 1)), (at(i, j), at(i + 1, j + 1), at(i, j + 1))]
    faces += [(len(points) - 1, at(rows - 1, j + 1), at(rows - 1, j)) for j in range(columns)]
    return points, faces


def crossing_boxes(count, jitter=0.0):
    """A row of boxes that cross their neighbours."""
    draw = random.Random(1)
    points, faces = [], []
    for n in range(count):
        p, f = box((0.37 * n, 0, 0), (40 + 0.37 * n, 30, 20))
        faces += [tuple(len(points) + v for v in t) for t in f]
        points += [tuple(c + draw.uniform(-jitter, jitter) for c in v) for v in p]
    return points, faces


def separate_boxes(count):
    points, faces = [], []
    side = math.ceil(count ** (1 / 3))
    for n in range(count):
        low = (2 * (n % side), 2 * (n // side % side), 2 * (n // side // side))
        p, f = box(low, tuple(c + 1 for c in low))
        faces += [tuple(len(points) + v for v in t) for t in f]
        points += p
    return points, faces


def cylinder(sides, fan=True, height=2):
    """A disc: caps as fans about two points, or as polygons of all corners."""
    ring = [(20 * math.cos(2 * math.pi * k / sides), 20 * math.sin(2 * math.pi * k / sides)) for k in range(sides)]
    points = [(x, y, 0.0) for x, y in ring] + [(x, y, float(height)) for x, y in ring]
    faces = [(k, (k + 1) % sides, sides + (k + 1) % sides, sides + k) for k in range(sides)]
    if fan:
        points += [(0.0, 0.0, 0.0), (0.0, 0.0, float(height))]
        faces += [(2 * sides, (k + 1) % sides, k) for k in range(sides)]
        faces += [(2 * sides + 1, sides + k, sides + (k + 1) % sides) for k in range(sides)]
    else:
        faces += [tuple(range(sides - 1, -1, -1)), tuple(range(sides, 2 * sides))]
    return points, faces


# ------------------------------------------------------------------------------------------------------------------ encodings


def stl(mesh, header=b"x", count=None):
    points, faces = mesh
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *points[a], *points[b], *points[c], 0) for a, b, c in faces)
    return header.ljust(80) + struct.pack("<I", len(faces) if count is None else count) + body


def ascii_stl(mesh):
    points, faces = mesh
    lines = ["solid x"]
    for f in faces:
        lines += ["facet normal 0 0 0", "outer loop"] + ["vertex %r %r %r" % points[v] for v in f] + ["endloop", "endfacet"]
    return ("\n".join(lines) + "\nendsolid x\n").encode()


def obj(mesh):
    points, faces = mesh
    return "".join(["v %r %r %r\n" % p for p in points] + ["f %s\n" % " ".join(str(v + 1) for v in f) for f in faces]).encode()


def off(mesh):
    points, faces = mesh
    return ("OFF\n%d %d 0\n" % (len(points), len(faces)) + "".join("%r %r %r\n" % p for p in points) +
            "".join("%d %s\n" % (len(f), " ".join(map(str, f))) for f in faces)).encode()


def ply_header(points, faces, kind="binary_little_endian", more=""):
    return ("ply\nformat %s 1.0\n%selement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            "element face %d\nproperty list int int vertex_indices\nend_header\n" % (kind, more, points, faces)).encode()


def ply(mesh, order="<"):
    points, faces = mesh
    head = ply_header(len(points), len(faces), "binary_little_endian" if order == "<" else "binary_big_endian")
    return head + b"".join(struct.pack(order + "3f", *p) for p in points) + b"".join(
        struct.pack("%s%di" % (order, len(f) + 1), len(f), *f) for f in faces)


def ascii_ply(mesh):
    points, faces = mesh
    return ply_header(len(points), len(faces), "ascii") + ("".join("%r %r %r\n" % p for p in points) +
                                                           "".join("%d %s\n" % (len(f), " ".join(map(str, f))) for f in faces)).encode()


def model(resources, build, head=""):
    return ('<?xml version="1.0"?>%s<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
            "<resources>%s</resources><build>%s</build></model>" % (head, resources, build))


def mesh_object(number, mesh):
    points, faces = mesh
    return ('<object id="%s" type="model"><mesh><vertices>%s</vertices><triangles>%s</triangles></mesh></object>' %
            (number, "".join('<vertex x="%r" y="%r" z="%r"/>' % p for p in points),
             "".join('<triangle v1="%d" v2="%d" v3="%d"/>' % f for f in faces)))


def package(text, name="3D/3dmodel.model", relations=True):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as z:
        if relations:
            z.writestr("_rels/.rels", '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/'
                       'relationships"><Relationship Target="/3D/3dmodel.model" Id="r" Type="http://schemas.microsoft.com/'
                       '3dmanufacturing/2013/01/3dmodel"/></Relationships>')
        z.writestr(name, text)
    return out.getvalue()


def three_mf(mesh):
    return package(model(mesh_object(1, mesh), '<item objectid="1"/>'))


def many_objects(count):
    """Small objects, each placed by a component of one object."""
    objects = "".join(mesh_object(n + 1, box((0, 0, 0), (1, 1, 1))) for n in range(count))
    parts = "".join('<component objectid="%d" transform="1 0 0 0 1 0 0 0 1 %d 0 0"/>' % (n + 1, 2 * n) for n in range(count))
    return package(model(objects + '<object id="%d"><components>%s</components></object>' % (count + 1, parts),
                         '<item objectid="%d"/>' % (count + 1)))


ENCODINGS = {"stl": stl, "ascii.stl": ascii_stl, "obj": obj, "off": off, "ply": ply, "big.ply": lambda m: ply(m, ">"),
             "ascii.ply": ascii_ply, "3mf": three_mf}


# -------------------------------------------------------------------------------------------------------------------- hostile


def scaled(mesh, factor):
    return [tuple(factor * c for c in p) for p in mesh[0]], mesh[1]


def with_first(mesh, value):
    points = list(mesh[0])
    points[0] = (value, 0.0, 0.0)
    return points, mesh[1]


def hostile(megabytes):
    """Names and contents that must be refused; of bombs so many megabytes."""
    b = box()
    nan, inf = float("nan"), float("inf")
    whole = stl(b)
    files = {
        "empty.stl": b"", "one.stl": b"x", "short.stl": whole[:83], "none.stl": stl(([], [])), "cut.stl": whole[:300],
        "lies.stl": stl(b, count=2**32 - 1), "nan.stl": stl(with_first(b, nan)), "inf.stl": stl(with_first(b, inf)),
        "words.stl": b"solid x\nfacet normal 0 0 0\nouter loop\nvertex a b c\n",
        "half.stl": ascii_stl(b)[:700], "digits.stl": ascii_stl(b).replace(b"40.0", b"4" * 400),
        "line.stl": b"solid " + b"x" * 3000000, "noise.stl": random.Random(1).randbytes(5000), "zeros.stl": bytes(100000),
        "flat.stl": stl(([(float(x), float(y), 0.0) for x, y, _ in b[0]], b[1])),
        "open.stl": stl((b[0], b[1][:-1])),
        "zero.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "beyond.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
        "before.obj": b"v 0 0 0\nf -1 -2 -3\n", "long.obj": b"v 0 0 0\nf 1 2 99999999999999999999\n", "two.obj": b"v 0 0 0\nv 1 0 0\nf 1 2\n",
        "nan.obj": obj(b).replace(b"40.0", b"nan"), "inf.obj": obj(b).replace(b"40.0", b"1e999"), "nul.obj": obj(b).replace(b"v 0", b"v \0"),
        "escape.obj": b"v 0 0 \x1b[31m\n", "dots.obj": obj(b).replace(b"40.0", b"4.0.0"),
        "tiny.obj": obj(scaled(b, 1e-300)), "small.obj": obj(scaled(b, 1e-20)), "big.obj": obj(scaled(b, 1e12)), "bigger.obj": obj(scaled(b, 1e40)),
        "huge.obj": obj(scaled(b, 1e160)), "most.obj": obj(scaled(b, 1e306)), "far.obj": obj(([(x + 1e15, y, z) for x, y, z in b[0]], b[1])),
        "counts.off": b"OFF\n99999999 99999999 0\n", "minus.off": b"OFF\n-1 -1 0\n", "none.off": b"OFF\n", "cut.off": off(b)[:120],
        "corner.off": off(b).replace(b"3 0 2 3", b"3 0 2 88"),
        "head.ply": b"ply\nformat ascii 1.0\nelement vertex 3\n", "counts.ply": ply_header(2**31, 2**31), "minus.ply": ply_header(-1, -1),
        "format.ply": ply(b).replace(b"binary_little_endian", b"binary_middle_endian"), "cut.ply": ply(b)[:260],
        "list.ply": ply_header(8, 1) + bytes(96) + struct.pack("<i", 2**31 - 1), "listminus.ply": ply_header(8, 1) + bytes(96) + struct.pack("<i", -5),
        "elements.ply": ply_header(8, 12, more="".join("element e%d 1000000000000\n" % n for n in range(20000))),
        "properties.ply": ply_header(8, 12, more="element e 999999999\n" + "".join("property float p%d\n" % n for n in range(20000))),
        "empty.ply": ply_header(8, 12, more="element e 1000000000000000\n"), "nan.ply": ply(with_first(b, nan)),
        "text.3mf": b"this is no archive", "cut.3mf": three_mf(b)[:400], "nothing.3mf": package("", "other.txt", False),
        "noxml.3mf": package("<model><"), "deep.3mf": package("<a>" * 100000), "closed.3mf": package(model("", "")),
        "laughs.3mf": package(model("&z;", "", '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">' + "".join(
            '<!ENTITY %s "%s">' % (chr(98 + n), ("&%s;" % chr(97 + n)) * 10) for n in range(25)) + "]>")),
        "cycle.3mf": package(model('<object id="1"><components><component objectid="1"/></components></object>', '<item objectid="1"/>')),
        "missing.3mf": package(model(mesh_object(1, b), '<item objectid="7"/>')),
        "doubling.3mf": package(model(mesh_object(1, b) + "".join(
            '<object id="%d"><components>%s</components></object>' % (n + 2, '<component objectid="%d"/>' % (n + 1) * 2) for n in range(40)),
            '<item objectid="41"/>')),
        "corner.3mf": package(model(mesh_object(1, b).replace('v1="0"', 'v1="99"', 1), '<item objectid="1"/>')),
        "transform.3mf": package(model(mesh_object(1, b), '<item objectid="1" transform="nan 0 0 0 1 0 0 0 1 0 0 0"/>')),
        "bomb.3mf": package(" " * (megabytes * 1000000)), "bombs.3mf": package(model(mesh_object(1, b), "<x/>" * (megabytes * 250000))),
    }
    return files


def mutated(data, draw):
    """A few bytes changed, taken out or put in, or the rest cut off."""
    data = bytearray(data)
    for _ in range(draw.choice([1, 1, 2, 5, 20])):
        if not data:
            break
        at = draw.randrange(len(data))
        kind = draw.randrange(5)
        if kind == 0:
            data[at] ^= 1 << draw.randrange(8)
        elif kind == 1:
            data[at] = draw.randrange(256)
        elif kind == 2:
            del data[at:at + draw.choice([1, 4, 50])]
        elif kind == 3:
            data[at:at] = draw.choice([b"9" * 30, b"-1", b"\xff\xff\xff\x7f", b"nan", b"1e999", bytes(8), b"\n", b'"', b"<"])
        elif draw.random() < 0.2:
            del data[at:]
    return bytes(data)
