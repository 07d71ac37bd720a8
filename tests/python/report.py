"""`report.html` in a headless Chromium: the view draws, turns and plays by mouse and keys, the page
loads nothing, and without WebGL or scripts the pictures stay."""

import csv
import json
import tempfile
from pathlib import Path

import numpy as np

from _browser import WITH_WEBGL, WITHOUT_WEBGL, Browser
from _compare import CHECKOUT, Tally, run_program

# More than the page keeps, so that it interpolates between kept frames.
FRAMES = 90
SCENE = CHECKOUT / "fixtures/scenes/phantom-small.toml"
OUTPUT = "output={ report = true, pictures = true }"
HOSTILE = "<img src=x onerror=alert(1)>'\"&.toml"


def run(scene, out, *words):
    process = run_program("run", scene, "--out", out, "--set", OUTPUT, *words)
    if process.returncode != 0:
        raise SystemExit(f"cutis run {scene}: {process.stderr}")
    return out / "report.html"


def share_of_change(a, b):
    """Share of the pixels that differ visibly between two pictures."""
    if a.shape != b.shape:
        return 1.0
    return float((np.abs(a.astype(int) - b.astype(int)).max(axis=2) > 12).mean())


def expect(problems, condition, text):
    if not condition:
        problems.append(text)


def text(browser, selector):
    return browser.evaluate(f"document.querySelector({json.dumps(selector)}).textContent")


def visible(browser, selector):
    return browser.evaluate(f"document.querySelector({json.dumps(selector)}).getClientRects().length > 0")


def picture_problems(browser):
    """The view is not empty, and each action changes it."""
    problems = []
    start = browser.canvas()
    drawn = start[..., 3] > 0
    colors = len(np.unique(start[drawn].reshape(-1, 4), axis=0)) if drawn.any() else 0
    expect(problems, 0.2 < drawn.mean(), f"{drawn.mean():.2f} of the pixels are drawn")
    expect(problems, colors > 500, f"{colors} colors")

    def changes(what, action, least):
        action()
        share = share_of_change(start, browser.canvas())
        expect(problems, share > least, f"{what} changes {share:.4f} of the pixels")

    def returns(what):
        browser.focus("#canvas")
        browser.press("0")
        share = share_of_change(start, browser.canvas())
        expect(problems, share == 0.0, f"after {what} the key 0 does not return to the wound: {share:.4f}")

    actions = {
        "a drag": lambda: browser.drag("#canvas", 120, 30),
        "a drag with Shift": lambda: browser.drag("#canvas", 90, 40, modifiers=8),
        "the button to zoom": lambda: browser.click("[data-key='+']"),
        "the view from the left": lambda: browser.click("[data-view=L]"),
        "the whole skin": lambda: browser.click("[data-view=whole]"),
    }
    for what, action in actions.items():
        changes(what, action, 0.02)
        returns(what)
    for key, modifiers in [("ArrowLeft", 0), ("ArrowUp", 0), ("ArrowRight", 8), ("-", 0)]:
        browser.focus("#canvas")
        changes(f"the key {key}", lambda: browser.press(key, modifiers), 0.02)
        returns(f"the key {key}")
    changes("the color of tissue", lambda: browser.click("input[value=tissue]"), 0.02)
    browser.click("input[value=moved]")
    return problems


def time_problems(browser, table):
    """The slider shows the states by keys, with the values of `frames.csv`, and marks the plots."""
    problems = []
    after = browser.canvas()
    browser.focus("#time")
    values = []
    pictures = []
    for key in ["Home", "ArrowRight", "ArrowRight"]:
        browser.press(key)
        values.append(browser.evaluate("Number(document.querySelector('#time').value)"))
        pictures.append(browser.canvas())
    expect(problems, values == [0, 1, 2], f"the keys lead to the frames {values}")
    for first, second in [(0, 1), (1, 2)]:
        share = share_of_change(pictures[first], pictures[second])
        expect(problems, share > 0.001, f"frames {first} and {second} differ in {share:.5f} of the pixels")
    mean = float(table[2]["gape_0_mean_mm"])
    shown, spoken = text(browser, "#state"), browser.evaluate("document.querySelector('#time').getAttribute('aria-valuetext')")
    expect(problems, f"opening, mean: {mean:.2f} mm" in shown and "frame 2" in shown, f"{shown!r}, not {mean:.2f} mm")
    expect(problems, "between the kept frames 0 and 3" in shown, f"{shown!r} does not say that it interpolates")
    expect(problems, spoken == shown, f"{spoken!r} is spoken, {shown!r} is shown")
    expect(problems, browser.evaluate("document.querySelector('#state').ariaLive") == "polite", "the values are not announced")
    cursor = """(() => {
        const svg = document.querySelector(".plot svg[data-x]");
        const [left, , right] = svg.dataset.area.split(" ").map(Number);
        const [low, high] = svg.dataset.x.split(" ").map(Number);
        const x = Number(svg.querySelector(".cursor").getAttribute("d").slice(1).split(" ")[0]);
        return low + ((x - left) / (right - left)) * (high - low);
    })()"""
    marked, time_s = browser.evaluate(cursor), float(table[2]["time_s"])
    expect(problems, abs(marked - time_s) < 1e-6, f"the plot marks {marked} s, not {time_s} s")

    browser.press("Home")
    before = browser.canvas()
    share = share_of_change(before, after)
    expect(problems, share > 0.02, f"before and after differ in {share:.4f} of the pixels")
    browser.click("#last")
    expect(problems, share_of_change(browser.canvas(), after) == 0.0, "the button After leads to another picture")
    browser.click("#first")
    expect(problems, share_of_change(browser.canvas(), before) == 0.0, "the button Before leads to another picture")

    browser.click("#play")
    browser.until(f"Number(document.querySelector('#time').value) >= {FRAMES} && document.querySelector('#play').textContent === 'Play'")
    expect(problems, share_of_change(browser.canvas(), after) == 0.0, "playing does not end at the last state")
    return problems


