# SPDX-License-Identifier: Apache-2.0
"""The pages of reports in headless Chromium: what pointer, keys and links do, both themes, narrow windows, less motion.

    pages_browser_test.py SOURCE_DIR

Exit status 77 with the reason where no Chromium is found. A script that is added to a copy of the page does what a
reader does, and leaves what it finds in the document, which the browser prints.
"""
import html
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(sys.argv[1])
sys.dont_write_bytecode = True
sys.path.insert(0, str(SOURCE / "tests/tools/report"))

import made_reports as made  # noqa: E402

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
HEAD = """<head><script>
window.failures = [];
addEventListener('error', e => failures.push(e.message || 'a file is missing: ' + e.target.src), true);
</script>"""
# find(): what the page has; wait(): until the browser has followed a link; all results are values of JSON.
TAIL = """<script>
addEventListener('load', async () => {
  const $ = s => document.querySelector(s), $$ = s => [...document.querySelectorAll(s)];
  const wait = () => new Promise(done => setTimeout(done, 60));
  const press = (e, key) => e.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true, cancelable: true}));
  const type = (e, text) => { e.value = text; e.dispatchEvent(new Event('input', {bubbles: true})); };
  const choose = (e, value) => { e.value = value; e.dispatchEvent(new Event('change', {bubbles: true})); };
  const enter = e => e.dispatchEvent(new PointerEvent('pointerenter'));
  const seen = e => e.getClientRects().length > 0;
  let result;
  try { result = await (async () => { STEPS })(); } catch (error) { failures.push(error.stack); }
  const pre = document.createElement('pre');
  pre.id = 'found';
  pre.textContent = JSON.stringify({result, failures});
  document.body.append(pre);
});
</script></body>"""


def check(holds, what):
    if not holds:
        sys.exit(f"{what}")


def equal(is_, should_be, what=""):
    check(is_ == should_be, f"{what} {is_!r} instead of {should_be!r}")


def run(page, steps, *flags, size="1400,1000"):
    """Returns the value that the steps return in a browser's page."""
    page = pathlib.Path(page)
    text = page.read_text().replace("<head>", HEAD, 1)
    copy = page.with_name("steps.html")
    copy.write_text(TAIL.replace("STEPS", steps).join(text.rsplit("</body>", 1)))
    with tempfile.TemporaryDirectory() as profile:
        done = subprocess.run([BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}",
                               "--virtual-time-budget=20000", f"--window-size={size}", *flags, "--dump-dom",
                               copy.as_uri()], capture_output=True, text=True, timeout=120)
    found = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
    check(found, f"the page did not end its steps: {done.stderr[-2000:]}")
    found = json.loads(html.unescape(found[1]))
    equal(found["failures"], [], "errors of the page:")
    return found["result"]


