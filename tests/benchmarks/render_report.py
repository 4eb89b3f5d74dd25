#!/usr/bin/env python3
"""Makes the report of the renderers' benchmark: NAME.md and its plots.

render_report.py RESULTS_FOLDER REPORT_FOLDER [--quick] [--name NAME] [--machine TEXT] [--notes FILE]

Reads depth.jsonl, as render_depth writes it. With results of another machine, --machine names it,
--name (default: render) is the report's name, and --notes is Markdown to insert after the introduction.
"""

import argparse
import datetime
import sys
from pathlib import Path

import plot
from report import find, machine, names, picture, read, short, table

OURS = {"GL renderer", "rays robust (renderer)"}
MIN_ERROR = 1e-6  # mm, where an error of 0 is drawn
# About rows measured with Mesa on a busy machine.
WAITING = """
Wall-clock time beyond the CPU time is waiting for a busy core. `/proc/PID/task/*/schedstat` measured 12 s of frames
of the district once. Each of Mesa's two threads ran 3.0 s and waited 6.1 s, and the drawing
thread ran 2.5 s and waited 2.1 s. An idle machine needs no more than the CPU time.
"""


def millimetres(value):
    return "0" if value == 0 else f"{value:.2g}" if value < 1 else short(value)


def speed_table(rows, sizes):
    scenes = names(rows, "scene")
    head = ["ms a frame: wall (CPU)"]
    head += [f"{scene}, {size.replace('x', '×')}" for scene in scenes for size in sizes]
    body = []
    for method in names(rows):
        cells = []
        for scene in scenes:
            for size in sizes:
                row = find(rows, method=method, scene=scene, size=size)
                cells.append(f"{short(row['ms'])} ({short(row['cpu_ms'])})" if row else "–")
        body.append([method] + cells)
    return table(head, body)


def band_name(band):
    return f"{band['from_m']:g}–{band['to_m']:g} m" if "to_m" in band else f"> {band['from_m']:g} m"


def error_table(rows, scene, size):
    some = [row for row in rows if row["scene"] == scene and row["size"] == size]
    bands = some[0]["depth"]["bands"]
    used = [k for k, band in enumerate(bands) if band["pixels"] > 0]
    body = []
    for row in some:
        depth = row["depth"]
        all_of_it = depth["away_from_edges"]
        cells = [f"{millimetres(e['mean_mm'])} / {millimetres(e['max_mm'])}"
                 for e in [all_of_it] + [depth["bands"][k] for k in used]]
        body.append([row["method"]] + cells
                    + [millimetres(all_of_it["p99_mm"]),
                       f"{depth['missing']} / {depth['extra']}"])
    return table(["depth, mm: mean / most", "all"] + [band_name(bands[k]) for k in used]
                 + ["99 %", "pixels missing / too many"], body)


def ids_table(rows):
    body = []
    for row in rows:
        ids = row["ids"]
        differ = ids["differ_by_pixels_to_an_edge"]
        if ids["equal"] == 0:
            continue
        known = ids["equal"] + ids["tied"] + sum(differ)
        body.append([row["scene"], row["size"].replace("x", "×"), row["method"],
                     f"{100 * (known - sum(differ)) / known:.4f} %", ids["tied"], differ[0],
                     differ[1], sum(differ[2:])])
    return table(["scene", "size", "method", "ids right", "of these, tied", "wrong on an edge pixel",
                  "next to one", "elsewhere"], body)


def speed_error(rows, out, scene, size, report):
    points = []
    for row in rows:
        if row["scene"] != scene or row["size"] != size:
            continue
        max_error = row["depth"]["away_from_edges"]["max_mm"]
        points.append((row["method"], max(MIN_ERROR, max_error), row["ms"], ""))
    name = f"{report}_{scene.replace(' ', '_')}"
    title = f"Speed against error of depth: {scene}, {size.replace('x', '×')}"
    plot.marks(out / f"{name}.svg", title, "maximum error away from edges, mm",
               "ms a frame (median)", points, OURS)
    return picture(out, name, title)


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path)
    parser.add_argument("report", type=Path)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--name", default="render")
    parser.add_argument("--machine", default=machine().split(", ours")[0])
    parser.add_argument("--notes", type=Path)
    return parser.parse_args()


def main():
    arguments = parse_arguments()
    out, quick = arguments.report, arguments.quick
    out.mkdir(parents=True, exist_ok=True)
    rows = read(arguments.results, "depth")
    if not rows:
        sys.exit(f"{arguments.results}/depth.jsonl: nothing was measured")
    device = find(rows, method="GL renderer")["renderer"]
    sizes = names(rows, "size")
    about = table(["scene", "objects", "triangles"],
                  [[scene, f"{row['objects']:,}", f"{row['triangles']:,}"]
                   for scene in names(rows, "scene") for row in [find(rows, scene=scene)]])
    parts = [f"""\
# Renderers: speed against error

Made by `./dev bench render{' --quick' if quick else ''}` on {datetime.date.today()}. Machine: {arguments.machine},
OpenGL by {device}. {'**A quick run: few cameras, one size.** ' if quick else ''}The machine is
noisy (other load), so only ratios within a table are meaningful. Methods take turns at each camera,
and times are medians.

Depth and ids of the same seeded cameras, 1.6 m above a floor and under a roof, near 0.1 m, far 500 m.
They are without textures, masks and transparency. Every pixel is compared with a ray in doubles
(`render/reference/reference_tracer.hpp`). Edge pixels, listed separately, have a neighbour that shows another object
or leaves the pixel's plane by a thousandth of the depth. *GL D24 standard* to *D32F reversed* draw all
triangles at once into that depth buffer and read it back. *GL renderer* and *rays robust* are the renderers
of `enfilade`; rays use two threads.
{WAITING if "llvmpipe" in device else ""}
Each camera takes three images after an untimed one, so the GL renderer's visibility cache is warm;
`render_bench` measures walks.
""", arguments.notes.read_text() if arguments.notes else "", about, "## Speed\n", speed_table(rows, sizes),
             "## Error of depth\n"]
    for scene in names(rows, "scene"):
        parts += [f"### {scene}\n", error_table(rows, scene, sizes[-1]),
                  speed_error(rows, out, scene, sizes[-1], arguments.name)]
    parts += ["## Ids\n", """\
*Tied*: the drawn object is within 0.02 mm and a millionth of the depth of the nearest one.
""", ids_table(rows)]
    page = out / f"{arguments.name}.md"
    page.write_text("\n".join(part for part in parts if part))
    print(page)


if __name__ == "__main__":
    main()
