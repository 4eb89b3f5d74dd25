"""frame_overhead.py PORT PICTURES: microseconds of each picture, one a line; see frame_overhead.cpp."""

import sys
import time

import enfilade


def main() -> None:
    port, pictures = int(sys.argv[1]), int(sys.argv[2])
    with enfilade.connect(port=port) as client:
        for _ in range(pictures):
            start = time.perf_counter_ns()
            client.frame(eye=(1.5, 1.6, 0), forward=(1, 0, 0), width=128, height=128,
                         channels=("rgb", "depth"))
            print((time.perf_counter_ns() - start) / 1000)


if __name__ == "__main__":
    main()
