#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A service like NeuroMorpho.Org on the loopback, with bad manners on request: cell_service.py CELLS PORT_FILE LOG [CERT KEY].

CELLS/*.swc are its cells; the port it was given is written to PORT_FILE when it is ready, and every request to LOG as a line
of JSON: time, path, Range, If-Range, If-None-Match, User-Agent. What it does with a cell is said by the cell's name, before
its first "-": TRICKS below.
"""
import hashlib
import http.server
import json
import pathlib
import socket
import ssl
import sys
import time
import urllib.parse

CELLS, PORT_FILE, LOG = (pathlib.Path(path) for path in sys.argv[1:4])
cells = {path.stem: path.read_bytes() for path in sorted(CELLS.glob("*.swc"))}
asked = {}  # how often each path
SLOW = 16384  # bytes a tenth of a second


def record(name, number):
    return {"neuron_id": number, "neuron_name": name, "archive": "Test Lab", "species": "rat",
            "brain_region": ["neocortex", "somatosensory", "layer 5"], "cell_type": ["thick-tufted", "pyramidal"],
            "reference_doi": ["10.1000/xyz"], "license": "CC BY 4.0", "note": None,
            "_links": {"self": {"href": f"http://elsewhere.invalid/{number}"}}}


class Service(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def answer(self, status, body=b"", kind="text/plain", length=None, **headers):
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), str(value))
        self.end_headers()
        self.wfile.write(body)

    def cut(self):
        self.wfile.flush()
        self.close_connection = True
        self.connection.shutdown(socket.SHUT_RDWR)

    def page(self, parts):
        query = urllib.parse.parse_qs(parts.query)
        number, size = int(query["page"][0]), int(query["size"][0])
        wanted = query["q"][0].split(":")[1]
        if wanted == "endless":  # for ever the same, of a million
            found, pages = [record("plain-0", 1)] * size, 10**6
        elif wanted == "new":  # for ever new ones
            found, pages = [record(f"plain-{number}-{i}", i) for i in range(size)], 10**6
        elif wanted == "empty":
            found, pages = [], 10**6
        elif wanted == "hostile":
            names = ["../../escaped", "..%2f..%2fescaped", "", "plain-1"]
            found, pages = [record(name, i) | {"species": "\33[2Jrat"} for i, name in enumerate(names)], 1
        elif wanted == "broken" and number > 0:
            return self.answer(200, b'{"_embedded":{"neur', "application/json")
        else:
            names = [name for name in cells if name.startswith("plain")]
            found = [record(name, i) for i, name in enumerate(names)][number * size:(number + 1) * size]
            pages = 9 if wanted == "broken" else -(-len(names) // size)
        body = {"page": {"size": size, "totalElements": 131, "totalPages": pages, "number": number}}
        if found:
            body["_embedded"] = {"neuronResources": found}
        self.answer(200, json.dumps(body).encode(), "application/hal+json")

    def cell(self, name):
        body, trick, times = cells[name], name.split("-")[0], asked[self.path]
        tag = f'"{hashlib.md5(body).hexdigest()}"'
        if self.headers["If-None-Match"] == tag:
            return self.answer(304, ETag=tag)
        begin, status, more = 0, 200, {}
        wanted = self.headers["Range"]
        if wanted and self.headers["If-Range"] == tag:
            begin, status = int(wanted.removeprefix("bytes=").rstrip("-")), 206
            if begin >= len(body):
                return self.answer(416, Content_Range=f"bytes */{len(body)}")
            more["Content_Range"] = f"bytes {begin}-{len(body) - 1}/{len(body)}"
        part = body[begin:]
        if trick == "busy" and times == 1:
            return self.answer(429, b"slower, please", Retry_After=1)
        if trick == "ill" and times < 3:
            return self.answer(503)
        if trick == "away":
            return self.answer(503, Retry_After=86400)
        if trick == "gone":
            return self.answer(404, b"<html>no such cell</html>", "text/html")
        if trick == "page":
            return self.answer(200, b"<!DOCTYPE html><html>please log in</html>", "text/html")
        if trick == "nonsense":
            return self.answer(200, b"these are no rows\n")
        if trick == "file":
            return self.answer(302, Location="file:///etc/passwd")
        if trick == "circle":
            return self.answer(302, Location=self.path)
        if trick == "moved" and "moved=1" not in self.path:
            return self.answer(301, Location=self.path + "?moved=1")
        if trick == "short":  # announces more than it has
            self.answer(200, body, length=len(body) + 1000)
            return self.cut()
        if trick == "huge":
            return self.answer(200, b"1", length=10**12)
        if trick == "flood":  # says nothing of its length
            self.send_response(200)
            self.end_headers()
            self.close_connection = True
            try:
                while True:
                    self.wfile.write(b"# " + b"x" * 65534)
            except OSError:
                return None
        if trick == "silent":
            time.sleep(20)
            return self.cut()
        if trick == "wrong" and status == 206:  # another part than the one asked for
            more["Content_Range"] = f"bytes 0-{len(body) - 1}/{len(body)}"
        if trick in ("cut", "wrong", "changed") and times == 1:
            self.answer(200, body[:len(body) // 2], length=len(body), ETag=tag if trick != "changed" else '"old"')
            return self.cut()
        if trick == "weak":
            tag = "W/" + tag
            if times == 1:
                self.answer(200, body[:len(body) // 2], length=len(body), ETag=tag)
                return self.cut()
        if trick == "slow":
            self.answer(status, b"", length=len(part), ETag=tag, **more)
            for at in range(0, len(part), SLOW):
                self.wfile.write(part[at:at + SLOW])
                self.wfile.flush()
                time.sleep(.1)
            return None
        return self.answer(status, part, ETag=tag, **more)

    def do_GET(self):
        asked[self.path] = asked.get(self.path, 0) + 1
        with LOG.open("a") as log:
            heard = {name: self.headers[name] for name in ("Range", "If-Range", "If-None-Match", "User-Agent")}
            log.write(json.dumps({"time": time.monotonic(), "path": self.path, **heard}) + "\n")
        parts = urllib.parse.urlsplit(self.path)
        pieces = [urllib.parse.unquote(piece) for piece in parts.path.split("/")[1:]]
        names = list(cells)
        try:
            if pieces[:3] == ["api", "neuron", "select"]:
                self.page(parts)
            elif pieces[:3] == ["api", "neuron", "name"] and pieces[3] in cells:
                name = "other" if pieces[3].startswith("liar") else pieces[3]
                self.answer(200, json.dumps(record(name, names.index(pieces[3]) + 1)).encode(), "application/json")
            elif pieces[:3] == ["api", "neuron", "id"] and 0 < int(pieces[3]) <= len(names):
                self.answer(200, json.dumps(record(names[int(pieces[3]) - 1], int(pieces[3]))).encode(), "application/json")
            elif pieces[:3] == ["dableFiles", "test lab", "CNG version"] and pieces[3].removesuffix(".CNG.swc") in cells:
                self.cell(pieces[3].removesuffix(".CNG.swc"))
            else:
                self.answer(404, b"<html>not here</html>", "text/html")
        except OSError:  # the program on the other side is gone
            self.close_connection = True


class Server(http.server.ThreadingHTTPServer):
    def handle_error(self, *_):  # a client that hangs up is expected
        pass


server = Server(("127.0.0.1", 0), Service)
if len(sys.argv) > 4:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*sys.argv[4:6])
    server.socket = context.wrap_socket(server.socket, server_side=True)
PORT_FILE.with_suffix(".new").write_text(str(server.server_address[1]))
PORT_FILE.with_suffix(".new").rename(PORT_FILE)
server.serve_forever()
