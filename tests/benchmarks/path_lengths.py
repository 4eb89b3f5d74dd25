"""Lengths of paths against the shortest ones on a fine grid of the places where an avatar can stand.

Only floors of one height: the grid is NavigationQuery.Map at that height. A path of the grid is the shortest of
moves to 16 neighbours, pulled straight where all cells below the straight line are walkable.

    python3 path_lengths.py SCENE HEIGHT [--cell METRES] [--starts N] [--goals N]
"""

import argparse
import heapq
import math

import numpy as np

import enfilade

MOVES = [(a, b) for a in range(-2, 3) for b in range(-2, 3) if math.gcd(a, b) == 1]


class Grid:
    def __init__(self, top_down):
        self.walkable, self.corner, self.cell = top_down.cells, top_down.corner, top_down.cell
        rows, columns = self.walkable.shape
        padded = np.pad(self.walkable, 2)
        # The cells that a move of (1, 2) also passes are (0, 1) and (1, 1); a diagonal one passes both sides.
        self.moves = []
        for a, b in MOVES:
            free = padded[2 + a:2 + a + rows, 2 + b:2 + b + columns] & self.walkable
            half = {(math.floor(a / 2), math.floor(b / 2)), (math.ceil(a / 2), math.ceil(b / 2)),
                    (math.floor(a / 2), math.ceil(b / 2)), (math.ceil(a / 2), math.floor(b / 2))}
            for c, d in half if abs(a) + abs(b) != 1 else ():
                free = free & padded[2 + c:2 + c + rows, 2 + d:2 + d + columns]
            self.moves.append((a * columns + b, math.hypot(a, b), free.ravel().tolist()))

    def index(self, at):
        column, row = (int((at[axis] - self.corner[axis]) / self.cell) for axis in (0, 2))
        inside = 0 <= row < self.walkable.shape[0] and 0 <= column < self.walkable.shape[1]
        return row * self.walkable.shape[1] + column if inside and self.walkable[row, column] else None

    def point(self, index):
        row, column = divmod(index, self.walkable.shape[1])
        return (self.corner[0] + (column + 0.5) * self.cell, self.corner[2] + (row + 0.5) * self.cell)

    def paths(self, start, goals):
        """Dijkstra: for each goal the cells of its path, or nothing."""
        best, before, left, heap = {start: 0.0}, {}, set(goals), [(0.0, start)]
        while heap and left:
            length, at = heapq.heappop(heap)
            if length > best[at]:
                continue
            left.discard(at)
            for step, cost, free in self.moves:
                if free[at] and length + cost < best.get(at + step, math.inf):
                    best[at + step], before[at + step] = length + cost, at
                    heapq.heappush(heap, (length + cost, at + step))
        found = []
        for goal in goals:
            path = [goal] if goal in best else []
            while path and path[-1] != start:
                path.append(before[path[-1]])
            found.append(path[::-1])
        return found

    def is_straight(self, a, b):
        count = max(2, int(2 * math.dist(a, b) / self.cell))
        steps = np.linspace(a, b, count)
        rows = ((steps[:, 1] - self.corner[2]) / self.cell).astype(int)
        columns = ((steps[:, 0] - self.corner[0]) / self.cell).astype(int)
        return bool(self.walkable[rows, columns].all())

    def pulled(self, points):
        """The length of the path pulled straight: the shortest chain of its points of which neighbours see each
        other."""
        points = points[:1] + points[1:-1:max(1, len(points) // 150)] + points[-1:]
        best = [0.0] + [math.inf] * (len(points) - 1)
        for j in range(1, len(points)):
            for i in range(j - 1, -1, -1):
                length = best[i] + math.dist(points[i], points[j])
                if length < best[j] and (i == j - 1 or self.is_straight(points[i], points[j])):
                    best[j] = length
        return best[-1]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("height", type=float)
    parser.add_argument("--cell", type=float, default=0.02)
    parser.add_argument("--starts", type=int, default=10)
    parser.add_argument("--goals", type=int, default=20)
    given = parser.parse_args()
    with enfilade.serve(given.scene) as server, server.connect() as client:
        navigation = client.navigation()
        grid = Grid(navigation.top_down(given.height, given.cell))
        spots = navigation.random_places(given.starts * (given.goals + 1) * 20, 1)
        places = [tuple(spot.at) for spot in spots if spot is not None and abs(spot.at[1] - given.height) < 0.1 and
                  grid.index(spot.at) is not None]
        ratios, lost = [], 0
        for number in range(given.starts):
            start, *goals = places[number * (given.goals + 1):(number + 1) * (given.goals + 1)]
            for goal, path, cells in zip(goals, navigation.paths(start, goals),
                                         grid.paths(grid.index(start), [grid.index(one) for one in goals])):
                if not path.found or not cells:
                    lost += bool(cells) and not path.found
                    continue
                if np.abs(path.points[:, 1] - given.height).max() > 0.15:
                    continue  # over another floor
                ends = [(start[0], start[2]), *map(grid.point, cells[1:-1]), (goal[0], goal[2])]
                ratios.append((path.length / grid.pulled(ends), start, goal))
        values = np.array([one[0] for one in ratios])
        print(f"{given.scene}: {len(values)} pairs, cells of {given.cell} m; length / grid: median "
              f"{np.median(values):.4f}, 99 % {np.quantile(values, 0.99):.4f}, most {values.max():.4f}; above 1.02: "
              f"{(values > 1.02).sum()}; no path where the grid has one: {lost}")
        for ratio, start, goal in sorted(ratios)[-3:]:
            print(f"  {ratio:.4f} from {np.round(start, 3).tolist()} to {np.round(goal, 3).tolist()}")


if __name__ == "__main__":
    main()
