#!/usr/bin/env python3
"""Makes the report of navigation: navigation.md.

navigation_report.py RESULTS_FOLDER REPORT_FOLDER

Reads navigation.jsonl, as navigation_bench writes it, and the present report. A part of a scene that was not measured
again keeps its row, which has its date. Paragraphs that begin with "Note:" stay in their section.
"""

import datetime
import sys
from pathlib import Path

from report import machine, read, short, table


def make_walk_row(row):
    return [row["scene"], f"{row['pairs']:,}", row["starts_refused"], f"{row['found']:,}", row["wrong"],
            row["without_reason"], short(row["max_penetration"]),
            f"{row['walked_doors']:,} ({row['wrong_with_doors']})", row["walked_lifts"], row["walked_drops"]]


def format_ratio(value):
    return f"{value:.4f}" if value else "–"


def make_fill_row(row):
    return [row["scene"], f"{row['fill_places']:,}", row["reach_compared"], row["reach_wrong"],
            row["reach_walked"], row["reach_near_width"], row["reach_skipped"], row["islands_wrong"],
            f"{row['lengths']} ({row['lengths_unwalkable']})", short(row["length_median"]),
            format_ratio(row["length_max"]), row["length_above"], format_ratio(row.get("feet_max")), row.get("feet_above", "–")]


def make_length_row(row):
    return [row["scene"], f"{row['detour_pairs']:,}", f"{row['detour_found']:,}", row["detour_no_line"], row["detour_unwalkable"],
            f"{row['detour_compared']:,}" + (f" ({row['detour_wrong']} wrong)" if row.get("detour_wrong") else ""),
            format_ratio(row["detour_min"]), format_ratio(row["detour_median"]),
            format_ratio(row["detour_max"]), row["detour_above"], format_ratio(row["detour_feet_max"]),
            row["detour_feet_above"]]


def make_time_row(row):
    return [row["scene"], short(row["area"]), row["islands"], short(row["build_seconds"]), short(row["mesh_bytes"] / 1e6),
            short(row["mesh_us"]), short(row["median_us"]), short(row["p99_us"]), short(row["not_found_p99_us"])]


class Section:
    """The rows and the notes of a section of the present report."""

    def __init__(self, report, title):
        text = report.partition(f"\n## {title}\n")[2].partition("\n## ")[0]
        self.notes = "".join(one.strip() + "\n\n" for one in text.split("\n\n") if one.startswith("Note:"))
        lines = [line for line in text.splitlines() if line.startswith("| ")][1:]
        self.rows = {cells[0]: cells for cells in ([cell.strip() for cell in line.strip("| ").split("|")] for line in lines)}

    def write(self, head, measured, make_row):
        """The table: rows of this run replace those of their scenes."""
        rows = {**self.rows, **{row["scene"]: [*make_row(row), row["date"]] for row in measured}}
        for row in rows.values():
            if len(row) != len(head) + 1:
                sys.exit(f"{row[0]}: the present report has other columns; measure this part again in all scenes")
        return self.notes + table([*head, "date"], rows.values())


WALKS = ["scene", "pairs", "refused", "paths", "wrong", "silent", "penetration m", "with doors (wrong)", "with lifts", "with drops"]
REACH = ["scene", "places of the fill", "compared", "wrong", "walked", "near", "skipped", "islands", "lengths", "median share",
         "largest", "above 1.02", "by feet: largest", "above"]
DETOUR = ["scene", "pairs", "paths", "no line", "not walked", "compared", "smallest share", "median", "largest", "above 1.02",
          "by feet: largest", "above"]
TIMES = ["scene", "navigable m²", "islands", "build s", "MB", "µs on the mesh, median", "µs a path, median", "99 %",
         "µs without a path, 99 %"]


def main():
    results, folder = Path(sys.argv[1]), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "navigation.md"
    before = path.read_text() if path.exists() else ""
    parts = {}
    measured_on = datetime.date.fromtimestamp((results / "navigation.jsonl").stat().st_mtime).isoformat()
    for row in read(results, "navigation"):
        parts.setdefault(row["part"], []).append({"date": measured_on, **row})

    def write(title, part, head, make_row):
        return Section(before, title).write(head, parts.get(part, []), make_row)

    path.write_text(f"""# Navigation: paths that are walked

Made by `./dev bench navigation`, or by its parts (`navigation_bench --only times|fill|lengths|walks`); each row has its
date. Machine of the last run: {machine()}.
An agent of 0.3 m radius and 1.75 m height.

## Walks

An avatar enters at a random place and goes to another one with the order `go`, which opens doors and rides
lifts. In every sixth pair it may fall by up to 2 m. Doors and lifts are as in the file again after 25 walks. A walk is
*wrong* if it is blocked, leaves the scene or penetrates anything. Walks through doors
are counted by themselves, too. *Refused*: a closed door stands at the start. *Silent*: no path and no reason, or only
that the search ended at its limits.

{write("Walks", "walks", WALKS, make_walk_row)}
## Reach and length

A flood fill tries every place of a grid of 2 cm by standing there (`flood_fill.hpp`): it uses no navigation
mesh. Pairs of places are drawn on all islands or anywhere in the fill. A pair is *wrong* if a path is found and the fill
does not connect it, or the other way round. What they find differently is judged by a fill of which each step is
walked. *Walked*: an avatar walks the path to its end, and the grid misses it, as over cushions. *Near*: half a centimetre
of radius, or a shift of the grid by one centimetre, changes the answer.
*Skipped*: an end is at no place of the fill, or the fill of a large scene ended at its limit. *Islands*: paths are
found between two islands in both directions, or none on one. Lengths are those of paths as a share of the
shortest way in the fill, pulled straight, where an avatar can walk that. In brackets are those where it cannot, or of
which the fill has not both ends. Ways of a metre and more are compared. They are measured along the points of both. *By
feet*: an avatar walks both, and the metres that its feet move across, up and down are compared. A step thus counts with
its height, in one tick as in a fall. –: not measured.

{write("Reach and length", "fill", REACH, make_fill_row)}
## Length against Detour

Lengths of paths as a share of Detour's string-pulled line on the mesh that proposes them, where an avatar walks that line
to its end. *No line*: the mesh has none, as where a connection leads from one of its parts to another. *Not walked*: an
avatar is stopped on the line. Lines of a metre and more are compared, along the points of both. *By feet*: an avatar
walks both, as above. Doors are as they are.

{write("Length against Detour", "lengths", DETOUR, make_length_row)}
## Time

Of a query for a path, with its proof, doors as they are, answered in process on one thread. *On the mesh*: the corridor
and the corners of its line alone, without a proof. *MB*: of memory, with connections.

{write("Time", "times", TIMES, make_time_row)}""")


if __name__ == "__main__":
    main()
