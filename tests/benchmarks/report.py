#!/usr/bin/env python3
"""Makes the report of the collision benchmarks: collision.md and its plots.

report.py RESULTS_FOLDER REPORT_FOLDER [--quick]

Reads broad.jsonl, moving.jsonl, narrow.jsonl, mesh.jsonl, time.jsonl and icollide.jsonl, as the programs write them.
"""

import datetime
import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import plot

MIN_ERROR = 1e-17  # where an error of 0 is drawn


def read(folder, name):
    path = folder / f"{name}.jsonl"
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines() if line]


def names(rows, key="method"):
    """The distinct values in the order of their first appearance."""
    return list(dict.fromkeys(row[key] for row in rows))


def find(rows, **wanted):
    for row in rows:
        if all(row.get(key) == value for key, value in wanted.items()):
            return row
    return None


def short(value):
    if value is None:
        return "–"
    if value == 0:
        return "0"
    if value < 0.001 or value >= 1e7:
        return f"{value:.1e}"
    if value < 10:
        return f"{value:.3g}"
    if value < 100:
        return f"{value:.1f}"
    return f"{value:.0f}"


def error(values, which=2):
    """`values`: median, 99 %, greatest."""
    if not values or values[which] is None:
        return "–"
    return "0" if values[which] == 0 else f"{values[which]:.0e}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def machine():
    compiler = subprocess.run(["c++", "--version"], capture_output=True, text=True, check=False)
    model = "unknown processor"
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    first = compiler.stdout.splitlines()[0] if compiler.stdout else "unknown compiler"
    return f"{os.cpu_count()} cores ({model}, {platform.machine()}), {first}. Ours at -O3, the peers as Debian built them"


def picture(out, name, words):
    return f"![{words}]({name}.svg)\n" if (out / f"{name}.svg").exists() else ""


# ---- broad phase ---------------------------------------------------------------------------------

def time_cell(row, unit):
    if row is None:
        return "–"
    if "left_out" in row:
        return "left out"
    cell = f"{short(row[f'median_{unit}'])} ({short(row[f'p99_{unit}'])})"
    return cell if row["wrong"] == 0 else f"{cell} **{row['wrong']} wrong**"


def ahead(rows, unit, **cell):
    """The best peer's median divided by ours."""
    median = f"median_{unit}"
    ours = find(rows, kind="ours", **cell)
    peers = [row[median] for row in rows if row["kind"] == "peer" and median in row
             and all(row.get(key) == value for key, value in cell.items())]
    return f"**{min(peers) / ours[median]:.1f}×**" if ours and peers else "–"


def broad_table(rows, dynamic, sizes):
    body = []
    for method in names(rows):
        cells = [time_cell(find(rows, method=method, dynamic_boxes=dynamic, objects=n), "us") for n in sizes]
        body.append([method] + cells)
    body.append(["best peer : ours"] + [ahead(rows, "us", objects=n, dynamic_boxes=dynamic) for n in sizes])
    return table(["µs a tick, median (99 %)"] + [f"{n:,} objects" for n in sizes], body)


def build_table(rows, sizes):
    body = []
    for method in names(rows):
        cells = []
        for n in sizes:
            row = find(rows, method=method, dynamic_boxes=100, objects=n)
            known = row and "build_s" in row
            cells.append(f"{short(row['build_s'])} s, {row['bytes']:.0f} B" if known else "–")
        ticks = [row for row in rows if row["method"] == method and "ticks" in row]
        wrong = f"{sum(r['wrong'] for r in ticks)} of {sum(r['ticks'] for r in ticks)}"
        body.append([method] + cells + [wrong])
    return table(["build, bytes a static object"] + [f"{n:,}" for n in sizes] + ["wrong ticks"], body)


