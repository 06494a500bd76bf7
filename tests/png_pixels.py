# SPDX-License-Identifier: Apache-2.0
"""The pixels of the pictures that tests draw, with nothing but Python's own library (PNG specification, third edition, 9)."""
import struct
import zlib


def pixels(path, channels=3):
    """Red, green and blue (and opacity) of every pixel, row by row, of a PNG with 8 bits a channel and no interlacing."""
    data, at, packed = open(path, "rb").read(), 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, _, colour = struct.unpack(">IIBB", data[at + 8:at + 18])
        if kind == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    raw, each = zlib.decompress(packed), {2: 3, 6: 4}[colour]
    stride, rows = width * each, []
    before = bytearray(stride)
    for y in range(height):
        line = raw[y * (stride + 1):(y + 1) * (stride + 1)]
        row = bytearray(line[1:])
        for i in range(stride):
            left, above, beyond = row[i - each] if i >= each else 0, before[i], before[i - each] if i >= each else 0
            guess = left + above - beyond
            paeth = min((abs(guess - left), 0, left), (abs(guess - above), 1, above), (abs(guess - beyond), 2, beyond))[2]
            row[i] = (row[i] + (0, left, above, (left + above) // 2, paeth)[line[0]]) & 255
        rows.append(row)
        before = row
    return [tuple(row[i:i + channels]) for row in rows for i in range(0, stride, each)]