def test_points_lead_to_rows_and_back(page, results):
    found = run(page, """
        const point = $('#point-run-8'), out = {};
        point.focus();
        const detail = point.closest('.plot').querySelector('.detail');
        out.name = detail.querySelector('h3').textContent;
        const facts = [...detail.querySelectorAll('dt')].map(dt => [dt.textContent, dt.nextSibling.textContent]);
        out.facts = Object.fromEntries(facts);
        out.shots = [...detail.querySelectorAll('img')].map(img => [img.getAttribute('src').split('/').pop(), img.alt]);
        out.hot = $$('tr.hot').map(r => r.id);
        point.dispatchEvent(new MouseEvent('click', {bubbles: true, cancelable: true}));
        await wait();
        out.target = [location.hash, document.activeElement.id, $('tr:target').id];
        $('#run-8 a').click();
        await wait();
        out.back = [location.hash, document.activeElement.id];
        press(document.activeElement, 'ArrowRight');
        out.next = document.activeElement.id;
        press(document.activeElement, 'ArrowLeft');
        press(document.activeElement, 'ArrowLeft');
        out.before = document.activeElement.id;
        out.stops = $$('.point[tabindex="0"]').length;
        enter($('#point-run-2'));
        out.pointed = detail.querySelector('h3').textContent;
        enter($('#run-3'));
        out.ofRow = [detail.querySelector('h3').textContent, $('#point-run-3').classList.contains('is-current')];
        detail.querySelector('.links a:last-child').click();
        await wait();
        out.viewer = [location.hash, $('.viewer select').selectedOptions[0].textContent];
        return out;""")
    first = results["runs"][8]
    equal(found["name"], first["label"])
    wrong = first["false_shadow_count"] + first["false_light_count"]
    equal(found["facts"]["Time, ms"], f"{first['time_ms']:.2f}")
    counts = f"{wrong:,} of {first['pair_count']:,} pairs".replace(",", "\u202f")
    equal(found["facts"]["Wrong pairs, %"], f"{100 * wrong / first['pair_count']:.3f} ({counts})")
    for heading in ("95 % interval", "False shadow, %", "False light, %", "Memory, MiB"):
        check(heading in found["facts"], found["facts"])
    equal([name for name, _ in found["shots"]], ["r8_color.png", "r8_error.png"])
    check(all(first["label"] in text for _, text in found["shots"]), found["shots"])
    equal(found["hot"], ["run-8"])
    equal(found["target"], ["#run-8", "run-8", "run-8"])
    equal(found["back"], ["#point-run-8", "point-run-8"])
    in_time = sorted((r["time_ms"], f"point-run-{i}") for i, r in enumerate(results["runs"]) if r["frame"] == 0)
    place = [name for _, name in in_time].index("point-run-8")
    equal(found["next"], in_time[place + 1][1], "right is slower:")
    equal(found["before"], in_time[place - 1][1], "left is faster:")
    equal(found["stops"], 2, "one stop of the tabulator a chart:")
    equal(found["pointed"], results["runs"][2]["label"])
    equal(found["ofRow"], [results["runs"][3]["label"], True])
    equal(found["viewer"], ["#pictures-run-3", f"{results['runs'][3]['label']}, builtin:atrium, frame 0"])


def test_tables_filter_and_sort(page, results):
    found = run(page, """
        const table = $('#run-0').closest('table'), out = {};
        const input = table.parentElement.previousElementSibling.querySelector('input');
        const shown = () => [...table.tBodies[0].rows].filter(seen).map(r => r.id);
        const heading = [...table.tHead.rows[0].cells].find(th => th.textContent === 'Time, ms');
        heading.querySelector('button').click();
        out.up = [heading.getAttribute('aria-sort'), shown()];
        heading.querySelector('button').click();
        out.down = [heading.getAttribute('aria-sort'), shown()];
        type(input, 'hybrid -all time<700');
        out.some = shown();
        out.said = input.nextElementSibling.textContent;
        out.faded = $$('.point.is-faded').length;
        type(input, 'no such run');
        out.none = shown();
        location.hash = '#run-0';
        await wait();
        out.cleared = [shown().length, input.value, document.activeElement.id];
        return out;""")
    runs = list(enumerate(results["runs"]))
    times = [f"run-{i}" for i, r in sorted(runs, key=lambda item: item[1]["time_ms"])]
    equal(found["up"], ["ascending", times])
    equal(found["down"], ["descending", times[::-1]])
    some = [f"run-{i}" for i, r in runs if "hybrid" in r["label"] and " all" not in r["label"] and r["time_ms"] < 700]
    check(some, "the filter leaves nothing")
    equal(sorted(found["some"]), sorted(some))
    equal(found["said"], f"{len(some)} of {len(runs)} lines")
    equal(found["faded"], len(runs) - len(some), "points of hidden lines:")
    equal([found["none"], found["cleared"]], [[], [len(runs), "", "run-0"]])