def broad(rows, out):
    if not rows:
        return ""
    sizes = sorted(set(row["objects"] for row in rows))
    ours = {row["method"] for row in rows if row["kind"] == "ours"}
    parts = ["## Broad phase\n", """\
A building of storeys and rooms with 68 static objects per room of 30 m², in shuffled order. 80 % of the
dynamic boxes belong to avatars at 1.5 m/s, the others rotate; 60 ticks a second. A tick is timed from the
new boxes to all reported pairs. Every tick, each method's set of pairs was compared with a reference
(number, and sum of mixed ids). Methods run in turns of some dozens of ticks; the first tick of a turn has cold caches and
is not timed. A method stops when its time for a size is used up.
"""]
    for dynamic in sorted(set(row["dynamic_boxes"] for row in rows)):
        series = {}
        for method in names(rows):
            series[method] = [(n, row["median_us"]) for n in sizes
                              if (row := find(rows, method=method, dynamic_boxes=dynamic, objects=n))
                              and "median_us" in row]
        plot.lines(out / f"broad_{dynamic}.svg", f"Broad phase, {dynamic} dynamic boxes", "static objects",
                   "µs a tick (median)", series, ours)
        parts += [f"### {dynamic} dynamic boxes\n", broad_table(rows, dynamic, sizes),
                  picture(out, f"broad_{dynamic}", f"Cost of a tick by static objects, {dynamic} dynamic boxes")]
    parts += ["### Building, memory, and ticks with a wrong set of pairs\n", build_table(rows, sizes),
              "Bytes are what malloc handed out (Embree: its own count), without the given boxes.\n"]
    reasons = {row["method"]: row["left_out"] for row in rows if "left_out" in row}
    if reasons:
        parts.append("Left out at the larger sizes:\n\n"
                     + "".join(f"- {name}: {why}\n" for name, why in reasons.items()))
    return "\n".join(parts)


# ---- all moving -----------------------------------------------------------------------------------

def moving_table(rows, motion, sizes):
    of = [row for row in rows if row["motion"] == motion]
    body = [[method] + [time_cell(find(of, method=method, cubes=n), "ms") for n in sizes]
            for method in names(of)]
    best = [ahead(of, "ms", cubes=n) for n in sizes]
    pairs = [f"{find(of, kind='ours', cubes=n)['pairs']:,.0f}" for n in sizes]
    return table([f"{motion}: ms a frame, median (99 %)"] + [f"{n:,} cubes" for n in sizes],
                 body + [["best peer : ours"] + best, ["pairs in the last frame"] + pairs])


def all_moving(rows):
    if not rows:
        return ""
    regions = next((row for row in rows if row["bench"] == "regions"), None)
    rows = [row for row in rows if row["bench"] == "moving"]
    sizes = sorted(set(row["cubes"] for row in rows))
    frames = [row for row in rows if "ticks" in row]
    wrong = f"{sum(r['wrong'] for r in frames)} of {sum(r['ticks'] for r in frames)}"
    parts = ["## Broad phase, all moving\n", """\
Equal cubes that all move and pass through each other, in frames of 1/30 s. Brownian: a tenth of the volume
is filled, and each cube makes a random step of up to a fifth of its edge. Falling: a tower of cubes falls
onto a floor and bounces. Turbulent: a dense heap swirls about its centre. One thread. A frame is timed and
checked as above; the first one, which inserts all cubes, is not part of the median. Bullet's axis sweep takes
minutes to insert 64,000 cubes and is left out there.
"""]
    for motion in dict.fromkeys(row["motion"] for row in rows):
        parts.append(moving_table(rows, motion, sizes))
    first = [f"{n:,} cubes: {short(max(r['first_ms'] for r in rows if r['kind'] == 'ours' and r['cubes'] == n))} ms"
             for n in sizes]
    parts.append(f"Wrong frames, all methods: {wrong}. First insertion by ours, slowest motion: {'; '.join(first)}.\n")
    if regions:
        parts.append(f"""\
A heap does not slow the walkers elsewhere in the same sweep. {regions['cubes']:,} turbulent cubes take
{short(regions['heap_ms'])} ms a frame and {regions['walkers']:,} walkers {short(regions['walkers_ms'])} ms, each in a sweep of
their own. Together in one sweep they take {short(regions['both_ms'])} ms.
""")
    return "\n".join(parts)


# ---- narrow phase --------------------------------------------------------------------------------

def level_name(row):
    return f"{row['method']} [{row['level']}]" if row["ours"] else row["method"]


def narrow_cell(row):
    if row is None or row["cold_ns"] is None:
        return "–"
    if not row["warms"]:
        return short(row["cold_ns"])
    return f"{short(row['cold_ns'])} / {short(row['warm_ns'])}"


