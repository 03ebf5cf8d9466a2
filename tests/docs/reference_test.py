#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""The reference pages know every law, key, effect, parameter and option that the tools know, with unit, range and default.

    reference_test.py SOURCE BIN

What the tools know is asked of supine-model: its list, the complaints about a wrong choice, what it shows of an empty
model and what it adds for an effect. Standard library alone.
"""

import pathlib
import re
import subprocess
import sys
import tempfile

CHOICES = (("breast", "law"), ("breast", "volumetric"), ("breast", "density_refers_to"), ("skin", "law"),
           ("skin", "compression"), ("interface", "kind"), ("cut", "kind"))


class Tool:
    def __init__(self, bin_folder, folder):
        self.program, self.folder = bin_folder / "supine-model", folder

    def run(self, *words):
        done = subprocess.run([self.program, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)
        return done.stdout, done.stderr

    def model(self, text):
        path = self.folder / "model.toml"
        path.write_text(text)
        return path

    def choices(self, table, key):
        complaint = self.run("show", self.model(f'[{table}]\n{key} = "?"\n'))[1]
        return re.split(r", | or ", re.search(r"must be (.*)", complaint).group(1).strip())

    def defaults(self, laws):
        """Name and default of every number, over all laws."""
        found = {}
        for law in laws:
            shown = self.run("show", self.model(f'[breast]\nlaw = "{law}"\n[skin]\nlaw = "corotational"\n'))[0]
            found.update(re.findall(r"^ +([a-z]+\.\w+) +(\S+)", shown, re.M))
        return found

    def added(self, effect):
        """Parameter with typical value and spread, option and default, as `add` writes them."""
        path = self.model("")
        self.run("add", effect, path)
        text = path.read_text()
        numbers = re.findall(r"^(\w+) = \{ value = ([^,]+), prior_sd = ([^,]+),", text, re.M)
        return {key: (value, spread) for key, value, spread in numbers}, dict(re.findall(r'^(\w+) = "([^"]*)"', text, re.M))


def parse_list(text):
    """Rows of the base model and of the effects: (effect or None, key, unit, null, lowest, highest)."""
    rows, effect, effects = [], None, []
    for line in text.splitlines():
        head = re.match(r"  (\w+): ", line)
        if head:
            effect = head.group(1)
            effects.append(effect)
        row = re.match(r" {4}(\S+) +(\S*) +(?:null (\S+) +)?range +(\S+) to (\S+)", line)
        if row:
            rows.append((effect, *row.groups()))
    return rows, effects


def number(text):
    try:
        return float(text.replace("−", "-").replace(",", ""))
    except ValueError:
        return None


def table_rows(page):
    """Cells of every row of a table, by its first two: table or effect, and key."""
    cells = ([cell.strip() for cell in line.strip("|\n ").split("|")] for line in page.splitlines() if line.startswith("|"))
    return {(row[0].strip("`[]"), row[1].strip("`")): row for row in cells if len(row) > 4}


def check_numbers(page, rows, defaults, added):
    """A row of the base model holds unit, range, default; one of an effect unit, null, range, typical size, spread."""
    wrong, written = [], table_rows(page)
    for effect, name, unit, null, lowest, highest in rows:
        place = (effect, name) if effect else tuple(name.split("."))
        row = written.get(place)
        if row is None:
            wrong.append(f"no row of a table for {' '.join(place)}")
            continue
        at = 4 if effect else 3
        wanted = [unit, float(lowest), float(highest)]
        held = [row[2], *map(number, (row[at].split(" to ") + [""])[:2])]
        if effect:
            wanted += [float(null), *map(float, added[effect][0][name])]
            held += map(number, (row[3], row[5], row[6]))
        else:
            wanted.append(float(defaults.get(name, "nan")))
            held.append(number(row[4]))
        if held != wanted:
            wrong.append(f"{' '.join(place)}: the page has {held}, the tools {wanted}")
    return wrong


def check_names(page, where, choices, effects, added):
    wrong = [f"{table}.{key} = {value}" for (table, key), values in choices.items() for value in values if f"`{value}`" not in page]
    wrong += [effect for effect in effects if f"`{effect}`" not in page]
    wrong += [f"{effect}.{option}" for effect in effects for option in added[effect][1] if f"`{option}`" not in page]
    return [f"{where} does not know {name}" for name in wrong]


def main():
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    docs = pathlib.Path(sys.argv[1]) / "docs"
    model_file, mechanics = (docs / "model-file.md").read_text(), (docs / "mechanics.md").read_text()
    with tempfile.TemporaryDirectory() as folder:
        tool = Tool(pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(folder))
        rows, effects = parse_list(tool.run("list")[0])
        choices = {place: tool.choices(*place) for place in CHOICES}
        defaults = tool.defaults(choices["breast", "law"])
        added = {effect: tool.added(effect) for effect in effects}
    wrong = check_numbers(model_file, rows, defaults, added)
    wrong += check_names(model_file, "model-file.md", choices, effects, {e: added[e] for e in effects})
    laws = {place: values for place, values in choices.items() if place[1] == "law"}
    wrong += check_names(mechanics, "mechanics.md", laws, effects, {e: ({}, {}) for e in effects})
    print("\n".join(wrong))
    print(f"{len(rows)} numbers, {sum(map(len, choices.values()))} choices, {len(effects)} effects checked, {len(wrong)} wrong")
    return 1 if wrong or len(rows) < 40 or len(effects) < 18 else 0


if __name__ == "__main__":
    sys.exit(main())
