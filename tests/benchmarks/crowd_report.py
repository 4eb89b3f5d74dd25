"""Writes the report of a crowd from the output of tick_bench.

    python3 crowd_report.py OUTPUT REPORT.md
"""

import datetime
import re
import sys
from pathlib import Path

from report import machine

HEAD = """# A crowd

A thousand avatars walk in a district of 100,000 objects, copies of the bundled building, at 1.5 m/s towards places
that change every two seconds. Times of the stages of a tick are in microseconds of wall-clock time: median, 99th
percentile and maximum, with one thread and with two. `main CPU` and `all CPUs` are processor time. Penetration is the
deepest of all ticks, by the exact verdict. The state hashes are equal: threads do not change a bit.
Made by `./dev bench crowd` on {date}. Machine: {machine}.

```
{output}
```
"""


output, report = map(Path, sys.argv[1:3])
hashes = set(re.findall(r"state hash (\w+)", output.read_text()))
if len(hashes) != 1:
    sys.exit(f"{output}: the runs ended at different states: {sorted(hashes)}")
report.write_text(HEAD.format(date=datetime.date.today().isoformat(), machine=machine(),
                              output=output.read_text().rstrip()))
