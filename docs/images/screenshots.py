#!/usr/bin/env python3
"""Makes the screenshots of the documentation from the simulated machine: docs/images/screen-*.png.

    cargo xtask web
    pip install playwright pyte   # PyPI; the browser is Debian's chromium
    docs/images/screenshots.py [--check FOLDER]

`quadrant` is the one in the search path, or that of the variable QUADRANT. With --check every page is also taken whole at 390, 820
and 1280 px, and the live view at three sizes of the terminal, into FOLDER, and a page that is wider than its window is an error.
"""

import argparse
import fcntl
import html
import os
import pathlib
import pty
import select
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time

import pyte
from playwright.sync_api import sync_playwright

IMAGES = pathlib.Path(__file__).resolve().parent
BENCH = IMAGES.parents[1] / "target/web/quadrant-bench.html"
QUADRANT = os.environ.get("QUADRANT", "quadrant")
WIDTHS = (390, 820, 1280)
TERMINALS = ((80, 24), (100, 32), (140, 40))
MOST_BYTES = 150_000
# What is typed for the live view, and the seconds that pass before the next: a circle, watched.
TYPED = [
    ("enable\r", 0.5),
    ("home\r", 0.5),
    ("wait homed\r", 8),
    ("circle --radius-mm 10 --feed-mm-min 600\r", 0.5),
    ("watch x.error,x.output --gain x/feedback/pid/kp_v_per_mm\r", 1.5),
    ("g", 0.2),
    ("g", 5),
]


def terminal(columns, rows):
    """The live view as a page, from what the program writes to a terminal of a size."""
    process, descriptor = pty.fork()
    if process == 0:
        os.environ["TERM"] = "xterm-256color"
        os.execvp(QUADRANT, [QUADRANT, "connect", "--simulated=commissioned"])
    fcntl.ioctl(descriptor, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    screen = pyte.Screen(columns, rows)
    stream = pyte.ByteStream(screen)

    def wait(seconds):
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            if select.select([descriptor], [], [], left)[0]:
                written = os.read(descriptor, 65536)
                if b"\x1b[6n" in written:  # It asks where the cursor is.
                    os.write(descriptor, b"\x1b[1;1R")
                # pyte has no second screen.
                before, other, after = written.partition(b"\x1b[?1049h")
                stream.feed(before)
                if other:
                    screen.reset()
                    stream.feed(after)

    wait(1.5)
    for keys, seconds in TYPED:
        os.write(descriptor, keys.encode())
        wait(seconds)
    os.kill(process, signal.SIGTERM)
    os.waitpid(process, 0)
    os.close(descriptor)
    return "\n".join("".join(cell(screen.buffer[row][column]) for column in range(columns)) for row in range(rows))


# Names of pyte's colours; all others are six hexadecimal digits.
COLOURS = {"black": "16181c", "brown": "f0c060", "green": "5fd39a", "red": "ff8a80", "cyan": "7cc0ee", "blue": "7cc0ee", "white": "e4e4e1"}


def cell(of):
    front = COLOURS["white"] if of.fg == "default" else COLOURS.get(of.fg, of.fg)
    back = COLOURS["black"] if of.bg == "default" else COLOURS.get(of.bg, of.bg)
    if of.reverse:
        front, back = back, front
    style = f"color:#{front};background:#{back}" + (";font-weight:bold" if of.bold else "")
    return f'<i style="{style}">{html.escape(of.data)}</i>'


def terminal_page(text):
    style = "body{margin:0} i{font-style:normal}"
    font = "pre{margin:0;padding:12px;width:fit-content;background:#16181c;font:15px/1.2 'DejaVu Sans Mono',monospace}"
    return f"<meta charset=utf-8><title>live view</title><style>{style}{font}</style><pre>{text}</pre>"


def check_size(path):
    size = path.stat().st_size
    print(f"{path.name}: {size} bytes")
    if size > MOST_BYTES:
        sys.exit(f"{path} has more than {MOST_BYTES} bytes")


def drawn(page):
    """Waits until everything is drawn: figures are drawn when they come into sight."""
    page.evaluate(
        "(async () => { for (let y = 0; y < document.documentElement.scrollHeight; y += 300) {"
        " scrollTo({ top: y, behavior: 'instant' }); await new Promise((done) => setTimeout(done, 150)); }"
        " scrollTo({ top: 0, behavior: 'instant' }); })()"
    )
    page.wait_for_timeout(300)


def whole(browser, name, address, folder):
    """Takes a page whole at every width."""
    for width in WIDTHS:
        page = browser.new_page(viewport={"width": width, "height": 900})
        page.goto(address)
        page.wait_for_timeout(2500)
        drawn(page)
        page.screenshot(path=folder / f"{name}-{width}.png", full_page=True)
        if (over := page.evaluate("document.documentElement.scrollWidth - innerWidth")) > 0:
            sys.exit(f"{name} is {over} px too wide for {width} px")
        page.close()


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--check", type=pathlib.Path, metavar="FOLDER")
    folder = options.parse_args().check
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place, sync_playwright() as playwright:
        place = pathlib.Path(place)
        for command in (
            "commission --axis x --machine simulated --travel 200 --out x",
            "compare --out compared",
        ):
            subprocess.run([QUADRANT, *command.split()], cwd=place, check=True, stdout=subprocess.DEVNULL)
        pages = {
            "commission": (place / "x/x/commission.html").as_uri(),
            "comparison": (place / "compared/comparison.html").as_uri(),
            "bench": BENCH.as_uri(),
        }
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        desk = {"width": 1280, "height": 800}

        page = browser.new_page(viewport=desk)
        page.goto(pages["bench"])
        page.click("#guide-next")
        page.click("#guide-next")
        page.click("#guide-actions button")
        page.wait_for_timeout(500)
        page.screenshot(path=IMAGES / "screen-bench.png")

        page = browser.new_page(viewport=desk)
        page.goto(pages["commission"])
        drawn(page)
        first, last = page.locator("h2").first.bounding_box(), page.locator("figure").nth(1).bounding_box()
        clip = {"x": first["x"] - 10, "y": first["y"], "width": last["width"] + 20, "height": last["y"] + last["height"] - first["y"]}
        page.screenshot(path=IMAGES / "screen-commission.png", full_page=True, clip=clip)

        page.goto(pages["comparison"])
        drawn(page)
        reversal = page.locator("figure", has_text="Tracking error about one reversal at 5 mm/s").first
        reversal.screenshot(path=IMAGES / "screen-reversal.png")

        page = browser.new_page(viewport=desk)
        for size in TERMINALS if folder else TERMINALS[1:2]:
            page.set_content(terminal_page(terminal(*size)))
            picture = page.locator("pre")
            if folder:
                picture.screenshot(path=folder / f"watch-{size[0]}.png")
            if size == TERMINALS[1]:
                picture.screenshot(path=IMAGES / "screen-watch.png")

        if folder:
            for name, address in pages.items():
                whole(browser, name, address, folder)
        browser.close()
    for name in ("bench", "commission", "reversal", "watch"):
        check_size(IMAGES / f"screen-{name}.png")


main()