def calm_problems(browser):
    """With reduced motion only kept states are shown, one after the other."""
    problems = []
    browser.media(prefers_reduced_motion="reduce")
    browser.click("#first")
    watch = "window.seen = []; document.querySelector('#state').textContent; new MutationObserver(() => seen.push(Number(document.querySelector('#time').value))).observe(document.querySelector('#state'), { childList: true }); 1"
    browser.evaluate(watch)
    browser.click("#play")
    browser.until("seen.length > 2")
    browser.click("#play")
    seen = browser.evaluate("seen")
    expect(problems, all(value == int(value) for value in seen), f"frames {seen}")
    browser.media(prefers_reduced_motion="no-preference")
    browser.click("#last")
    return problems


def access_problems(browser):
    """Everything has a name, and the keys reach each control in the order of the page."""
    problems = []
    tree = browser.call("Accessibility.getFullAXTree")["nodes"]
    roles = {}
    for node in tree:
        if not node.get("ignored"):
            roles.setdefault(node.get("role", {}).get("value"), []).append(node.get("name", {}).get("value", ""))
    for role in ["button", "slider", "radio", "image"]:
        names = roles.get(role, [])
        expect(problems, names and all(names), f"{role}: {names}")
    expect(problems, any("skin" in name for name in roles.get("application", [])), f"the view has no name: {roles.keys()}")
    described = text(browser, "#view-text")
    expect(problems, "seen from" in described and "mm" in described, f"text alternative: {described!r}")
    browser.evaluate("document.activeElement.blur(); document.body.focus(); window.scrollTo(0, 0); 1")
    order = []
    browser.call("Page.bringToFront")
    browser.focus("#canvas")
    for _ in range(5):
        order.append(browser.evaluate("document.activeElement.id"))
        browser.press("Tab")
    expect(problems, order == ["canvas", "first", "time", "last", "play"], f"the order of the focus is {order}")
    return problems


def slice_problems(browser):
    """The slider of a slice moves the edge between the pictures."""
    problems = []
    shown = "document.querySelector('.compare .two img:nth-of-type(2)').style.clipPath"
    browser.focus(".compare input")
    first = browser.evaluate(shown)
    browser.press("ArrowRight")
    second = browser.evaluate(shown)
    browser.press("Home")
    expect(problems, (first, second) == ("inset(0px 0px 0px 50%)", "inset(0px 0px 0px 49%)"), f"{first}, {second}")
    expect(problems, browser.evaluate(shown) == "inset(0px 0px 0px 100%)", "Home does not show the CT before")
    return problems


def look_problems(browser, page):
    """The page follows the colors of the system, and is no wider than a phone."""
    problems = []
    page_color = "getComputedStyle(document.body).backgroundColor"
    light = browser.evaluate(page_color)
    browser.media(prefers_color_scheme="dark")
    dark = browser.evaluate(page_color)
    expect(problems, light == "rgb(255, 255, 255)" and dark != light, f"{light}, {dark}")
    browser.media(prefers_color_scheme="light")
    for width in [360, 1280]:
        browser.size(width, 800, 2, width < 400)
        browser.open(page)
        wide = browser.evaluate("document.documentElement.scrollWidth")
        expect(problems, wide <= width, f"{wide} pixels on a screen of {width}")
        small = browser.canvas()
        expect(problems, (small[..., 3] > 0).mean() > 0.2, f"the view is empty at {width} pixels")
    return problems


def quiet_problems(browser):
    """The page wrote nothing to the console, and requested only itself."""
    foreign = [url for url in browser.requests if not url.startswith(("data:", "file:", "blob:"))]
    return [f"console: {line}" for line in browser.console] + [f"requested {url}" for url in foreign]


