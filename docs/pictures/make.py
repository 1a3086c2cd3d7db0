"""The pictures of README, made from a real run: python3 docs/pictures/make.py [DESCRY]

DESCRY is the binary (default: descry). Chromium draws the page of the run, light and dark; Pillow makes the images small. The
terminal is recorded at 80 columns and becomes an SVG whose lines appear at the pace of the run.
"""

import html
import os
import pathlib
import pty
import re
import struct
import subprocess
import sys
import tempfile
import time

import fcntl
import termios

from PIL import Image

HERE = pathlib.Path(__file__).resolve().parent
COLUMNS, ROWS, COMMAND = 80, 22, ["find", "cup A", "--seed", "10", "--run", "run"]
WIDTH, HEIGHT = 1280, 800  # of the picture of the page, pixels
SECONDS = 12.0  # that the recording is stretched to
COLOURS = {"31": "#f47067", "32": "#6bc46d", "33": "#daaa3f", "34": "#6cb6ff", "35": "#dcbdfb", "36": "#76e3ea", "2": "#8b949e", "90": "#8b949e"}


def record(descry: str, folder: str) -> list[tuple[float, str]]:
    """Lines that the run prints on a terminal, each with its second."""
    pid, terminal = pty.fork()
    if pid == 0:
        os.chdir(folder)
        os.execvp(descry, ["descry", *COMMAND])
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 200, COLUMNS, 0, 0))
    began, text, lines = time.monotonic(), "", []
    while True:
        try:
            chunk = os.read(terminal, 65536)
        except OSError:
            break
        if not chunk:
            break
        text += chunk.decode(errors="replace")
        *whole, text = text.split("\n")
        now = time.monotonic() - began
        # What a line overwrites, such as a progress bar, is not shown.
        lines += [(now, line.rstrip("\r").rsplit("\r", 1)[-1]) for line in whole]
    _, status = os.waitpid(pid, 0)
    assert status == 0, f"{COMMAND} ended with {os.waitstatus_to_exitcode(status)}"
    return lines


def styled(line: str) -> str:
    """A line with its colours as SVG; other control sequences are dropped."""
    line = re.sub(r"\x1b\[[0-9;?]*[A-LN-Za-ln-z]", "", line)
    out, colour, bold = "", None, False
    for part in re.split(r"(\x1b\[[0-9;]*m)", line):
        if code := re.fullmatch(r"\x1b\[([0-9;]*)m", part):
            for one in (code[1] or "0").split(";"):
                if one == "0":
                    colour, bold = None, False
                elif one == "1":
                    bold = True
                elif one in COLOURS:
                    colour = COLOURS[one]
        elif part:
            style = (f' fill="{colour}"' if colour else "") + (' font-weight="bold"' if bold else "")
            out += f"<tspan{style}>{html.escape(part)}</tspan>" if style else html.escape(part)
    return out


def terminal_svg(lines: list[tuple[float, str]]) -> str:
    """The recording: each line appears at its time, the whole begins anew after a pause."""
    typed = " ".join(f'"{word}"' if " " in word else word for word in ["descry", *COMMAND[:2]])
    last = max(at for at, _ in lines) or 1.0
    # Lines that came at once follow each other by a blink, so that an eye can follow.
    starts, at = [], 0.8
    for second, _ in lines:
        at = max(at + 0.12, 0.8 + second / last * SECONDS)
        starts.append(at)
    whole = starts[-1] + 6.0
    row, left, top = 17, 14, 44
    wide, high = left * 2 + int(COLUMNS * 7.83), top + row * (ROWS - 1) + 12
    shown = [f'<text x="{left}" y="{top}" xml:space="preserve"><tspan fill="#6bc46d">$</tspan> {html.escape(typed)}</text>']
    rules, moves = [], []
    for n, ((_, line), start) in enumerate(zip(lines, starts)):
        part = start / whole * 100
        rules.append(f"@keyframes l{n}{{0%{{opacity:0}}{part:.2f}%,100%{{opacity:1}}}}#l{n}{{animation:l{n} {whole:.1f}s step-end infinite}}")
        if n + 2 > ROWS:
            moves.append(f"{part:.2f}%{{transform:translateY({-row * (n + 2 - ROWS)}px)}}")
        shown.append(f'<text id="l{n}" x="{left}" y="{top + row * (n + 1)}" xml:space="preserve">{styled(line)}</text>')
    last_move = f"100%{{transform:translateY({-row * max(0, len(lines) + 1 - ROWS)}px)}}"
    rules.append(f"@keyframes up{{0%{{transform:none}}{''.join(moves)}{last_move}}}#all{{animation:up {whole:.1f}s step-end infinite}}")
    still = "@media (prefers-reduced-motion:reduce){text{animation:none!important}}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high}" width="{wide}" height="{high}" role="img">'
        f"<title>descry finds cup A: what a terminal shows</title>"
        f"<style>text{{font:13px ui-monospace,'DejaVu Sans Mono',Menlo,Consolas,monospace;fill:#e6edf3}}{''.join(rules)}{still}</style>"
        f'<clipPath id="screen"><rect y="{top - 13}" width="{wide}" height="{row * ROWS}"/></clipPath>'
        f'<rect width="{wide}" height="{high}" rx="8" fill="#0d1117"/>'
        + "".join(f'<circle cx="{18 + 18 * n}" cy="16" r="5" fill="{c}"/>' for n, c in enumerate(["#ff5f57", "#febc2e", "#28c840"]))
        + '<g clip-path="url(#screen)"><g id="all">'
        + "\n".join(shown)
        + "</g></g></svg>\n"
    )


def picture(page: pathlib.Path, scheme: str, folder: str) -> None:
    """The upper part of the page as a browser draws it."""
    png = pathlib.Path(folder, f"{scheme}.png")
    subprocess.run(
        ["chromium", "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         f"--blink-settings=preferredColorScheme={0 if scheme == 'dark' else 1}", "--hide-scrollbars",
         "--virtual-time-budget=4000", f"--window-size={WIDTH},{HEIGHT}", f"--screenshot={png}", f"file://{page}"],
        check=True, capture_output=True,
    )
    Image.open(png).convert("RGB").quantize(128, dither=Image.Dither.NONE).save(HERE / f"run-{scheme}.png", optimize=True)


def main() -> None:
    descry = str(pathlib.Path(sys.argv[1]).resolve()) if len(sys.argv) > 1 else "descry"
    with tempfile.TemporaryDirectory() as folder:
        (HERE / "terminal.svg").write_text(terminal_svg(record(descry, folder)))
        page = pathlib.Path(folder, "page.html")
        subprocess.run([descry, "show", "run", "--html", page], cwd=folder, check=True, capture_output=True)
        for scheme in ["light", "dark"]:
            picture(page, scheme, folder)
    for made in ["terminal.svg", "run-light.png", "run-dark.png"]:
        print(f"docs/pictures/{made}: {(HERE / made).stat().st_size} bytes")


main()