def narrow_table(rows, gap, sizes):
    kind = "depth_error" if gap == "penetrating" else "distance_error"
    body = []
    for method in names(rows):
        some = [find(rows, method=method, gap=gap, vertices=n) for n in sizes]
        some = [row for row in some if row]
        if not some:
            continue
        worst = max((row[kind] for row in some if row[kind]), key=lambda e: e[2], default=None)
        median = max((row[kind] for row in some if row[kind]), key=lambda e: e[0], default=None)
        asked = sum(row["count"] for row in some)
        wrong = f"{sum(row['wrong'] for row in some)} of {asked}"
        none = sum(row["none"] for row in some)
        bounds = sum(row.get("upper_bounds", 0) for row in some)
        notes = [f"{none} without answer"] * (none > 0) + [f"{bounds} upper bounds"] * (bounds > 0)
        body.append([level_name(some[0])] + [narrow_cell(row) for row in some]
                    + [f"{error(median, 0)}, {error(worst)}", ", ".join([wrong] + notes)])
    what = "depth" if gap == "penetrating" else "distance"
    return table(["ns a query, cold / warm"] + [f"{n} vertices" for n in sizes]
                 + [f"relative error of {what}: median, most", "wrong verdicts"], body)


def ratio_table(rows, sizes):
    """Ours at decide, warm, as a share of FCL-libccd and of Bullet in the same run."""
    body = []
    asked = [("separated", "ours: decide", "FCL libccd"), ("near", "ours: decide", "FCL libccd"),
             ("penetrating", "ours: decide", "FCL libccd"),
             ("penetrating", "ours: decide with depth", "Bullet GjkEpa2 with depth")]
    for gap, ours, peer in asked:
        cells = []
        for n in sizes:
            a = find(rows, method=ours, gap=gap, vertices=n)
            b = find(rows, method=peer, gap=gap, vertices=n)
            cells.append(f"{a['warm_ns'] / b['warm_ns']:.2f}" if a and b and b["warm_ns"] else "–")
        body.append([f"{gap}: {ours} / {peer}"] + cells)
    return table(["warm time, ours / peer"] + [f"{n} vertices" for n in sizes], body)


def drawn_error(values, which):
    return max(MIN_ERROR, values[which])


def speed_error_plot(rows, out, name, title, kind, which, time):
    points = []
    for row in rows:
        if row.get(kind) and row[kind][which] is not None and row[time]:
            none = f", {row['none']} none" if row["none"] else ""
            points.append((level_name(row), drawn_error(row[kind], which), row[time],
                           f": {row['wrong']} wrong{none}"))
    ours = {level_name(row) for row in rows if row["ours"]}
    words = {1: "99 %", 2: "greatest"}[which]
    what = "depth" if kind == "depth_error" else "distance"
    plot.marks(out / f"{name}.svg", title, f"{words} relative error of {what} (0 drawn at 1e-17)",
               "ns a query (median)", points, ours)
    return picture(out, name, title)


def narrow(rows, out):
    if not rows:
        return ""
    sizes = sorted(set(row["vertices"] for row in rows))
    parts = ["## Narrow phase: speed against error\n", """\
Two polytopes with vertices on unit spheres rotate by about a degree a step while one orbits the other.
They are separated by 1 m, near (1 mm), or penetrating by at most 10 cm. *Cold* clears all cached state before each
query, *warm* starts from the last step's answer; methods with one number cache nothing. Medians over
pairs and turns; the methods take turns. Each of our rows names its level; time and error are of that
level. Errors are relative to `refine`, which the next section compares with the truth of files. Touching
counts as a collision. FCL's solvers are called directly, without its dispatch; Bullet in double precision,
without margins.
"""]
    for gap in names(rows, "gap"):
        parts += [f"### {gap}\n", narrow_table(rows, gap, sizes)]
        at20 = [row for row in rows if row["gap"] == gap and row["vertices"] == 20]
        kind = "depth_error" if gap == "penetrating" else "distance_error"
        parts.append(speed_error_plot(at20, out, f"speed_error_{gap}",
                                      f"Speed against error: {gap}, 20 vertices, warm", kind, 2,
                                      "warm_ns"))
    parts += ["### Ours as a share of the peers\n", ratio_table(rows, sizes)]
    return "\n".join(parts)


def share(row, part):
    decided = row["filter"] + row["expansion"] + row["rational"]
    return f"{100 * row[part] / decided:.1f} %" if decided else "–"


