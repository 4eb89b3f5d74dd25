#!/usr/bin/env python3
"""Makes the report of the boxes of turning bodies: boxes.md.

boxes_report.py RESULTS_FOLDER REPORT_FOLDER [--quick]

Reads boxes.jsonl, as collision_boxes writes it.
"""

import datetime
import sys
from pathlib import Path

from report import find, machine, names, read, short, table

TIGHT = ("vertex scan", "hill climb", "recompute")


def settings(rows):
    return list(dict.fromkeys((row["vertices"], row["degrees"]) for row in rows))


def head_of(rows, words):
    return [words] + [f"{vertices} at {degrees:g}°" for vertices, degrees in settings(rows)]


def body_of(rows, cell):
    return [[method] + [cell(find(rows, method=method, vertices=vertices, degrees=degrees))
                        for vertices, degrees in settings(rows)]
            for method in names(rows)]


def time_cell(row):
    return f"**{short(row['ns'])}**" if row["chosen"] else short(row["ns"])


def volume_cell(rows):
    def cell(row):
        tight = find(rows, method=TIGHT[0], vertices=row["vertices"], degrees=row["degrees"])
        return short(row["volume"] / tight["volume"])
    return cell


def chosen_table(rows):
    body = []
    for vertices, degrees in settings(rows):
        some = [row for row in rows if (row["vertices"], row["degrees"]) == (vertices, degrees)]
        tight = [find(some, method=method) for method in TIGHT]
        chosen = next(row for row in some if row["chosen"])
        before = find(some, method="recompute")
        body.append([f"{vertices} at {degrees:g}°", chosen["method"],
                     short(chosen["ns"] / min(row["ns"] for row in tight)),
                     short(before["ns"] / chosen["ns"])])
    return table(["vertices, turn a tick", "chosen", "time / cheapest tight box, recompute included",
                  "times faster than recompute"], body)


def wrong_table(rows):
    return table(["", "boxes checked by rationals", "not conservative"],
                 [[method, sum(row["checked"] for row in rows if row["method"] == method),
                   sum(row["not_conservative"] for row in rows if row["method"] == method)]
                  for method in names(rows)])


def main():
    results, out = Path(sys.argv[1]), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    rows = read(results, "boxes")
    quick = "--quick" in sys.argv
    parts = [f"""\
# Boxes of turning bodies

Made by `./dev bench boxes{' --quick' if quick else ''}` on {datetime.date.today()}. Machine: {machine()},
single thread. 1,000 bodies (250 of 2,000 vertices, 50 of 10,000) turn about their own axes. All have the same hull,
an ellipsoid with half axes of 0.2, 0.15 and 0.1 m. The methods take turns in every tick, in
random order. Times are medians.

- *sphere cube*, *vertex scan* and *climb or scan* are the three methods of `collision/bounds/bounding_box.hpp`. The
  third climbs after a small turn and scans after a large one; *hill climb* always climbs. All but the cube give the
  same box to the last bit.
- The ratio of the chosen method leaves the *sphere cube* out. It is the cheapest everywhere, but its larger box causes
  false pairs, and each costs some 200 ns in the narrow phase.
- *recompute* is what the tick did before: every vertex by a matrix product.
- *Bullet* turns the box of the body's own frame. *FCL* takes the cube of the bounding sphere. A
  larger box causes more pairs.
""", "## Nanoseconds a box; bold: the method that the rule chooses\n",
             table(head_of(rows, "ns"), body_of(rows, time_cell)), chosen_table(rows),
             "## Vertices looked at a box\n",
             table(head_of(rows, "vertices"),
                   body_of([row for row in rows if row["looked"] > 0],
                           lambda row: short(row["looked"]) if row else "–")),
             "## Volume of the box, of the tight box's\n",
             table(head_of(rows, "volume"), body_of(rows, volume_cell(rows))),
             "## Boxes that do not contain the body\n", wrong_table(rows)]
    (out / "boxes.md").write_text("\n".join(parts))
    print(out / "boxes.md")


if __name__ == "__main__":
    main()
