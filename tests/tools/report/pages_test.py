# SPDX-License-Identifier: Apache-2.0
"""The pages of reports without a browser: nothing is fetched, every link leads somewhere, every picture has a text, the
numbers are those of the results, names stay text, and the size is bounded.

    pages_test.py SOURCE_DIR
"""
import csv
import html.parser
import json
import math
import pathlib
import re
import sys
import tempfile

SOURCE = pathlib.Path(sys.argv[1])
sys.dont_write_bytecode = True
sys.path[:0] = [str(SOURCE / "tests/tools/report"), str(SOURCE / "tools/report")]

import made_reports as made  # noqa: E402
from shadowdag_report.pages import compare, compare_plot, diff, fit, lights  # noqa: E402
from shadowdag_report.pages.plot import LogAxis, NameAxis  # noqa: E402


def check(holds, what):
    if not holds:
        sys.exit(f"{what}")


def equal(is_, should_be, what=""):
    check(is_ == should_be, f"{what} {is_!r} instead of {should_be!r}")


class Page(html.parser.HTMLParser):
    """The elements of a page, (name, attributes); the texts of scripts, of styles and of the rest; rows of tables."""

    def __init__(self, path):
        super().__init__()
        self.elements, self.scripts, self.styles, self.texts, self.inside = [], [], [], [], ""
        self.rows = {}  # by id: [(attributes, text)]
        self.row = None
        self.text = pathlib.Path(path).read_text()
        self.feed(self.text)
        self.ids = [a["id"] for _, a in self.elements if "id" in a]

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.elements.append((tag, attributes))
        if tag in ("script", "style"):
            self.inside = tag
            self.scripts.append((attributes, "")) if tag == "script" else None
        if tag == "tr":
            self.row = self.rows.setdefault(attributes.get("id", len(self.rows)), [])
        if tag in ("td", "th") and self.row is not None:
            self.row.append((attributes, ""))

    def handle_endtag(self, tag):
        self.inside = "" if tag == self.inside else self.inside
        self.row = None if tag == "tr" else self.row

    def handle_data(self, data):
        if self.inside == "script":
            self.scripts[-1] = (self.scripts[-1][0], self.scripts[-1][1] + data)
        elif self.inside == "style":
            self.styles.append(data)
        else:
            self.texts.append(data)
            if self.row:
                self.row[-1] = (self.row[-1][0], self.row[-1][1] + data)


def check_page(path, most_bytes, has_charts=False):
    """Checks what holds for every page; returns it."""
    page = Page(path)
    where = pathlib.Path(path)
    check(len(page.text) <= most_bytes, f"{where.name} has {len(page.text)} characters, more than {most_bytes}")
    for tag, attributes in page.elements:
        check(not any(key.startswith("on") for key in attributes), f"{tag} has a handler: {attributes}")
        check(tag not in ("link", "iframe", "object", "embed", "base"), f"{tag} may fetch something")
        for key in ("src", "href", "srcset", "xlink:href", "poster", "action"):
            target = attributes.get(key)
            if target is None:
                continue
            check(not re.match(r"[a-z]+:|//", target, re.IGNORECASE), f"{tag} {key}={target} leaves the directory")
            if target.startswith("#"):
                check(target[1:] in page.ids, f"a link leads to {target}, which is not there")
            elif key == "src":
                check((where.parent / target).exists(), f"{target} is not there")
        if tag == "script":
            check(set(attributes) <= {"type", "id"}, f"a script with {attributes}")
        if tag == "img":
            check(attributes.get("alt", "").strip(), f"no text of the picture {attributes}")
        if tag == "svg":
            check("aria-label" in attributes or attributes.get("aria-hidden") == "true", "a drawing without a text")
        if tag == "a" and attributes.get("class") == "point":
            check(attributes["aria-label"], "a point without a text")
    equal(len(page.ids), len(set(page.ids)), "ids that stand twice:")
    for word in ("fetch(", "XMLHttpRequest", "import(", "WebSocket", "sendBeacon", "http:", "https:"):
        check(not any(word in text for _, text in page.scripts), f"a script holds {word}")
    check(not re.search(r"@import|url\(", "".join(page.styles)), "the style fetches something")
    for attributes, text in page.scripts:
        if attributes.get("type") == "application/json":
            json.loads(text)
    for preference in ("prefers-color-scheme", "prefers-reduced-motion"):
        check(preference in page.styles[0], f"a page without {preference}")
    return page


