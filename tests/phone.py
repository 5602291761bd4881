"""Letters of figures as a phone shows them."""

from matplotlib.figure import Figure
from matplotlib.text import Text

PHONE = 358.0
"""Width of a picture on a screen of 390 pixels."""
LEAST = 7.0
"""Height of letters that are read there without a glass [pixels]."""


def height(points: float, inches: float) -> float:
    """Letters of this size, in a picture of this width that fills a phone [pixels]."""
    return points / 72.0 * PHONE / inches


def smallest(figure: Figure) -> float:
    """Height of the smallest letters of a figure there [pixels]."""
    figure.draw_without_rendering()
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    return height(min(text.get_fontsize() for text in texts), figure.get_figwidth())
