#!/usr/bin/env python3
"""Draws docs/images/circle-animated.svg, the README's picture, for light and dark pages.

    quadrant circle --plane xy --radius-mm 15 --feed-mm-min 1000 --out circle
    docs/images/circle_animation.py circle/figures/circle-polar-xy.csv
"""

import csv
import math
import pathlib
import sys

RADIUS = 200.0
# Pixels for a um of radial deviation.
SCALE = 1.6
BINS = 720
LAWS = [("best PID, clockwise", "pid", "the best PID"), ("best PID + static + GMS, clockwise", "ours", "with friction fed forward")]
STYLE = """
text { font: 15px system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', Arial, sans-serif; fill: #1b1b1b }
.ideal { stroke: #999; stroke-width: 1; fill: none }
.pid { stroke: #d55e00 } .ours { stroke: #0072b2 }
path { fill: none; stroke-width: 2.5; stroke-linejoin: round; stroke-dasharray: 4000; animation: mill 10s linear infinite }
@keyframes mill { from { stroke-dashoffset: 4000 } 75% { stroke-dashoffset: 0 } to { stroke-dashoffset: 0 } }
@media (prefers-reduced-motion: reduce) { path { animation: none } }
@media (prefers-color-scheme: dark) { text { fill: #e6e6e6 } .pid { stroke: #ff9d5c } .ours { stroke: #56b4e9 } .ideal { stroke: #777 } }
"""


def curve(rows):
    """A path around the circle; of each bin the largest deviation."""
    largest = {}
    for angle, deviation in rows:
        place = int((angle + math.pi) / (2 * math.pi) * BINS) % BINS
        if abs(deviation) >= abs(largest.get(place, 0.0)):
            largest[place] = deviation
    points = []
    # Clockwise from the left.
    for place in sorted(largest, reverse=True):
        angle = (place + 0.5) / BINS * 2 * math.pi - math.pi
        radius = RADIUS + SCALE * largest[place]
        points.append(f"{radius * math.cos(angle):.1f} {-radius * math.sin(angle):.1f}")
    return "M" + "L".join(points) + "Z"


def main():
    series = {}
    with open(sys.argv[1], newline="") as file:
        for name, angle, deviation in list(csv.reader(file))[1:]:
            series.setdefault(name, []).append((float(angle), float(deviation)))
    paths = "".join(f'<path class="{kind}" pathLength="4000" d="{curve(series[name])}"/>\n' for name, kind, _ in LAWS)
    legend = "".join(
        f'<line class="{kind}" x1="-70" x2="-35" y1="{y}" y2="{y}" stroke-width="3"/><text x="-25" y="{y + 5}">{words}</text>\n'
        for (_, kind, words), y in zip(LAWS, (-12, 14))
    )
    bar = 50 * SCALE
    scale = f'<line class="ideal" x1="-{bar / 2}" x2="{bar / 2}" y1="50" y2="50"/><text x="0" y="70" text-anchor="middle">50 µm</text>\n'
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-290 -290 580 580" width="580" height="580">\n<style>{STYLE}</style>\n'
        f'<circle class="ideal" r="{RADIUS}"/>\n{paths}{legend}{scale}</svg>\n'
    )
    (pathlib.Path(__file__).parent / "circle-animated.svg").write_text(svg)


main()
