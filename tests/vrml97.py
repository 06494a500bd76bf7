# SPDX-License-Identifier: Apache-2.0
"""Checks VRML97 and X3D files against the grammar of their standards, for the nodes that models use:
python3 tests/vrml97.py FILE...

Sources: ISO/IEC 14772-1:1997, annex A (grammar) and clause 6 (fields of nodes); ISO/IEC 19775-1:2013, clauses 9, 11, 12, 13.
Knows nothing of what wrote the files.
"""
import re
import sys
import xml.etree.ElementTree as xml

# Node -> field -> type. A field of type SFNode names the nodes it may hold.
NODES = {
    "WorldInfo": {"title": "SFString", "info": "MFString"},
    "Shape": {"appearance": ["Appearance"], "geometry": ["IndexedFaceSet", "IndexedLineSet"]},
    "Appearance": {"material": ["Material"]},
    "Material": {"diffuseColor": "SFColor", "ambientIntensity": "SFFloat"},
    "IndexedLineSet": {"coord": ["Coordinate"], "color": ["Color"], "coordIndex": "MFInt32", "colorIndex": "MFInt32",
                       "colorPerVertex": "SFBool"},
    "IndexedFaceSet": {"coord": ["Coordinate"], "color": ["Color"], "coordIndex": "MFInt32", "colorIndex": "MFInt32",
                       "colorPerVertex": "SFBool", "creaseAngle": "SFFloat", "ccw": "SFBool", "solid": "SFBool"},
    "Coordinate": {"point": "MFVec3f"},
    "Color": {"color": "MFColor"},
}
TOKEN = re.compile(r'(?P<skip>(?:[\s,]|#[^\n]*)+)|(?P<string>"(?:[^"\\]|\\.)*")|(?P<mark>[][{}])'
                   r'|(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?![\w.])|(?P<word>[A-Za-z_]\w*)', re.S)


def tokens(text):
    place, found = 0, []
    while place < len(text):
        match = TOKEN.match(text, place)
        assert match, f"no word of VRML97 at {text[place:place + 20]!r}"
        if match.lastgroup != "skip":
            found.append((match.lastgroup, match.group()))
        place = match.end()
    return iter(found + [("end", "")])


def numbers(words, kind):
    """The values of a field of `kind`, checked: how many there are, whole, within bounds."""
    size = 3 if "Vec3f" in kind or "Color" in kind else 1
    if "Int32" in kind:
        values = [int(w) for w in words]
        assert all(-2**31 <= v < 2**31 for v in values)
    else:
        values = [float(w) for w in words]
        assert all(abs(v) < 3.5e38 for v in values)
    if "Color" in kind:
        assert all(0 <= v <= 1 for v in values)
    assert len(values) % size == 0 and (kind[0] == "M" or len(values) == size)
    return values if kind[0] == "M" else values[0]


def node(name, words):
    fields = {"node": name}
    assert next(words) == ("mark", "{")
    for kind, field in words:
        if field == "}":
            return fields
        kind = NODES[name][field]
        assert field not in fields, f"{field} twice in {name}"
        if isinstance(kind, list):
            child = next(words)[1]
            assert child in kind, f"{child} is no {field} of {name}"
            fields[field] = node(child, words)
        elif kind == "SFString":
            sort, fields[field] = next(words)
            assert sort == "string"
        elif kind == "SFBool":
            fields[field] = {"TRUE": True, "FALSE": False}[next(words)[1]]
        elif kind[0] == "S":
            fields[field] = numbers([next(words)[1]], kind)
        else:
            assert next(words) == ("mark", "[")
            values = []
            for sort, word in words:
                if word == "]":
                    break
                assert sort == "number", f"{word!r} in {field}"
                values.append(word)
            fields[field] = numbers(values, kind)
    raise AssertionError(f"{name} is not closed")


def vrml(text):
    assert text.startswith("#VRML V2.0 utf8\n")
    words, scene = tokens(text), []
    for sort, word in words:
        if sort == "end":
            break
        scene.append(node(word, words))
    assert next(words, None) is None
    return scene


def x3d(text):
    root = xml.fromstring(text)
    assert root.tag == "X3D" and root.get("version") == "3.3" and [e.tag for e in root] == ["head", "Scene"]
    order = [e.tag for e in root[0]]
    assert order == sorted(order, key=["component", "unit", "meta"].index), "the head's order"

    def read(element):
        fields = {"node": element.tag}
        for field, value in element.items():
            kind = NODES[element.tag][field]
            words = value.replace(",", " ").split()
            fields[field] = {"true": True, "false": False}[value] if kind == "SFBool" else numbers(words, kind)
        for child in element:
            field = next(f for f, kind in NODES[element.tag].items() if isinstance(kind, list) and child.tag in kind)
            assert field not in fields
            fields[field] = read(child)
        return fields

    return [read(shape) for shape in root[1]]


def check_shape(shape):
    """What the standards ask of indices beyond the grammar."""
    geometry = shape["geometry"]
    count = len(geometry["coord"]["point"]) // 3
    colours = len(geometry["color"]["color"]) // 3
    indices = geometry["coordIndex"]
    assert all(-1 <= i < count for i in indices) and (not indices or indices[-1] == -1)
    runs, run = [], 0
    for i in indices:
        run = run + 1 if i >= 0 else runs.append(run) or 0
    least = 3 if geometry["node"] == "IndexedFaceSet" else 2
    assert all(r >= least for r in runs), "a face or line of too few corners"
    assert geometry["colorPerVertex"] is False
    assert len(geometry["colorIndex"]) == len(runs) and all(0 <= c < colours for c in geometry["colorIndex"])
    return len(runs)


for path in sys.argv[1:]:
    with open(path, encoding="utf-8") as file:
        text = file.read()
    scene = x3d(text) if path.endswith(".x3d") else vrml(text)
    shapes = [s for s in scene if s["node"] == "Shape"]
    drawn = sum(check_shape(s) for s in shapes)
    assert drawn > 0, f"{path} draws nothing"
    print(f"{path}: {len(shapes)} shapes, {drawn} faces or lines")
