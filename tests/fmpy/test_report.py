"""The report of a diagnosis in a browser: it draws, zooms, fits a phone, prints, and takes any name for what it is."""

import base64
import json
import shutil
import subprocess
import time
import urllib.request
from contextlib import suppress

import pytest
import websocket

from support import ROOT, run

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--remote-debugging-port=0",
)
PHONE, DESKTOP = 390, 1200
NARROWEST = 360


class Browser:
    """Headless Chromium over the DevTools protocol; what a page does wrong is in `problems`."""

    def __init__(self, folder):
        program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
        assert program, "chromium is needed; tests/run installs it"
        self.process = subprocess.Popen([program, *FLAGS, f"--user-data-dir={folder}", "about:blank"],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port = self._port(folder / "DevToolsActivePort")
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with direct.open(f"http://127.0.0.1:{port}/json/list") as answer:
            (page,) = [target for target in json.load(answer) if target["type"] == "page"]
        self.socket = websocket.create_connection(page["webSocketDebuggerUrl"], suppress_origin=True, timeout=60)
        self.count, self.loaded, self.problems = 0, False, []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def _port(self, file):
        for _ in range(300):
            with suppress(FileNotFoundError, IndexError):
                return int(file.read_text().split()[0])
            assert self.process.poll() is None, "chromium ended at once"
            time.sleep(0.1)
        raise AssertionError("chromium did not open its port")

    def call(self, method, **parameters):
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.recv())
            if message.get("id") == self.count:
                assert "error" not in message, message
                return message["result"]
            self._note(message.get("method"), message.get("params", {}))

    def _note(self, method, parameters):
        if method == "Page.loadEventFired":
            self.loaded = True
        if method == "Runtime.exceptionThrown":
            self.problems.append(parameters["exceptionDetails"]["exception"].get("description"))
        if method == "Log.entryAdded" and parameters["entry"]["level"] in ("warning", "error"):
            self.problems.append(parameters["entry"]["text"])
        if method == "Network.requestWillBeSent" and not parameters["request"]["url"].startswith(("file:", "data:")):
            self.problems.append(f"asks for {parameters['request']['url']}")

    def open(self, path, width=DESKTOP, height=900, scheme="light"):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                  mobile=width < 600)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.loaded, self.problems = False, []
        self.call("Page.navigate", url=path.as_uri())
        while not self.loaded:
            self.evaluate("new Promise(done => setTimeout(done, 50))")
        self.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def evaluate(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def box(self, selector):
        """Left, top, width and height on the screen of the first such element."""
        return self.evaluate(f"""(() => {{
            const element = document.querySelector({json.dumps(selector)});
            element.scrollIntoView({{ block: "center" }});
            const box = element.getBoundingClientRect();
            return [box.left, box.top, box.width, box.height];
        }})()""")

    def drag(self, selector, start, end, modifiers=0):
        """Drags across the first such element, from one share of its width to another."""
        box = self.box(selector)
        y = box[1] + box[3] / 2
        for kind, share in (("mouseMoved", start), ("mousePressed", start), ("mouseMoved", (start + end) / 2),
                            ("mouseMoved", end), ("mouseReleased", end)):
            self.call("Input.dispatchMouseEvent", type=kind, x=box[0] + share * box[2], y=y, modifiers=modifiers,
                      button="none" if kind == "mouseMoved" else "left", buttons=int(kind != "mouseReleased"),
                      clickCount=int(kind != "mouseMoved"))

    def swipe(self, selector, start, end):
        """As `drag`, with a finger."""
        box = self.box(selector)
        self.call("Emulation.setTouchEmulationEnabled", enabled=True)
        for k in range(11):
            x = box[0] + box[2] * (start + (end - start) * k / 10)
            point = {"x": x, "y": box[1] + box[3] / 2}
            self.call("Input.dispatchTouchEvent", type="touchMove" if k else "touchStart", touchPoints=[point])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        self.call("Emulation.setTouchEmulationEnabled", enabled=False)

    def screenshot(self, path):
        shot = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(shot["data"]))

    def pdf(self, path):
        printed = self.call("Page.printToPDF", preferCSSPageSize=True, printBackground=False)
        path.write_bytes(base64.b64decode(printed["data"]))

    def close(self):
        with suppress(Exception):
            self.call("Browser.close")
        self.socket.close()
        self.process.wait(timeout=30)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


# Ends a script, opens a comment, breaks a line of JavaScript, looks like a tag and like an entity.
NASTY = "</script><!-- <script>alert(1)<b>&amp;\"'\u2028{{ 1 }}"


def nasty_recordings(folder):
    """A recording cut in two files whose names and columns try to get out of the page, with gaps in the signals.

    The names are equal, so that the page shows the folders too, which alone can hold a slash.
    """
    header, *rows = (ROOT / "data" / "dry_friction_20kg.csv").read_text().splitlines()
    middle, paths = len(rows) // 2, []
    for name, part in (("a<", rows[:middle]), ("b<", rows[middle:])):
        path = folder / name / NASTY.replace("</", "/", 1).lstrip("/")
        path.parent.mkdir(parents=True)
        lines = [f'{header},"{NASTY.replace(chr(34), chr(34) * 2)}"']
        for k, row in enumerate(part):
            time_, command, pressure, contraction, force, mass = row.split(",")
            if 300 <= k < 420:
                pressure, contraction, force = "", "", ""
            lines.append(",".join((time_, command, pressure, contraction, force, mass, "0")))
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        paths.append(path)
    return paths


