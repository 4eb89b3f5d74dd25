"""Small SVG plots with logarithmic axes: lines, and labelled marks. No dependency."""

import math
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 860, 500
LEFT, RIGHT, TOP, BOTTOM = 80, 250, 48, 60
OURS = "#c2410c"
OTHERS = ["#1d4ed8", "#15803d", "#7e22ce", "#0e7490", "#a16207", "#be185d", "#4d7c0f", "#475569",
          "#9f1239", "#0369a1", "#6d28d9", "#166534", "#92400e", "#334155"]
SHAPES = ["circle", "square", "triangle", "diamond"]


class Axis:
    """Maps values to pixels; logarithmic, or linear if a value may be 0."""

    def __init__(self, values, low, high, log=True):
        self.low, self.high, self.log = low, high, log
        minimum, maximum = min(values), max(values)
        if log:
            self.first = math.floor(math.log10(minimum) + 1e-9)
            self.last = math.ceil(math.log10(maximum) - 1e-9)
            self.last = max(self.last, self.first + 1)
        else:
            self.first, self.last = minimum, maximum if maximum > minimum else minimum + 1

    def at(self, value):
        x = math.log10(value) if self.log else value
        return self.low + (self.high - self.low) * (x - self.first) / (self.last - self.first)

    def ticks(self):
        if not self.log:
            step = (self.last - self.first) / 5
            return [(self.first + k * step, f"{self.first + k * step:.3g}") for k in range(6)]
        every = max(1, math.ceil((self.last - self.first) / 9))
        return [(10.0 ** k, power(k)) for k in range(self.first, self.last + 1, every)]


def power(exponent):
    if -3 < exponent < 4:
        return f"{10.0 ** exponent:g}"
    return f"1e{exponent}"


def mark(x, y, colour, shape):
    if shape == "square":
        return f'<rect x="{x - 4:.1f}" y="{y - 4:.1f}" width="8" height="8" fill="{colour}"/>'
    if shape == "triangle":
        return (f'<path d="M{x:.1f},{y - 5:.1f} l5,9 h-10 z" fill="{colour}"/>')
    if shape == "diamond":
        return f'<path d="M{x:.1f},{y - 5.5:.1f} l5.5,5.5 -5.5,5.5 -5.5,-5.5 z" fill="{colour}"/>'
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{colour}"/>'


def text(x, y, words, anchor="start", size=12, extra=""):
    return (f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" {extra}>'
            f'{escape(words)}</text>')


def frame(title, x_name, y_name, x, y):
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
             f'font-family="sans-serif" fill="#1f2937">',
             f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
             text(LEFT, 26, title, size=15, extra='font-weight="bold"')]
    for value, name in x.ticks():
        at = x.at(value)
        parts.append(f'<path d="M{at:.1f},{TOP} V{bottom}" stroke="#e5e7eb"/>')
        parts.append(text(at, bottom + 18, name, "middle"))
    for value, name in y.ticks():
        at = y.at(value)
        parts.append(f'<path d="M{LEFT},{at:.1f} H{right}" stroke="#e5e7eb"/>')
        parts.append(text(LEFT - 8, at + 4, name, "end"))
    parts.append(f'<path d="M{LEFT},{TOP} V{bottom} H{right}" stroke="#6b7280" fill="none"/>')
    parts.append(text((LEFT + right) / 2, HEIGHT - 16, x_name, "middle", 13))
    middle = (TOP + bottom) / 2
    parts.append(text(20, middle, y_name, "middle", 13, f'transform="rotate(-90 20 {middle:.1f})"'))
    return parts


def looks(names, ours):
    """A colour and a shape for each name, in the order given."""
    result, others = {}, 0
    for k, name in enumerate(names):
        if name in ours:
            result[name] = (OURS, SHAPES[k % len(SHAPES)])
        else:
            result[name] = (OTHERS[others % len(OTHERS)], SHAPES[others % len(SHAPES)])
            others += 1
    return result


def spread(wanted, gap=14):
    """Spreads positions downwards in their order; moves them up if they would leave the plot."""
    order = sorted(range(len(wanted)), key=lambda k: wanted[k])
    placed, last = dict(), -math.inf
    for k in order:
        last = max(wanted[k], last + gap)
        placed[k] = last
    over = last - (HEIGHT - BOTTOM)
    if over > 0:
        limit = math.inf
        for k in reversed(order):
            placed[k] = min(placed[k], HEIGHT - BOTTOM if limit is math.inf else limit - gap)
            limit = placed[k]
    return [placed[k] for k in range(len(wanted))]


def names_at_right(series, y, style):
    """Names next to the lines' ends, joined to them by a thin line if they had to move."""
    ends = [y.at(points[-1][1]) for points in series.values()]
    parts = []
    for (name, points), end, at in zip(series.items(), ends, spread(ends)):
        colour, _ = style[name]
        edge = WIDTH - RIGHT
        parts.append(f'<path d="M{edge + 2},{end:.1f} L{edge + 14},{at:.1f}" stroke="{colour}"/>')
        parts.append(text(edge + 18, at + 4, name, extra=f'fill="{colour}"'))
    return parts


def lines(path, title, x_name, y_name, series, ours=(), x_log=True):
    """`series`: name to a list of (x, y), ascending in x."""
    series = {name: points for name, points in series.items() if points}
    if not series:
        return False
    x = Axis([p[0] for s in series.values() for p in s], LEFT, WIDTH - RIGHT, x_log)
    y = Axis([p[1] for s in series.values() for p in s], HEIGHT - BOTTOM, TOP)
    style = looks(list(series), ours)
    parts = frame(title, x_name, y_name, x, y)
    for name, points in series.items():
        colour, shape = style[name]
        places = [(x.at(a), y.at(b)) for a, b in points]
        drawn = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
        width = 3 if name in ours else 1.5
        parts.append(f'<polyline points="{drawn}" fill="none" stroke="{colour}" '
                     f'stroke-width="{width}"/>')
        parts += [mark(a, b, colour, shape) for a, b in places]
    return write(path, parts + names_at_right(series, y, style))


def marks(path, title, x_name, y_name, points, ours=()):
    """`points`: a list of (name, x, y, words next to the name)."""
    if not points:
        return False
    x = Axis([p[1] for p in points], LEFT, WIDTH - RIGHT)
    y = Axis([p[2] for p in points], HEIGHT - BOTTOM, TOP)
    style = looks([p[0] for p in points], ours)
    parts = frame(title, x_name, y_name, x, y)
    heights = [y.at(p[2]) for p in points]
    for (name, a, _, words), at, label in zip(points, heights, spread(heights)):
        colour, shape = style[name]
        here = x.at(a)
        edge = WIDTH - RIGHT
        parts.append(f'<path d="M{here + 6:.1f},{at:.1f} L{edge},{at:.1f} L{edge + 12},{label:.1f}" '
                     f'stroke="{colour}" stroke-opacity="0.35" stroke-dasharray="2 3" fill="none"/>')
        parts.append(mark(here, at, colour, shape))
        parts.append(text(edge + 16, label + 4, f"{name}{words}", size=11, extra=f'fill="{colour}"'))
    return write(path, parts)


def write(path, parts):
    path.write_text("\n".join(parts + ["</svg>", ""]))
    return True