def our_families(rows, method):
    body = []
    for family in names(rows, "family"):
        row = find(rows, method=method, family=family)
        if row is None:
            continue
        body.append([family, row["count"], row["wrong"], row["none"], short(row["ns"]),
                     short(row["ns_99"]), error(row["distance_error"]), error(row["depth_error"]),
                     row["upper_bounds"], share(row, "filter"), share(row, "expansion"),
                     share(row, "rational")])
    return table(["family", "cases", "wrong", "no answer", "ns median", "ns 99 %", "distance error",
                  "depth error", "upper bounds", "filter", "expansion", "rational"], body)


def wrong_table(rows):
    methods = names(rows)
    body = []
    for family in names(rows, "family"):
        cells = []
        for method in methods:
            row = find(rows, method=method, family=family)
            cell = "–" if row is None else str(row["wrong"])
            if row and row["none"]:
                cell += f" +{row['none']}"
            cells.append(cell)
        body.append([family] + cells)
    return table(["family"] + methods, body)


def overall_table(rows):
    body = []
    for method in names(rows):
        row = find(rows, method=method, family="all")
        body.append([level_name(row), short(row["ns"]), row["wrong"], row["wrong_beyond"],
                     row["none"], error(row["distance_error"], 0), error(row["distance_error"], 1),
                     error(row["distance_error"]), error(row["depth_error"], 0),
                     error(row["depth_error"])])
    return table(["method", "ns median", "wrong", "beyond 1e-9 of the scale", "no answer",
                  "distance error median", "99 %", "most", "depth error median", "most"], body)


def families(rows, out):
    if not rows:
        return "## Exact cases\n\nThe folder of exact cases was missing; nothing was measured.\n"
    whole = [row for row in rows if row["family"] == "all"]
    parts = ["## Exact cases\n", f"""\
{whole[0]['count']} pairs whose truth is known from integer arithmetic: exact contact, gaps down to
1e-16, slivers, far offsets, architecture. Sequences are queried warm, all others cold. Errors are relative
to the truth of the files. *No answer*: an exception, an abort, a hang, NaN, or a body that the peer cannot
represent (ODE: only solids). Errors are measured only for right verdicts.
""", overall_table(rows),
             speed_error_plot(whole, out, "speed_error_cases", "Speed against error: all exact cases",
                              "distance_error", 1, "ns"),
             "### Wrong verdicts by family (+ cases without an answer)\n", wrong_table(rows)]
    for method in names([row for row in rows if row["ours"]]):
        parts += [f"### {method}, by family\n", our_families(rows, method)]
    return "\n".join(parts)


# ---- mesh, I-COLLIDE -----------------------------------------------------------------------------

def mesh(rows):
    if not rows:
        return ""
    body = []
    for row in rows:
        body.append([row["method"], row["motion"],
                     f"{short(row['distance_us'])} ({short(row['distance_cold_us'])})",
                     short(row["error_m"]),
                     f"{short(row['contacts_us'])} ({short(row['contacts_cold_us'])})",
                     f"{row['missed']} / {row['false']}", short(row["build_s"])])
    return "\n".join(["## Hull against mesh\n", """\
A hull of 20 vertices flies over a terrain of 50,880 triangles, clear of it or dipping in, 25 mm and
one degree a step. Warm medians (cold in brackets). Contacts are all triangles touched or penetrated.
Bullet has no distance query to a mesh: its tree is queried with a box inflated by the last distance.
""", table(["method", "motion", "distance µs", "worst error m", "contacts µs",
            "triangles missed / false", "build s"], body)])


def crossings(rows):
    if not rows:
        return ""
    body = [[row["kind"], row["hits"], row["proved"], row["late"], f"{row['false']} of {row['misses']}",
             f"{short(1e-3 * row['hit_ns'])} ({short(1e-3 * row['hit_p99_ns'])})",
             short(1e-3 * row["miss_ns"])] for row in rows]
    return "\n".join(["### Crossings\n", """\
Thin bodies that translate and pass through each other, as a rule at a time that is no double. A hit is
proved if the result is `contact` and its interval contains the exact time, which rational arithmetic
gives. It is late if `lo` is above that time. The time is that of the whole query.
""", table(["bodies", "hits", "proved", "late", "false hits of misses", "µs a hit, median (99 %)",
            "µs a miss, median"], body)])