def control_problems(work, page):
    """Controls: a request, an error and an empty view are noticed, and the policy of the page keeps
    a strange picture and a strange script out."""
    problems = []
    strange = work / "strange.html"
    strange.write_text("<canvas id=canvas></canvas><script>fetch('http://127.0.0.1:9/x').catch(() => 0); console.error('x')</script>")
    with Browser(WITH_WEBGL) as browser:
        browser.open(strange)
        found = quiet_problems(browser)
        expect(problems, any("requested http" in line for line in found), f"a request is not noticed: {found}")
        expect(problems, any("console: error" in line for line in found), f"an error is not noticed: {found}")
        expect(problems, (browser.canvas()[..., 3] > 0).mean() == 0.0, "an empty view is not noticed")
    damaged = page.with_name("damaged.html")
    more = "<img src='http://127.0.0.1:9/x.png'><script>window.hostile = 1</script></main>"
    damaged.write_text(page.read_text().replace("</main>", more))
    with Browser(WITH_WEBGL) as browser:
        browser.open(damaged)
        expect(problems, browser.evaluate("window.hostile") is None, "a strange script runs")
        expect(problems, not [url for url in browser.requests if url.startswith("http")], "a strange picture is loaded")
        expect(problems, len(browser.console) > 1, "the policy reports nothing")
    return problems


def hostile_problems(work):
    """Names of a user do not become elements or scripts."""
    problems = []
    folder = work / "hostile"
    folder.mkdir()
    scene = folder / HOSTILE
    name = '"</script><script>window.hostile = 1</script><!--<b id=hostile>"'
    scene.write_text(SCENE.read_text().replace("width_mm = 7.0", f"width_mm = 7.0\nname = {name}"))
    with Browser(WITH_WEBGL) as browser:
        browser.open(run(scene, folder / "run", "--frames", "1"))
        expect(problems, browser.evaluate("window.hostile") is None, "a name runs as a script")
        expect(problems, browser.evaluate("document.querySelector('#hostile, img[src=x]')") is None, "a name is an element")
        expect(problems, HOSTILE.removesuffix(".toml") in browser.evaluate("document.title"), "the title is wrong")
        problems += quiet_problems(browser)
    return problems


def fallback_problems(page):
    """Without WebGL the slider and the plots work, and without scripts the pictures are there."""
    problems = []
    with Browser(WITHOUT_WEBGL) as browser:
        browser.open(page)
        expect(problems, not browser.evaluate("!!document.createElement('canvas').getContext('webgl2')"), "there is WebGL")
        expect(problems, visible(browser, "#view-missing") and not visible(browser, "#canvas"), "nothing says what is missing")
        loaded = browser.evaluate("[...document.images].filter((image) => image.naturalWidth > 100).length")
        expect(problems, loaded >= 9, f"{loaded} pictures")
        browser.focus("#time")
        browser.press("Home")
        expect(problems, "in the scan" in text(browser, "#state"), "the slider does nothing")
        problems += [line for line in quiet_problems(browser) if "WebGL" not in line]
    with Browser(WITH_WEBGL) as browser:
        browser.call("Emulation.setScriptExecutionDisabled", value=True)
        browser.call("Page.navigate", url=page.resolve().as_uri())
        browser.until("document.images.length > 8 && document.images[8].complete")
        expect(problems, visible(browser, "#view-missing") and not visible(browser, "#viewer"), "no word about scripts")
        expect(problems, not visible(browser, "#player") and not visible(browser, "#view-controls"), "dead controls are shown")
        first, second = (browser.evaluate(f"document.querySelectorAll('.two img')[{n}].getBoundingClientRect().x") for n in (0, 1))
        expect(problems, second > first + 20, "the slices lie on each other")
    return problems


def main():
    tally = Tally("report")
    with tempfile.TemporaryDirectory() as work:
        work = Path(work)
        page = run(SCENE, work / "run", "--frames", str(FRAMES))
        with open(work / "run" / "frames.csv", newline="") as file:
            table = list(csv.DictReader(file))
        with Browser(WITH_WEBGL) as browser:
            browser.size(1280, 900)
            browser.open(page)
            tally.check("pictures", picture_problems(browser))
            tally.check("time", time_problems(browser, table))
            tally.check("reduced motion", calm_problems(browser))
            tally.check("access", access_problems(browser))
            tally.check("slices", slice_problems(browser))
            tally.check("look", look_problems(browser, page))
            tally.check("quiet", quiet_problems(browser))
        tally.check("controls", control_problems(work, page))
        tally.check("hostile names", hostile_problems(work))
        tally.check("fallback", fallback_problems(page))
    tally.finish()


if __name__ == "__main__":
    main()