def test_frames_and_series(page, results):
    found = run(page, """
        const out = {plots: $$('.plot').map(seen)}, select = $('.plot-select');
        choose(select, 'plot-1');
        out.other = $$('.plot').map(seen);
        $('#run-1 a').click();
        await wait();
        out.linked = [$$('.plot').map(seen), select.value, document.activeElement.id];
        const button = $('#plot-0 .legend button');
        const members = () => $$('#plot-0 .point[data-series="0"]').filter(seen).length;
        out.on = members();
        button.click();
        out.off = [members(), button.getAttribute('aria-pressed')];
        return out;""")
    equal([found["plots"], found["other"]], [[True, False], [False, True]])
    equal(found["linked"], [[True, False], "plot-0", "point-run-1"])
    check(found["on"] > 0 and found["off"] == [0, "false"], found)


def test_viewer(page, results):
    found = run(page, """
        const viewer = $('.viewer'), stage = $('.stage'), out = {};
        const [which, left, right] = viewer.querySelectorAll('select');
        const sources = () => [...stage.querySelectorAll('img')].map(img => img.src.split('/').pop());
        out.first = sources();
        out.strip = [...$$('.strip img')].map(img => [img.src.split('/').pop(), img.naturalWidth, img.alt !== '']);
        $$('.strip button')[2].click();
        out.error = sources();
        choose(which, [...which.options].find(o => o.textContent.startsWith('maps')).value);
        out.kept = sources();
        choose(right, [...right.options].find(o => o.textContent.startsWith('embree,')).value);
        out.runs = sources();
        press(stage, 'x');
        out.exchanged = sources();
        press(stage, '+');
        press(stage, '+');
        press(stage, 'ArrowRight');
        out.moves = $$('.viewer .pane').map(pane => {
          const m = new DOMMatrix(getComputedStyle(pane.querySelector('img')).transform);
          const box = pane.getBoundingClientRect();
          return [m.a.toFixed(3), (m.e / box.width).toFixed(3), (m.f / box.height).toFixed(1)];
        });
        press(stage, '0');
        out.fit = new DOMMatrix(getComputedStyle(stage.querySelector('img')).transform).a;
        type(viewer.querySelector('input[type=range]'), '25');
        out.clip = getComputedStyle(stage.querySelector('.over')).clipPath;
        press(stage, '.');
        out.split = viewer.querySelector('input[type=range]').value;
        press(stage, 'n');
        out.turned = which.value;
        $('.pictures figure:nth-child(4) a').click();
        out.pressed = sources();
        return out;""")
    equal(found["first"], ["r0_color.png", "truth.png"], "method against truth:")
    equal(found["strip"], [[f"{file}.png", 32, True] for file in ("r0_color", "truth", "r0_error", "r0_method")])
    equal(found["error"], ["r0_color.png", "r0_error.png"])
    equal(found["kept"], ["r1_color.png", "r1_error.png"], "another run, the same kinds:")
    equal(found["runs"], ["r1_color.png", "r0_color.png"], "one run against another:")
    equal(found["exchanged"], ["r0_color.png", "r1_color.png"])
    equal(len(found["moves"]), 6)
    equal(set(map(tuple, found["moves"])), {tuple(found["moves"][0])}, "the same zoom and pan in all:")
    equal(found["moves"][0][0], "2.250")
    check(float(found["moves"][0][1]) < -0.6, found["moves"])
    equal([found["fit"], found["clip"], found["split"]], [1, "inset(0px 0px 0px 25%)", "30"])
    check(found["turned"] != "1", found)
    equal(found["pressed"], ["r0_color.png", "r0_method.png"])