KINDS = {
    "friction": ["dry_friction_20kg.csv", "dry_friction_60kg.csv"],
    "nominal": ["nominal_40kg.csv"],
    "prescribed": ["prescribed_motion.csv"],
    "nasty": None,
}


@pytest.fixture(scope="module", params=KINDS)
def report(request, sinew, tmp_path_factory):
    """The page of a diagnosis."""
    folder, files = tmp_path_factory.mktemp(request.param), KINDS[request.param]
    recordings = [ROOT / "data" / file for file in files] if files else nasty_recordings(folder)
    run(sinew, "diagnose", *recordings, "--out", folder / "out")
    return folder / "out" / "report.html"


# Shares of pixels that are not paper, of each plot.
INK = """[...document.querySelectorAll(".plot")].map((place) => {
    const canvas = place.querySelector("canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let ink = 0;
    for (let k = 3; k < data.length; k += 4) ink += data[k] > 40;
    return ink / (data.length / 4);
})"""


@pytest.mark.parametrize("width, scheme", [(NARROWEST, "light"), (PHONE, "dark"), (DESKTOP, "light")])
def test_draws_without_errors_and_fits(browser, report, tmp_path, note, width, scheme):
    browser.open(report, width, scheme=scheme)
    assert browser.problems == []
    overflow = browser.evaluate("document.documentElement.scrollWidth") - width
    assert overflow <= 0, f"{overflow} px wider than the screen"
    ink = browser.evaluate(INK)
    assert len(ink) >= 4 and min(ink) > 0.01, ink
    browser.screenshot(tmp_path / "report.png")
    note(f"report at {width} px, {scheme}: {tmp_path / 'report.png'}")


RANGE = "document.querySelector('output').value.split(' to ').map(parseFloat)"
PICTURES = "[...document.querySelector('.recording').querySelectorAll('canvas')].map(c => c.toDataURL())"
AREA = ".recording .u-over"


def test_drag_zooms_all_plots_of_a_recording(browser, report):
    browser.open(report)
    whole = browser.evaluate(RANGE)
    before = browser.evaluate(PICTURES)
    browser.drag(AREA, 0.25, 0.5)
    low, high = browser.evaluate(RANGE)
    quarter = (whole[1] - whole[0]) / 4
    assert low == pytest.approx(whole[0] + quarter, abs=0.1 * quarter)
    assert high == pytest.approx(whole[0] + 2 * quarter, abs=0.1 * quarter)
    after = browser.evaluate(PICTURES)
    assert all(a != b for a, b in zip(after, before, strict=True))
    browser.drag(AREA, 0.5, 0.25, modifiers=8)  # Shift
    moved = browser.evaluate(RANGE)
    assert moved[0] == pytest.approx(low + quarter / 4, abs=0.1 * quarter)
    assert moved[1] - moved[0] == pytest.approx(high - low, abs=0.02)
    browser.evaluate("document.querySelector('[data-tool=whole]').click()")
    assert browser.evaluate(RANGE) == whole
    assert browser.problems == []


def test_finger_zooms(browser, report):
    browser.open(report, PHONE)
    whole = browser.evaluate(RANGE)
    browser.swipe(AREA, 0.2, 0.7)
    low, high = browser.evaluate(RANGE)
    assert (high - low) / (whole[1] - whole[0]) == pytest.approx(0.5, abs=0.1)
    assert browser.problems == []


def test_other_variables_can_be_chosen(browser, report):
    browser.open(report)
    picture = "document.querySelector('[data-plot=dots] canvas').toDataURL()"
    before = browser.evaluate(picture)
    browser.evaluate("""(() => {
        const select = document.querySelector("[data-choice=variable]");
        select.selectedIndex = (select.selectedIndex + 1) % select.options.length;
        select.dispatchEvent(new Event("change"));
        return new Promise(done => setTimeout(done, 100));
    })()""")
    assert browser.evaluate(picture) != before
    assert browser.problems == []


def test_prints(browser, report, tmp_path, note):
    """On paper the page is light whatever the screen is, and the plots are there."""
    browser.open(report, scheme="dark")
    browser.pdf(tmp_path / "report.pdf")
    note(f"report printed: {tmp_path / 'report.pdf'}")
    assert (tmp_path / "report.pdf").stat().st_size > 50_000
    assert browser.problems == []


def test_names_stay_names(browser, report):
    """Nothing but the elements of the page, and the names as they are."""
    browser.open(report)
    assert browser.evaluate("document.querySelectorAll('script').length") == 3
    assert browser.evaluate("document.querySelectorAll('b').length") == 0
    if report.parent.parent.name.startswith("nasty"):
        text = browser.evaluate("document.body.textContent")
        assert text.count(NASTY) >= 4  # both recordings in the title line, both unused columns


def test_one_file(report):
    page = report.read_text()
    assert len(page.encode()) < 3_000_000
    assert not [word for word in ("<link", "<script src", 'src="http', "@import", "url(") if word in page]
