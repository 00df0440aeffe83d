"""Draws the demo's result as one SVG: the paths from above and from the side, and the objectivity over time."""

import csv
import html
import math

WIDTH, PANEL, MARGIN = 1200, 360, 64
INK, GRID = "#222222", "#dddddd"
TRIAL, PERSON, ANSWER, ROBOT, CONTACT = "#b8b8b8", "#222222", "#0072b2", "#e69f00", "#cc2222"


class Axes:
    """A panel with a frame, ticks and labels; maps data to pixels with one scale for both axes where asked."""

    def __init__(self, left, top, width, height, xs, ys, labels, equal):
        self.left, self.top, self.width, self.height, self.labels = left, top, width, height, labels
        self.x0, self.x1 = padded(xs)
        self.y0, self.y1 = padded(ys)
        if equal:
            scale = max((self.x1 - self.x0) / width, (self.y1 - self.y0) / height)
            self.x0, self.x1 = widened(self.x0, self.x1, scale * width)
            self.y0, self.y1 = widened(self.y0, self.y1, scale * height)

    def at(self, x, y):
        px = self.left + (x - self.x0) / (self.x1 - self.x0) * self.width
        py = self.top + self.height - (y - self.y0) / (self.y1 - self.y0) * self.height
        return px, py

    def frame(self):
        out = [f'<rect x="{self.left}" y="{self.top}" width="{self.width}" height="{self.height}" fill="none" stroke="{INK}"/>']
        for value in ticks(self.x0, self.x1):
            x, _ = self.at(value, self.y0)
            out.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{self.top}" y2="{self.top + self.height}" stroke="{GRID}"/>')
            out.append(text(x, self.top + self.height + 16, f"{value:g}", "middle"))
        for value in ticks(self.y0, self.y1):
            _, y = self.at(self.x0, value)
            out.append(f'<line x1="{self.left}" x2="{self.left + self.width}" y1="{y:.1f}" y2="{y:.1f}" stroke="{GRID}"/>')
            out.append(text(self.left - 6, y + 4, f"{value:g}", "end"))
        out.append(text(self.left + self.width / 2, self.top + self.height + 34, self.labels[0], "middle"))
        middle = self.top + self.height / 2
        out.append(
            f'<text x="{self.left - 44}" y="{middle}" text-anchor="middle" transform="rotate(-90 {self.left - 44} {middle})">'
            f"{html.escape(self.labels[1])}</text>"
        )
        out.append(text(self.left, self.top - 8, self.labels[2], "start"))
        return out

    def line(self, points, colour, width, dash=""):
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in (self.at(*point) for point in points))
        return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-dasharray="{dash}"/>'

    def cross(self, point, colour):
        x, y = self.at(*point)
        return f'<path d="M{x - 6:.1f} {y - 6:.1f}l12 12m0 -12l-12 12" stroke="{colour}" stroke-width="2.5"/>'


def padded(values):
    low, high = min(values), max(values)
    room = 0.06 * (high - low) or 0.5
    return low - room, high + room


def widened(low, high, length):
    middle = (low + high) / 2
    return middle - length / 2, middle + length / 2


def ticks(low, high):
    step = 10 ** math.floor(math.log10((high - low) / 3))
    for factor in (1, 2, 5, 10):
        if (high - low) / (step * factor) <= 7:
            step *= factor
            break
    first = math.ceil(low / step - 1e-9)
    return [round(i * step, 10) for i in range(first, math.floor(high / step + 1e-9) + 1)]


def text(x, y, words, anchor):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{html.escape(words)}</text>'


def path_of_trial(file):
    """Tool positions of a trial file; empty where it has none."""
    with open(file, newline="", encoding="utf-8-sig") as stream:
        rows = list(csv.DictReader(stream))
    points = []
    for row in rows:
        try:
            points.append(tuple(float(row[name]) for name in ("ee_x_m", "ee_y_m", "ee_z_m")))
        except (KeyError, TypeError, ValueError):
            continue
    return points