def test_lights(page, results):
    found = run(page, """
        location.hash = '#pictures-run-1';
        await wait();
        const table = $('.light-table table'), stage = $('.stage'), out = {};
        out.headings = [...table.tHead.rows[0].cells].map(th => th.textContent);
        out.cells = [...table.tBodies[0].rows].map(row => [0, 5, 11].map(i => row.cells[i].textContent).join(' '));
        const row = table.tBodies[0].rows[2];
        row.focus();
        const ring = stage.querySelector('.light.hot');
        const place = () => {
          const [at, of] = [ring, stage].map(e => e.getBoundingClientRect());
          return [((at.x + at.width / 2 - of.x) / of.width).toFixed(2), ((at.y + at.height / 2 - of.y) / of.height).toFixed(2)];
        };
        out.place = place();
        press(stage, '+');
        out.near = place();
        press(row, 'ArrowDown');
        out.next = document.activeElement.cells[0].textContent;
        $('.viewer input[type=checkbox]').click();
        const rings = $$('.light');
        out.rings = rings.filter(seen).length;
        rings[1].click();
        out.ofRing = document.activeElement.cells[0].textContent;
        return out;""")
    equal(found["headings"][:6], ["Light", "Computed by", "Texels wanted", "given", "Pages", "Pairs"])
    equal(found["cells"][:3], ["0 1000 0.000", "1 1001 0.300", "2 1002 0.599"])
    equal(found["place"], ["0.30", "0.30"], "where the results place light 2, of 640 x 360:")
    equal(found["near"], ["0.20", "0.20"], "the same place at one and a half:")
    equal([found["next"], found["rings"], found["ofRing"]], ["3", 4, "1"], "no ring of the light behind the camera:")


THEME = """
    const root = document.documentElement;
    const colour = () => [root.dataset.theme ?? '', getComputedStyle(document.body).backgroundColor];
    const out = [colour()];
    for (let i = 0; i < 3; ++i) { $('.theme').click(); out.push(colour()); }
    return out;"""


def test_themes(page, results):
    light, dark = "rgb(255, 255, 255)", "rgb(20, 24, 28)"
    for scheme, system in (("1", light), ("0", dark)):
        found = run(page, THEME, f"--blink-settings=preferredColorScheme={scheme}")
        equal(found, [["", system], ["dark", dark], ["light", light], ["", system]])
    # Text and links are read on their ground in both: 4.5 to 1.
    for scheme in "01":
        found = run(page, """
            const channel = v => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
            const luminance = c => {
              const [r, g, b] = c.match(/[\\d.]+/g).map(v => channel(Number(v)));
              return 0.2126 * r + 0.7152 * g + 0.0722 * b;
            };
            const ground = luminance(getComputedStyle(document.body).backgroundColor);
            return ['p.lead', 'nav a', 'td', '.verdict', 'h1'].map(s => {
              const [a, b] = [ground, luminance(getComputedStyle($(s)).color)].sort((x, y) => y - x);
              return (a + 0.05) / (b + 0.05);
            });""", f"--blink-settings=preferredColorScheme={scheme}")
        check(min(found) >= 4.5, f"contrasts {found}")


def test_motion(page, results):
    steps = """return [getComputedStyle(document.documentElement).scrollBehavior,
                       getComputedStyle($('.point .mark')).transitionDuration];"""
    equal(run(page, steps), ["smooth", "0.12s"])
    equal(run(page, steps, "--force-prefers-reduced-motion"), ["auto", "0s"])


NARROW = """
    const frame = document.createElement('iframe');
    frame.style.cssText = 'width: 400px; height: 900px; border: 0';
    frame.src = PAGE;
    document.body.replaceChildren(frame);
    await new Promise(done => { frame.onload = done; });
    const inner = frame.contentDocument, wide = inner.documentElement;
    const text = inner.querySelector('.axes text').getBoundingClientRect();
    return [wide.scrollWidth, wide.clientWidth, text.height];"""


def test_narrow_windows(page, results):
    text, inner = pathlib.Path(page).read_text(), pathlib.Path(page).with_name("inner.html")
    inner.write_text(text)
    width, seen, height = run(page, NARROW.replace("PAGE", json.dumps(inner.name)), "--allow-file-access-from-files")
    check(width <= seen <= 400, f"the page is {width} wide in a window of {seen}")
    check(height >= 9, f"the text of the axes is {height} high")