def time_to_contact(rows):
    crossing = [row for row in rows if row["bench"] == "crossing"]
    rows = [row for row in rows if row["bench"] == "time"]
    if not rows:
        return ""
    body = [[row["method"], row["motion"], row["met"], row["broken"],
             "–" if row["share"] is None else f"{row['share']:.3g}", short(row["ns"])]
            for row in rows]
    return "\n".join(["## Time to contact\n", """\
Lower bounds on the time to contact of two bodies. Lin (1993, section 5.1) uses the closing speed of the
closest points. Ours is the closing speed of the reference points plus |w| rho of each body, which no
vertex exceeds. A bound is broken if the bodies provably meet before it. `rod` is a counter-example to the
former. A rod along a wall rotates about its middle, which is closest and at rest, while its tip approaches.
The reference is the time of impact itself, by conservative advancement.
""", table(["bound", "motion", "encounters", "broken", "median share of the true time", "ns"], body),
                      crossings(crossing)])


def icollide(rows, out):
    if not rows:
        return ""
    middle = [row for row in rows if row["sweep"] == "number" and row["value"] == 1000]
    middle = middle or [row for row in rows if row["sweep"] == "density" and row["value"] == 0.01]
    stages = table(["the middle setting, ms a frame", "boxes", "broad phase", "narrow phase", "whole",
                    "pairs a frame"],
                   [[row["method"]] + [short(row[key]) for key in
                                       ("boxes_ms", "broad_ms", "narrow_ms", "ms", "pairs")]
                    for row in middle])
    parts = ["## I-COLLIDE's five sweeps\n", """\
The five sweeps of Cohen et al. (1995). Default parameters: 1000 polytopes of 36 faces, 10° and 10 % of the
radius a frame, density 1 %. The density is the bodies' volume relative to the cube that contains them. A frame is boxes,
broad phase, and the exact verdict on every pair; peers get fixed cubes. Missed and false contacts are
counted over all frames of a setting, against all pairs computed cold.
""", stages]
    units = {"number": "bodies", "faces": "faces a body", "density": "density",
             "rotation": "degrees a frame", "translation": "radii a frame"}
    for sweep in names(rows, "sweep"):
        some = [row for row in rows if row["sweep"] == sweep]
        values = names(some, "value")
        series, body = {}, []
        for method in names(some):
            mine = [find(some, method=method, value=v) for v in values]
            series[method] = [(row["value"], row["ms"]) for row in mine]
            body.append([method] + [short(row["ms"]) for row in mine]
                        + [f"{sum(r['missed'] for r in mine)} / {sum(r['false'] for r in mine)}"])
        ours = {name for name in series if name.startswith("ours")}
        log = sweep in ("number", "faces", "density")
        plot.lines(out / f"icollide_{sweep}.svg", f"I-COLLIDE: {sweep}", units[sweep], "ms a frame",
                   series, ours, log)
        first = find(some, method=names(some)[0])
        pairs = [short(find(some, method=first["method"], value=v)["pairs"]) for v in values]
        body.append([f"pairs a frame ({first['method']})"] + pairs + [""])
        parts += [f"### {sweep} ({units[sweep]})\n",
                  table(["ms a frame"] + [f"{v:g}" for v in values] + ["missed / false"], body),
                  picture(out, f"icollide_{sweep}", f"Time of a frame by {sweep}")]
    return "\n".join(parts)


def main():
    results, out = Path(sys.argv[1]), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    rows = read(results, "narrow")
    quick = "--quick" in sys.argv
    head = f"""\
# The collision core compared with its peers

Made by `./dev bench collision{' --quick' if quick else ''}` on {datetime.date.today()}. Machine: {machine()},
single thread. {'**A quick run: few repetitions, smaller sizes.** ' if quick else ''}The machine is
noisy (other load, shared clocks), so times vary by a factor of two. Every table is from one run in
which the methods take turns. Times are medians, and only ratios within a table are meaningful. Peers are Debian's packages; one that is not installed is missing here.
"""
    parts = [head, broad(read(results, "broad"), out),
             all_moving(read(results, "moving")),
             narrow([row for row in rows if row["bench"] == "narrow"], out),
             families([row for row in rows if row["bench"] == "family"], out),
             mesh(read(results, "mesh")), time_to_contact(read(results, "time")),
             icollide(read(results, "icollide"), out)]
    (out / "collision.md").write_text("\n".join(part for part in parts if part))
    print(out / "collision.md")


if __name__ == "__main__":
    main()
