r"""Equations as MathML, made at build time: no script, no request, text that can be searched and copied.

``\tag{4.3}`` numbers an equation of a display and makes it a target: ``#eq-4-3``. The glyphs are those of STIX Two
Math, which the package ziamath brings along.
"""

import html
import re
from importlib.resources import files as resources

from latex2mathml.converter import convert
from mkdocs.structure.files import File

FONT = "STIXTwoMath-Regular.ttf"
INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
DISPLAY = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)
SYMBOL = r"(<m(?:[ion]|row)>[^<]*</m(?:[ion]|row)>)"
LOW_PRIME = re.compile(rf"<(msup|msubsup)>{SYMBOL}{SYMBOL}?<mi>&#x02032;</mi></\1>")
TAG = re.compile(r"\\tag\{([\d.]+)\}")


def on_files(files, config):
    """Add the font."""
    source = resources("ziamath") / "fonts" / FONT
    files.append(File.generated(config, f"assets/{FONT}", abs_src_path=str(source)))
    return files


def on_page_content(content, page, config, files):
    """Turn every formula into MathML."""
    content = INLINE.sub(lambda found: convert(html.unescape(found[1])), content)
    content = DISPLAY.sub(lambda found: display(html.unescape(found[1])), content)
    return LOW_PRIME.sub(_primed, content)


def display(latex):
    """Return a display, with its number if it has one."""
    number = TAG.search(latex)
    body = convert(TAG.sub("", latex).strip(), display="block")
    if number is None:
        return f'<div class="equation">{body}</div>'
    anchor = f"eq-{number[1].replace('.', '-')}"
    return f'<div class="equation" id="{anchor}">{body}<a href="#{anchor}">({number[1]})</a></div>'


def _primed(found):
    """Set a prime beside its symbol: the glyph is a raised one by itself, as an exponent it would hardly be seen."""
    symbol = f"<msub>{found[2]}{found[3]}</msub>" if found[3] else found[2]
    return f'<mrow>{symbol}<mo lspace="0" rspace="0">&#x02032;</mo></mrow>'