def test_other_pages(directory):
    for stem, command, data, options in (("f", "fit", made.made_fit(made.HOSTILE), ("-o", directory, "--no-charts")),
                                         ("d", "diff", made.made_diff(made.HOSTILE), ())):
        (directory / f"{stem}.json").write_text(json.dumps(data))
        made.run_package(SOURCE, command, directory / f"{stem}.json", *options)
    found = run(directory / "f.html", """
        $('#point-model-2').focus();
        const out = {facts: $('.detail dl').textContent,
                     holes: $$('.point .hole').map(hole => hole.closest('.point').id), ring: $$('.ring').length};
        $('#point-model-0').dispatchEvent(new MouseEvent('click', {bubbles: true, cancelable: true}));
        await wait();
        return {...out, at: document.activeElement.id, name: $('tr:target td').textContent, hit: window.hit ?? 0};""")
    check("breaks the bound" in found["facts"], found)
    equal([found["holes"], found["ring"], found["at"], found["hit"]], [["point-model-2"], 1, "model-0", 0])
    equal(found["name"], made.HOSTILE.replace("^3", "³"))
    found = run(directory / "d.html", """
        $('#change-1 a').click();
        await wait();
        return [document.activeElement.id, $('.detail dl').textContent.includes('1.5'), window.hit ?? 0];""")
    equal(found, ["point-change-1", True, 0])


def test_hostile_compare(directory):
    results = made.committed(SOURCE, "compare-atrium.json")
    results["runs"][3]["label"] = made.HOSTILE
    page = made.write_compare(SOURCE, directory, results)
    found = run(page, """
        $('#point-run-3').focus();
        location.hash = '#pictures-run-3';
        await wait();
        return [$('.detail h3').textContent, $('.viewer select').selectedOptions[0].textContent,
                $('.light-table summary').textContent, window.hit ?? 0];""")
    shown = made.HOSTILE.replace("^3", "³")
    equal(found, [shown, f"{shown}, builtin:atrium, frame 0", f"5 lights by {shown}, builtin:atrium, frame 0", 0])


def test_dialog(directory):
    """Pages without a place for the viewer open it over them."""
    (directory / "images").mkdir(parents=True)
    for name in ("t", "c", "e"):
        (directory / f"images/{name}.png").write_bytes(made.png((10, 20, 30)))
    results = made.committed(SOURCE, "real_scenes.json")
    cells = [c for c in results["cells"] if c["scene"] == results["cells"][0]["scene"]]
    for cell, name in zip(cells, "ce"):
        cell["image"] = f"{name}.png"
    results["cells"] = [{key: value for key, value in c.items() if key != "image" or c in cells[:2]} for c in cells]
    results["pictures"] = [{"scene": cells[0]["scene"], "truth": "t.png"}]
    (directory / "real.json").write_text(json.dumps(results))
    made.run_package(SOURCE, "real", directory)
    found = run(directory / "index.html", """
        const out = [$('dialog').open];
        $('.pictures figure:nth-child(3) a').click();
        const sources = $$('.stage img').map(img => img.src.split('/').pop());
        out.push($('dialog').open, sources, $$('.strip button').length);
        $('dialog button').click();
        out.push($('dialog').open);
        return out;""")
    equal(found, [False, True, ["t.png", "e.png"], 3, False])


def main():
    if BROWSER is None:
        print("skipped: no Chromium; ./do packages dev installs it")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        results = made.two_frames(made.committed(SOURCE, "compare-atrium.json"))
        page = made.write_compare(SOURCE, directory / "r", results)
        for test in (test_points_lead_to_rows_and_back, test_tables_filter_and_sort, test_frames_and_series,
                     test_viewer, test_lights, test_themes, test_motion, test_narrow_windows):
            test(page, results)
            print(f"{test.__name__}: ok")
        for i, test in enumerate((test_other_pages, test_hostile_compare, test_dialog)):
            if test is test_other_pages:
                (directory / str(i)).mkdir()
            test(directory / str(i))
            print(f"{test.__name__}: ok")


main()
