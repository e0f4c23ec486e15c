"""A terminal's text as an SVG picture."""

import html
import re

LINE, COLUMN, MARGIN = 17, 7.83, 16
COLOURS = [
    (r"^\$ .*", "#ffffff"),
    (r"\b(identified|consistent|settled)\b", "#7ee787"),
    (r"\b(weak|model_suspect|unsettled)\b", "#e3b341"),
    (r"\bnot_observable\b", "#ff7b72"),
    (r"-?\d[\d.]*(e-?\d+)?( %)?", "#a5d6ff"),
]


def coloured(line):
    """The line's text spans, each with the first colour whose pattern it matches."""
    pattern = "|".join(f"(?P<c{n}>{regex})" for n, (regex, _) in enumerate(COLOURS))
    spans, end = [], 0
    for match in re.finditer(pattern, line):
        colour = next(COLOURS[n][1] for n in range(len(COLOURS)) if match[f"c{n}"])
        spans.append(html.escape(line[end : match.start()]))
        spans.append(f'<tspan fill="{colour}">{html.escape(match[0])}</tspan>')
        end = match.end()
    return "".join(spans) + html.escape(line[end:])


def places(line):
    """Where the line begins, or each of its characters: dots of Braille often come from a font of another width."""
    if not re.search("[\u2800-\u28ff]", line):
        return MARGIN
    return " ".join(f"{MARGIN + COLUMN * column:.1f}" for column in range(len(line)))


def picture(text):
    """The text, a line below the other, in the colours of a terminal."""
    lines = [line.rstrip() for line in text.rstrip().split("\n")]
    width = 2 * MARGIN + COLUMN * max(map(len, lines))
    height = 2 * MARGIN + LINE * len(lines)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height}" '
        f'font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" font-size="13" fill="#c9d1d9">',
        f'<rect width="{width:.0f}" height="{height}" rx="8" fill="#0d1117"/>',
    ]
    for number, line in enumerate(lines):
        y = MARGIN + LINE * number + 13
        parts.append(f'<text x="{places(line)}" y="{y}" xml:space="preserve">{coloured(line)}</text>')
    return "\n".join([*parts, "</svg>", ""])
