# SPDX-License-Identifier: Apache-2.0
# Balls as FreeSurfer writes surfaces, in mm: what tests build cortices of.
import math, struct


def ball(radius, halvings=4, dent=0.0):
    t = (1 + 5 ** .5) / 2
    p = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
         (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
         (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(halvings):
        middle, g = {}, []
        def half(a, b):
            key = (min(a, b), max(a, b))
            if key not in middle:
                middle[key] = len(p)
                p.append(tuple((x + y) / 2 for x, y in zip(p[a], p[b])))
            return middle[key]
        for a, b, c in f:
            x, y, z = half(a, b), half(b, c), half(c, a)
            g += [(a, x, z), (b, y, x), (c, z, y), (x, y, z)]
        f = g
    out = []
    for x, y, z in p:
        n = math.sqrt(x * x + y * y + z * z)
        r = (radius - dent * math.exp(-((x / n) ** 2) / .02)) / n
        out.append((x * r, y * r, z * r))
    return out, f


def areas(name, of_vertices, names):
    """FreeSurfer's file of areas: of each vertex the place of its area among the names."""
    with open(name, "wb") as o:
        o.write(struct.pack(">i", len(of_vertices)))
        for v, area in enumerate(of_vertices): o.write(struct.pack(">ii", v, area + 1))
        o.write(struct.pack(">iiii", 1, -2, len(names), 2) + b"t\0" + struct.pack(">i", len(names)))
        for i, text in enumerate(names):
            o.write(struct.pack(">ii", i, len(text) + 1) + text.encode() + b"\0" + struct.pack(">iiii", i + 1, 0, 0, 0))


def write(name, mesh):
    p, f = mesh
    with open(name, "wb") as o:
        o.write(b"\xff\xff\xfe" + b"made for a test\n\n" + struct.pack(">ii", len(p), len(f)))
        for q in p: o.write(struct.pack(">fff", *q))
        for q in f: o.write(struct.pack(">iii", *q))
