"""The page of the explorer in a browser: how a test opens it, types into it and reads it."""

import json

SHOWN = "Boolean(window.explorer?.shown() && window.explorer.settled())"


def opened(browser, html, fragment=""):
    browser.ask("Page.navigate", url="about:blank")
    browser.ask("Page.navigate", url=html.as_uri() + fragment)
    browser.until(f"document.readyState === 'complete' && {SHOWN}")
    return browser


def box(name):
    """The first box of a number."""
    return f"document.querySelector('input[data-of={name}]')"


def put(page, name, text, leave=True):
    """Type a text into the first box of a number, and leave it."""
    page.value(f"{box(name)}.value = {json.dumps(text)}")
    for event in ("input", "blur")[: 1 + leave]:
        page.value(f"{box(name)}.dispatchEvent(new Event('{event}'))")
    page.until(SHOWN)


def text(page, name):
    page.until(SHOWN)
    return page.value(f"document.getElementById('{name}').textContent")


def state(page):
    page.until(SHOWN)
    return page.value("explorer.state()")


def chosen(page, name):
    of = "document.getElementById('scene')"
    page.value(f"{of}.value = {json.dumps(name)}; {of}.dispatchEvent(new Event('change'))")
    page.until(SHOWN)