def paths_of_skill(skill):
    """Tool positions of the trials that a skill was learned from, of its exported document."""
    poses = [trial["own"]["base_T_tool"] for trial in skill["alignment"]["trials"]]  # x y z qx qy qz qw, ...
    return [list(zip(flat[0::7], flat[1::7], flat[2::7])) for flat in poses]


def draw(target, title, answer, execution, left_out, skill):
    """`answer`: a skill's motion, `execution`: an execution's result, both as the command line prints them;
    `skill`: its export; `left_out`: the file of the trial that the answer should be like, or None."""
    paths = [(path, TRIAL, 1.2, "", "trials learned from") for path in paths_of_skill(skill)]
    if left_out:
        paths.append((path_of_trial(left_out), PERSON, 2, "", "what the person did here (left out)"))
    paths.append(([tuple(p["position"]) for p in answer["base_T_tool"]], ANSWER, 2.2, "", "the skill's answer"))
    paths.append(([tuple(p["position"]) for p in execution.get("base_T_tool", [])], ROBOT, 2.2, "5 3", "simulated robot, measured"))
    paths = [path for path in paths if path[0]]
    contacts = [tuple(contact["base_p_contact"]) for contact in answer["contacts"]]
    points = [point for path in paths for point in path[0]] + contacts

    panel_width = (WIDTH - 3 * MARGIN - 40) / 2
    top = Axes(MARGIN + 10, 70, panel_width, PANEL, [p[0] for p in points], [p[1] for p in points], ("x in m", "y in m", "from above"), True)
    side = Axes(
        2 * MARGIN + 30 + panel_width, 70, panel_width, PANEL, [p[0] for p in points], [p[2] for p in points], ("x in m", "z in m", "from the side"), True
    )  # fmt: skip
    times = answer["time_s"]
    below = Axes(MARGIN + 10, 70 + PANEL + 80, WIDTH - 2 * MARGIN - 20, 140, times, [0, 1], ("time in s", "objectivity", "how far the motion belongs to the object; contacts shaded"), False)
    height = 70 + PANEL + 80 + 140 + 90
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="12" fill="{INK}">',
        f'<rect width="{WIDTH}" height="{height}" fill="white"/>',
        f'<text x="{MARGIN}" y="32" font-size="18">Exemplar: a skill at {html.escape(title)}</text>',
    ]
    for axes, pick in ((top, lambda p: (p[0], p[1])), (side, lambda p: (p[0], p[2]))):
        out += axes.frame()
        for path, colour, width, dash, _ in paths:
            out.append(axes.line([pick(p) for p in path], colour, width, dash))
        out += [axes.cross(pick(p), CONTACT) for p in contacts]
    for contact in answer["contacts"]:
        x0, y0 = below.at(times[contact["first"]], 1)
        x1, y1 = below.at(times[contact["last"]], 0)
        out.append(f'<rect x="{x0:.1f}" y="{y0:.1f}" width="{max(1, x1 - x0):.1f}" height="{y1 - y0:.1f}" fill="{CONTACT}" opacity="0.15"/>')
    out += below.frame()
    for column in zip(*answer["objectivity"]):
        out.append(below.line(list(zip(times, column)), ANSWER, 2))
    x = MARGIN + 10
    y = height - 20
    for label, colour, dash in dict.fromkeys((p[4], p[1], p[3]) for p in paths):
        out.append(f'<line x1="{x}" x2="{x + 26}" y1="{y - 4}" y2="{y - 4}" stroke="{colour}" stroke-width="3" stroke-dasharray="{dash}"/>')
        out.append(text(x + 32, y, label, "start"))
        x += 48 + 7 * len(label)
    out.append(f'<path d="M{x} {y - 10}l12 12m0 -12l-12 12" stroke="{CONTACT}" stroke-width="2.5"/>')
    out.append(text(x + 20, y, "contact", "start"))
    out.append("</svg>")
    target.write_text("\n".join(out), encoding="utf-8")