def cells(page, row):
    """Returns {heading: (attributes, text)} of a row of the table that it is in."""
    table = list(page.rows)
    heading = next(page.rows[k] for k in reversed(table[:table.index(row)])
                   if isinstance(k, int) and len(page.rows[k]) == len(page.rows[row]))
    return {text: cell for (_, text), cell in zip(heading, page.rows[row])}


def test_compare():
    results = made.two_frames(made.committed(SOURCE, "compare-atrium.json"))
    with tempfile.TemporaryDirectory() as name:
        page = check_page(made.write_compare(SOURCE, name + "/r", results), 500_000)
        results = json.loads(pathlib.Path(name, "r/results.json").read_text())
        points = [a for t, a in page.elements if t == "a" and a.get("class") == "point"]
        equal(len(points), len(results["runs"]), "points:")
        for i, run in enumerate(results["runs"]):
            of = cells(page, f"run-{i}")
            equal(of["Run"][1], run["label"].replace("^3", "³"))
            wrong = run["false_shadow_count"] + run["false_light_count"]
            for heading, value in (("Time, ms", run["time_ms"]),
                                   ("95 % interval", run.get("time_ms_low", run["time_ms_min"])),
                                   ("False shadow, %", 100 * run["false_shadow_count"] / run["pair_count"]),
                                   ("Wrong pairs, %", 100 * wrong / run["pair_count"]),
                                   ("Mean error", run["mean_abs_visibility_error"]),
                                   ("Memory, MiB", (run["dag_bytes"] + run["exact_bytes"] + run["map_bytes"]) / 2**20)):
                check(abs(float(of[heading][0]["data-v"]) - value) < 1e-8,
                      f"{heading} of run {i}: {of[heading]} instead of {value}")
            equal(of["Wrong pairs, %"][0]["title"], f"{wrong:,} of {run['pair_count']:,} pairs".replace(",", "\u202f"))
        data = next(json.loads(text) for a, text in page.scripts if a.get("id") == "report-data")["lights"]
        with open(name + "/r/lights.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        equal(sum(map(len, data["rows"].values())), len(rows), "lights:")
        for i, run in enumerate(results["runs"]):
            mine = [r for r in rows if r["label"] == run["label"]] if "images" in run else []
            for values, row in zip(data["rows"].get(f"run-{i}", []), mine, strict=True):
                of = dict(zip(data["columns"], values, strict=True))
                equal(of["route"], row["route"])
                for key in ("light", "texels", "pages", "pair_count", "false_light_count", "mean_abs_visibility_error"):
                    equal(of[key], float(row[key]), key)
                cost = next(c for c in results["map_costs"] if c["light"] == of["light"])
                equal([of["rays_ms"], of["map_ms"]], [cost["rays_ms"], cost["map_ms"]])
        at = {str(light): [64.0 * (light + 1), 36.0 * (light + 1)] for light in range(4)}
        equal(data["places"], {"0": {"width": 640, "height": 360, "lights": at}})
        # In one file: nothing beside it is needed, or linked.
        made.run_package(SOURCE, "single", name + "/r/index.html", "-o", name + "/one.html")
        one = Page(name + "/one.html")
        targets = [a[key] for _, a in one.elements for key in ("src", "href") if key in a]
        equal([t for t in targets if not t.startswith(("#", "data:image/png;base64,"))], [])
        equal(len([t for t in targets if t.startswith("data:")]), 4 * sum("images" in r for r in results["runs"]))


def test_runs_have_the_name_that_they_are_shown_by():
    results = made.committed(SOURCE, "compare-atrium.json")
    run = dict(results["runs"][-1], method="hybrid", model="oracle", label="hybrid oracle")
    run["shown_as"] = {"label": "hybrid measured routes", "model": "measured routes", "why": "measured routes: the reason"}
    run["parameters"] = {k: v for k, v in run["parameters"].items() if k != "threshold_texels"}
    results["runs"] = [r for r in results["runs"] if r["model"] != "oracle"] + [run]
    results.pop("verdict", None)  # of the file as it was measured
    with tempfile.TemporaryDirectory() as name:
        page = check_page(made.write_compare(SOURCE, name + "/r", results), 500_000)
        equal(cells(page, f"run-{len(results['runs']) - 1}")["Run"][1], "hybrid measured routes")
        text = "\n".join(page.texts)
        check("hybrid, measured routes" in text, "the chart's legend lacks the name")
        for other in ("hybrid oracle", "hybrid, oracle"):
            check(other not in text, "the page has the name that is not shown: " + text[max(0, text.find(other) - 60):][:120])
        equal(text.count("Measured routes: the reason."), 2, "explanations, of the chart and of the table:")


def test_names_stay_text():
    results = made.committed(SOURCE, "compare-atrium.json")
    for key in ("label", "scene"):
        results["runs"][3][key] = made.HOSTILE
    results["experiment"]["title"] = results["truth_images"][0]["scene"] = made.HOSTILE
    results["runs"][4]["scene"] = made.HOSTILE
    results["scenes"][0]["scene"] = results["provenance"]["cpu"] = made.HOSTILE
    results["verdict"]["text"] = made.HOSTILE
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        pages = [made.write_compare(SOURCE, directory / "r", results)]
        (directory / "f.json").write_text(json.dumps(made.made_fit(made.HOSTILE)))
        (directory / "d.json").write_text(json.dumps(made.made_diff(made.HOSTILE)))
        made.run_package(SOURCE, "fit", directory / "f.json", "-o", directory, "--no-charts")
        made.run_package(SOURCE, "diff", directory / "d.json")
        pages += [directory / "f.html", directory / "d.html"]
        for path, script_count in zip(pages, (3, 2, 2)):
            page = check_page(path, 500_000)
            equal(len(page.scripts), script_count, f"scripts of {path.name}:")
            shown = (made.HOSTILE, made.HOSTILE.replace("^3", "³"))
            check(any(name in text for name in shown for text in page.texts), f"{path.name} does not show the name")
            for markup in ("<img src=x", "<script>window"):
                check(markup not in page.text, f"a name is markup in {path.name}")
        for file in ("javascript:alert(1)", "//host/x.png", "../x.png"):
            results["runs"][3]["images"]["color"] = file
            (directory / "r/results.json").write_text(json.dumps(results))
            try:
                compare.content(str(directory / "r"), results, [])
                sys.exit(f"the picture {file} was accepted")
            except ValueError as refusal:
                check("is not in images" in str(refusal), refusal)


def test_fit():
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        for metric, minimise in (("false", "bytes"), ("flip", "time")):
            result = made.made_fit(metric=metric, minimise=minimise)
            (directory / "f.json").write_text(json.dumps(result))
            made.run_package(SOURCE, "fit", directory / "f.json", "-o", directory, "--no-charts")
            page = check_page(directory / "f.html", 120_000)
            points = {a["id"]: a for t, a in page.elements if t == "a" and a.get("class") == "point"}
            equal(sorted(points), ["point-model-0", "point-model-1", "point-model-2"])
            scale = 100 if metric == "false" else 1
            for i, model in enumerate(result["models"][:3]):
                of = cells(page, f"model-{i}")
                check(abs(float(of["Memory, MiB"][0]["data-v"]) - model["bytes"] / 2**20) < 1e-8, of)
                error = next(cell for heading, cell in of.items() if heading.startswith("Error"))[0]["data-v"]
                check(abs(float(error) - scale * model["error"]) < 1e-8, of)
            equal(cells(page, "model-3")["Rule"][1], "known cost")
        result["chosen"] = None
        result["models"][0]["status"] = "refuted"
        equal("No model keeps the bound. The least reached is flip error 0.00000, by dag 128³." in
              "".join(made_page(directory, "f", "fit", result, "-o", str(directory), "--no-charts").texts), True)
        (directory / "f.json").write_text("{}")
        refused(directory / "f.json", fit, "-o", str(directory), "--no-charts")


def made_page(directory, stem, command, data, *arguments):
    (directory / f"{stem}.json").write_text(json.dumps(data))
    made.run_package(SOURCE, command, directory / f"{stem}.json", *arguments)
    return check_page(directory / f"{stem}.html", 500_000)


def refused(path, module, *arguments):
    import argparse
    from shadowdag_report.files import Refused
    parser = argparse.ArgumentParser()
    module.declare(parser)
    try:
        module.run(parser.parse_args([str(path), *arguments]))
    except Refused as refusal:
        check(str(refusal).startswith(str(path)), refusal)
        return
    sys.exit(f"{path} was not refused")


def test_diff():
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        page = made_page(directory, "d", "diff", made.made_diff())
        order = [cells(page, f"change-{i}")["Value"][1] for i in range(5)]
        equal(order, ["acne_count", "false_shadow_count", "time_ms", "believes", "page_count"], "worse first:")
        equal(cells(page, "change-2")["A"][1], "100 (95 to 104)")
        check(abs(float(cells(page, "change-2")["B over A"][0]["data-v"]) - 0.8) < 1e-8, "the ratio")
        equal(cells(page, "change-0")["B over A"][1], "", "0 has no ratio:")
        equal(sorted(a["id"] for t, a in page.elements if t == "a" and a.get("class") == "point"),
              ["point-change-1", "point-change-2", "point-change-4"])
        text_of_page = " ".join(page.texts)
        check("B lacks 1 value of other rows" in text_of_page and "flip" in text_of_page, "values that B lacks")
        many = made.made_diff()
        many["changes"] = [many["changes"][1] | {"row": f"row {i}", "key": f"key {i % 90}"}
                           for i in range(diff.MOST_CHANGES + 7)]
        (directory / "m.json").write_text(json.dumps(many))
        made.run_package(SOURCE, "diff", directory / "m.json")
        page = check_page(directory / "m.html", 2_000_000)
        check("7 more changes are in m.json alone" in "".join(page.texts), "what is left out is not told")
        equal(made_page(directory, "n", "diff", many | {"changes": []}).rows.get("change-0"), None)
        (directory / "m.json").write_text('{"changes": 7}')
        refused(directory / "m.json", diff)


def test_sizes():
    """The largest committed results: eight scenes, many frames; and lights beyond what a page takes."""
    with tempfile.TemporaryDirectory() as name:
        results = made.committed(SOURCE, "main.json")
        check_page(made.write_compare(SOURCE, name + "/r", results), 5_000_000)
        results = made.committed(SOURCE, "compare-atrium.json")
        page = Page(made.write_compare(SOURCE, name + "/l", results, light_count=lights.MOST_ROWS // 4))
        data = next(json.loads(text) for a, text in page.scripts if a.get("id") == "report-data")["lights"]
        equal(sum(map(len, data["rows"].values())), lights.MOST_ROWS)
        left_out = sum("images" in run for run in results["runs"]) - 4
        check(f"The lights of {left_out} runs are in lights.csv alone" in "".join(page.texts), "untold what is left out")


def test_every_series_has_a_look_of_its_own():
    """Neither colour alone nor shape alone tells points apart: no two series of a chart share both."""
    for file in ("compare-atrium.json", "compare-believe.json", "compare-lod.json", "main.json"):
        for of in compare_plot.compare_plots(made.committed(SOURCE, file)):
            looks = [(s["color"], s["shape"], s["is_hollow"]) for s in of["series"]]
            equal(len(looks), len(set(looks)), f"{file}, {of['name']}:")
            equal(sum(len([p for p in of["points"] if p["series"] == i]) > 0 for i in range(len(looks))), len(looks))


def test_axes():
    axis = LogAxis("t", [1, 10, 100], 0, 100, margin=1.0)
    equal([round(axis.place(v), 9) for v in (1, 10, 100)], [0, 50, 100])
    equal([text for _, text in axis.ticks()], ["1", "2", "5", "10", "20", "50", "100"])
    axis = LogAxis("t", [0, 1, 100], 400, 0, margin=1.0)
    equal([round(axis.place(v), 6) for v in (0, 1, 100)], [400, 364, 0], "zero is apart from the rest:")
    equal(axis.ticks()[0], (400, "0"))
    for values in ([], [0], [5]):
        axis = LogAxis("t", values, 0, 1)
        check(all(math.isfinite(axis.place(v)) for v in [*values, 1]), f"an axis of {values}")
    equal(NameAxis("", ["a", "b", "a"], 0, 10).ticks(), [(2.5, "a"), (7.5, "b")])


for test in [value for name, value in list(globals().items()) if name.startswith("test_")]:
    test()
    print(f"{test.__name__}: ok")
