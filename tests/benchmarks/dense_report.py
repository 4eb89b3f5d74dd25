#!/usr/bin/env python3
"""Makes the report of walkers among dense triangles: dense.md.

dense_report.py RESULTS_FOLDER REPORT_FOLDER [--quick]

Reads dense.jsonl, as dense_bench writes it.
"""

import datetime
import sys
from pathlib import Path

from report import machine, read, short, table

HEAD = ["scene", "objects", "triangles", "µs an avatar, median", "tick µs, 99 %", "tick µs, maximum",
        "narrow queries an avatar", "parts looked at an avatar", "contacts compared", "wrong",
        "penetration m"]


def line(row):
    return [row["scene"], f"{row['objects']:,}", f"{row['triangles']:,}", short(row["avatar_us"]), short(row["tick_p99_us"]),
            short(row["tick_max_us"]), short(row["queries"]), short(row["parts"]), row["contacts"],
            row["wrong"], short(row["penetration_m"])]


def main():
    results, report = Path(sys.argv[1]), Path(sys.argv[2])
    rows = read(results, "dense")
    scenes = "\n".join(dict.fromkeys(f"- *{row['scene']}*: {row['description']}" for row in rows if row["description"]))
    report.mkdir(parents=True, exist_ok=True)
    text = f"""# Walkers among dense triangles

Made by `./dev bench dense{" --quick" if "--quick" in sys.argv else ""}` on \
{datetime.date.today().isoformat()}. Machine: {machine()}.
Ten avatars walk at 1.5 m/s for {rows[0]["ticks"]} ticks in real scenes, if any are listed, and in those that the benchmark generates:

{scenes}

Times are those of the tick's thread, with collision geometry built before, as a server's prefetch does. In
every 20th tick the contacts of all avatars are compared with brute force over all triangles and hulls, by
the exact comparison.

{table(HEAD, [line(row) for row in rows])}
"""
    (report / "dense.md").write_text(text)


if __name__ == "__main__":
    main()
