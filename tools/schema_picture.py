#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws docs/repository/schema.svg from forest/repository/schema.h: its SQL is run in SQLite, which is then asked for the
tables. schema_picture.py [--check]: with --check nothing is written, and a picture that is not the one it would draw is
an error."""
import pathlib
import re
import sqlite3
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs/repository/schema.svg"

# Where the tables stand: columns from left to right, of groups from top to bottom.
PLACES = [
    ["grammars", "models", "model_distributions", "distributions"],
    ["populations", "neurons", "provenance"],
    ["somata", "arbors", "points", "neuron_metrics", "metrics"],
    ["sections", "spines", "annotations", "section_kinds"],
]
# Numbers that name a row without being declared as foreign keys.
IMPLIED = [("sections", "id", "neurons"), ("sections", "kind", "section_kinds"), ("arbors", "kind", "section_kinds"),
           ("neuron_metrics", "neuron", "neurons"), ("neuron_metrics", "metric", "metrics")]
COLOURS = {"neurons": "#0072B2", "grammars": "#009E73", "populations": "#D55E00", "metrics": "#CC79A7",
           "models": "#7A6A00", "distributions": "#B8860B", "section_kinds": "#777777"}  # of the lines to a table, in the order of their ways

WIDTH, ROW, HEAD, GAP, GUTTER, MARGIN, TOP = 196, 17, 25, 22, 58, 34, 74
WORDS = {"@id": "integer primary key", "@long_id": "bigint primary key", "@bytes": "bytes", "@by_key": "without rowid"}
TYPES = {"double precision": "real"}


def database():
    """The schema as SQLite understands it."""
    header = (ROOT / "forest/repository/schema.h").read_text(encoding="utf-8")
    db = sqlite3.connect(":memory:")
    for script in re.findall(r'R"sql\((.*?)\)sql"', header, re.S):
        script = re.sub(r"^@on_a_server .*?;\n", "", script, flags=re.M)
        for word, ours in sorted(WORDS.items(), key=lambda pair: -len(pair[0])):
            script = script.replace(word, ours)
        db.executescript(script)
    db.execute("drop table old_sections")  # as the program does
    return db


def names(db, kind):
    return [name for name, in db.execute("select name from sqlite_master where type = ? order by rowid", (kind,))]


def escape(text):
    return text.replace("&", "&amp;").replace("<", "&lt;")


class Picture:
    def __init__(self, db):
        self.db, self.lines, self.boxes, self.lanes, self.bottom = db, [], {}, {}, 0
        tables = names(db, "table")
        placed = [table for column in PLACES for table in column]
        if sorted(tables) != sorted(placed):
            sys.exit(f"schema_picture.py: give a place in PLACES to: {sorted(set(tables) ^ set(placed))}")
        self.columns = {t: db.execute(f"pragma table_info({t})").fetchall() for t in tables}
        heights = [sum(self.height(t) for t in column) for column in PLACES]
        tallest = max(h + GAP * (len(c) - 1) for h, c in zip(heights, PLACES))
        for i, column in enumerate(PLACES):  # every second ends half a row higher, so that no lines fall together
            gap = (tallest - ROW // 2 * (i % 2) - heights[i]) / max(1, len(column) - 1)
            y = TOP
            for table in column:
                self.boxes[table] = (i, MARGIN + i * (WIDTH + GUTTER), round(y))
                y += self.height(table) + gap
        self.width = 2 * MARGIN + len(PLACES) * WIDTH + (len(PLACES) - 1) * GUTTER
        self.bottom = TOP + tallest

    def height(self, table):
        return HEAD + ROW * len(self.columns[table]) + 6

    def row(self, table, column):
        """The height at which a line meets a column."""
        at = [c[1] for c in self.columns[table]].index(column)
        return self.boxes[table][2] + HEAD + ROW * at + ROW / 2 + 2

    def lane(self, gutter, target):
        """Lines to one table share one way through a gutter, or above the tables (gutter -1)."""
        lanes = self.lanes.setdefault(gutter, [])
        if target not in lanes:
            lanes.append(target)
        at = lanes.index(target)
        if gutter == -1:
            return TOP - 12 - 7 * at
        left = MARGIN + gutter * (WIDTH + GUTTER) - GUTTER
        return MARGIN - 12 - 8 * at if gutter == 0 else left + 16 + 9 * at

    def links(self):
        keys = []
        for table in self.columns:
            for _, _, target, column, *_ in self.db.execute(f"pragma foreign_key_list({table})"):
                keys.append((table, column, target, False))
        keys += [(*link, True) for link in IMPLIED]
        column_of = {t: box[0] for t, box in self.boxes.items()}
        order = list(COLOURS)
        for table, column, target, implied in sorted(keys, key=lambda k: (order.index(k[2]), k)):
            sources = [column_of[k[0]] for k in keys if k[2] == target]
            home = column_of[target]
            to_right = max(sources) > home
            gutter = home + 1 if to_right else home  # gutter i lies to the left of column i
            end = (self.boxes[target][1] + (WIDTH if to_right else 0), self.row(target, "id"))
            lane = self.lane(gutter, target)
            own = column_of[table]
            x, y = self.boxes[table][1], self.row(table, column)
            if gutter in (own, own + 1):
                path = f"M{x + (WIDTH if gutter == own + 1 else 0)} {y}H{lane}"
            else:  # out to the left, over the tables, down again
                over, near = self.lane(-1, target), self.lane(own, target)
                path = f"M{x} {y}H{near}V{over}H{lane}"
            path += f"V{end[1]}H{end[0] + (6 if to_right else -6)}"
            dashed = ' stroke-dasharray="4 3"' if implied else ""
            self.lines.append(f'<path d="{path}" fill="none" stroke="{COLOURS[target]}" stroke-width="1.4"{dashed}/>')
            tip = -1 if to_right else 1
            self.lines.append(f'<path d="M{end[0]} {end[1]}l{-8 * tip} -4v8z" fill="{COLOURS[target]}"/>')

    def text(self, x, y, text, more=""):
        self.lines.append(f'<text x="{x}" y="{y}"{" " if more else ""}{more}>{escape(text)}</text>')

    def box(self, x, y, height, title, width=WIDTH):
        self.lines.append(f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="5" fill="#fff" stroke="#445"/>')
        self.lines.append(f'<path d="M{x} {y + HEAD - 3}v{8 - HEAD}q0-5 5-5h{width - 10}q5 0 5 5v{HEAD - 8}z" '
                          'fill="#E4EBF2" stroke="#445"/>')
        self.text(x + 9, y + 16, title, 'font-weight="bold"')

    def tables(self):
        for table, (_, x, y) in self.boxes.items():
            self.box(x, y, self.height(table), table)
            links = {k[3]: k[2] for k in self.db.execute(f"pragma foreign_key_list({table})")}
            for _, name, kind, not_null, _, key in self.columns[table]:
                at = self.row(table, name) + 4
                kind = TYPES.get(kind.lower(), kind.lower())
                colour = f' fill="{COLOURS[links[name]]}"' if name in links else ""
                self.text(x + 9, at, name, ('text-decoration="underline"' if key else "") + colour)
                self.text(x + WIDTH - 9, at, kind + ("" if not_null or key else " or null"),
                          'text-anchor="end" fill="#889" font-size="10"')

    def views(self):
        y = self.bottom + 44
        self.text(MARGIN, y - 12, "Views, for people", 'font-size="14" font-weight="bold"')
        width = self.width - 2 * MARGIN
        for view in names(self.db, "view"):
            rows, line = [], ""
            for column in [c[1] for c in self.db.execute(f"pragma table_info({view})")]:
                if len(line) + len(column) > 150:
                    rows.append(line)
                    line = ""
                line += ("   " if line else "") + column
            rows.append(line)
            height = ROW * len(rows) + 9
            for across, colour in ((width, "#fff"), (92, "#E4EBF2")):
                self.lines.append(f'<rect x="{MARGIN}" y="{y}" width="{across}" height="{height}" fill="{colour}" '
                                  'stroke="#445"/>')
            self.text(MARGIN + 9, y + 17, view, 'font-weight="bold"')
            for i, row in enumerate(rows):
                self.text(MARGIN + 104, y + 17 + ROW * i, row, 'xml:space="preserve"')
            y += height
        self.bottom = y

    def legend(self):
        self.text(MARGIN, 28, "The tables of a repository", 'font-size="16" font-weight="bold"')
        x = self.width - MARGIN
        self.text(x, 28, "underlined: primary key     line: foreign key     dashed: a number that names a row",
                  'text-anchor="end" fill="#556" xml:space="preserve"')

    def draw(self):
        self.legend()
        self.links()
        self.tables()
        self.views()
        height = round(self.bottom + MARGIN / 2)
        return "\n".join([
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {height}" '
            'font-family="DejaVu Sans, Verdana, sans-serif" font-size="11.5" fill="#223">',
            "<title>The tables and views of a repository</title>",
            f'<rect width="{self.width}" height="{height}" fill="#fff"/>', *self.lines, "</svg>", ""])


def main():
    picture = Picture(database()).draw()
    if sys.argv[1:] != ["--check"]:
        PICTURE.write_text(picture, encoding="utf-8")
    elif not PICTURE.exists() or PICTURE.read_text(encoding="utf-8") != picture:
        sys.exit("docs/repository/schema.svg is not the picture of forest/repository/schema.h; run tools/schema_picture.py")


if __name__ == "__main__":
    main()
