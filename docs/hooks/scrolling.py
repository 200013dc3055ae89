"""Blocks of code are reached by the Tab key, so that those without a mouse can scroll them."""

BLOCK = "<pre><span></span><code>"


def on_page_content(content, page, config, files):
    """Make the blocks of a page focusable."""
    return content.replace(BLOCK, BLOCK.replace("<code>", '<code tabindex="0">'))
