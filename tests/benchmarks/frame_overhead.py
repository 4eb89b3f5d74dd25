"""frame_overhead.py PORT: microseconds of a picture, for each line that comes; see frame_overhead.cpp."""

import sys
import time

import enfilade


def main() -> None:
    with enfilade.connect(f"127.0.0.1:{sys.argv[1]}") as client:
        for _ in sys.stdin:
            start = time.perf_counter_ns()
            client.frame(eye=(1.5, 1.6, 0), forward=(1, 0, 0), width=128, height=128,
                         channels=("rgb", "depth"))
            print((time.perf_counter_ns() - start) / 1000, flush=True)


if __name__ == "__main__":
    main()
