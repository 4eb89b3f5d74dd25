"""frame_overhead.py PORT: for each input line ("picture", "step", or "both" in one write, as environments
do), prints the microseconds it took and those spent on drawing; see frame_overhead.cpp."""

import sys
import time

import enfilade
from enfilade import messages, results
from enfilade.query_messages import frame_request

_VIEW = {"eye": (1.5, 1.6, 0), "forward": (1, 0, 0), "width": 128, "height": 128,
         "channels": ("rgb", "depth")}


def picture(client: enfilade.Client) -> float:
    return client.frame(**_VIEW).message.drawing_seconds


def step(client: enfilade.Client) -> float:
    client.step()
    return 0.0


def both(client: enfilade.Client) -> float:
    stepped, drawn = client.pipeline([{"step": messages.Step(ticks=1)},
                                     {"frame": frame_request(**_VIEW)}])
    results.step(stepped[0].step)
    return results.frame(drawn[0].frame, drawn[1]).message.drawing_seconds


def main() -> None:
    with enfilade.connect(f"127.0.0.1:{sys.argv[1]}") as client:
        work = {"picture": picture, "step": step, "both": both}
        for line in sys.stdin:
            start = time.perf_counter_ns()
            drawing_seconds = work[line.strip()](client)
            print((time.perf_counter_ns() - start) / 1e3, drawing_seconds * 1e6, flush=True)


if __name__ == "__main__":
    main()
