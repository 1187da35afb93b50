"""Checks a figure as a reader would: every text inside the picture, none on top of another."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text


def boxes(figure):
    """Return the visible texts of a figure with their boxes in pixels."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    out = []
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip() and text.get_window_extent(renderer).width > 0:
            out.append((text, text.get_window_extent(renderer)))
    return out


def shown(figure):
    """Return the boxes of texts that are drawn, without ticks beyond their axis."""
    found = boxes(figure)
    hidden = set()
    for ax in figure.axes:
        if not ax.get_visible():
            hidden |= {id(t) for t in ax.findobj(Text)}
        for axis, limits in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
            low, high = sorted(limits)
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
                if not low <= tick.get_loc() <= high or not axis.get_visible() or not ax.axison:
                    hidden |= {id(tick.label1), id(tick.label2)}
                for label in (tick.label1, tick.label2):
                    if not label.get_visible():
                        hidden.add(id(label))
    return [(t, b) for t, b in found if id(t) not in hidden]


def assert_readable(figure, overlap=0.15):
    """Fail when a text leaves the figure or covers a good part of another."""
    width, height = figure.canvas.get_width_height()
    texts = shown(figure)
    for text, box in texts:
        inside = box.x0 > -2 and box.y0 > -2 and box.x1 < width + 2 and box.y1 < height + 2
        assert inside, f"{text.get_text()!r} leaves the figure: {box.extents} of {width} x {height}"
    for k, (one, a) in enumerate(texts):
        for two, b in texts[k + 1 :]:
            across = min(a.x1, b.x1) - max(a.x0, b.x0)
            along = min(a.y1, b.y1) - max(a.y0, b.y0)
            if across > 0 and along > 0:
                share = across * along / min(a.width * a.height, b.width * b.height)
                assert share < overlap, f"{one.get_text()!r} covers {two.get_text()!r}"
