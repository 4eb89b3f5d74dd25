"""frame_overhead.py PORT: for each line that comes, microseconds of a "picture", of a "step", or of "both" in
one write, as environments ask for them; see frame_overhead.cpp."""

import sys
import time

import enfilade
from enfilade import messages, results
from enfilade.questions import frame_request

_VIEW = {"eye": (1.5, 1.6, 0), "forward": (1, 0, 0), "width": 128, "height": 128,
         "channels": ("rgb", "depth")}


def both(client: enfilade.Client) -> None:
    step, picture = client.pipeline([{"step": messages.Step(ticks=1)},
                                     {"frame": frame_request(**_VIEW)}])
    results.step(step[0].step)
    results.frame(picture[0].frame, picture[1])


def main() -> None:
    with enfilade.connect(f"127.0.0.1:{sys.argv[1]}") as client:
        work = {"picture": lambda: client.frame(**_VIEW), "step": client.step,
                "both": lambda: both(client)}
        for line in sys.stdin:
            start = time.perf_counter_ns()
            work[line.strip()]()
            print((time.perf_counter_ns() - start) / 1000, flush=True)


if __name__ == "__main__":
    main()
