# SPDX-License-Identifier: Apache-2.0
"""What tools/studies/update_known.py writes into a study, and what it leaves.

    update_known_test.py SOURCE_DIR
"""
import contextlib
import io
import json
import os
import pathlib
import re
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
SOURCE = pathlib.Path(sys.argv.pop(1))
sys.path.insert(0, str(SOURCE / "tools/studies"))
import update_known  # noqa: E402


def cell(name, method, known="yes", **counts):
    """Returns a cell of study real in which all measures are 0 but those given."""
    return {"scene": name, "method": method, "known": known} | dict.fromkeys(update_known.MEASURES, 0) | counts


class UpdateKnown(unittest.TestCase):
    def update(self, cells, rows):
        """Returns the rows that become of these, and what was said."""
        with tempfile.TemporaryDirectory() as folder:
            results, study = os.path.join(folder, "r.json"), os.path.join(folder, "s.json")
            pathlib.Path(results).write_text(json.dumps({"cells": cells}))
            pathlib.Path(study).write_text(json.dumps({"kind": "real", "rows": rows}))
            with contextlib.redirect_stdout(io.StringIO()) as said:
                self.assertEqual(update_known.main(["", results, study]), 0)
            self.assertEqual(sorted(os.listdir(folder)), ["r.json", "s.json"])
            return json.loads(pathlib.Path(study).read_text())["rows"], said.getvalue()

    def test_measures_are_those_of_cells(self):
        text = (SOURCE / "tools/studies/cell_counts.h").read_text()
        names = re.search(r"kCellMeasureNames\[[^{]*\{(.*?)\}", text, re.DOTALL).group(1)
        self.assertEqual(re.findall(r'"(\w+)"', names), update_known.MEASURES)

    def test_counts_are_written_and_rises_are_told(self):
        old = [{"method": "maps", "acne_count": 1}]
        rows, said = self.update([cell("a", "maps", acne_count=3), cell("a", "dag")], [{"name": "a", "known": old}])
        self.assertEqual(rows[0]["known"], [{"method": "maps", "acne_count": 3}, {"method": "dag"}])
        self.assertEqual(said, "a by maps, remedy none: acne_count rises from 1 to 3\n")

    def test_rows_that_were_not_measured_keep_their_numbers(self):
        row = {"name": "b", "known": [{"method": "maps", "acne_count": 1}]}
        self.assertEqual(self.update([cell("a", "maps")], [row]), ([row], ""))

    def test_another_file_of_the_same_name_changes_nothing(self):
        row = {"name": "a", "known": [{"method": "maps", "acne_count": 1}]}
        rows, said = self.update([cell("a", "maps", known="another file", acne_count=9)], [row])
        self.assertEqual(rows, [row])
        self.assertIn("a: the file that was measured has another geometry_hash", said)

    def test_remedies_are_told_apart(self):
        cells = [cell("a", "maps", acne_count=5) | {"remedy": "off"}, cell("a", "maps") | {"remedy": "on"}]
        rows, _ = self.update(cells, [{"name": "a"}])
        self.assertEqual(rows[0]["known"], [{"method": "maps", "remedy": "off", "acne_count": 5},
                                            {"method": "maps", "remedy": "on"}])


if __name__ == "__main__":
    unittest.main()
