"""Writes the report of the parts feeder from the output of parts_feeder.

    python3 feeder_report.py OUTPUT REPORT.md
"""

import datetime
import sys
from pathlib import Path

from report import machine

HEAD = """# Parts feeder

Small convex parts of about 2 cm fall into a vibrating tray (Lin 1993, section 5.4). Ours runs with two threads, the
peers with their defaults and one thread; Bullet in doubles. `real time` is simulated time over the time that it took: above 1 the
feeder keeps up. `deepest` is the deepest penetration, `penetrating` the most pairs that penetrate at one check, and
`outside` the most parts that left the tray. Our exact narrow phase measures them for all. `scene` is a world with
contact events, as the server ticks it. On a busy machine two threads may be no faster than one.
Bullet is left out with 4,000 parts, where it would take an hour. Made by `./dev bench feeder` on {date}. Machine: {machine}.

```
{output}
```
"""


output, report = map(Path, sys.argv[1:3])
report.write_text(HEAD.format(date=datetime.date.today().isoformat(), machine=machine(), output=output.read_text().rstrip()))
