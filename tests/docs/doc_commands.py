#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Every command of README.md, docs/ and samples/ is checked, and the cheap ones are run.

    doc_commands.py check SOURCE BIN          tools, options, targets, files, paths in backticks and links exist
    doc_commands.py run SOURCE BIN PAGE...    runs the commands of the pages, in order, on a coarse mesh in a new folder

A command is an indented or fenced line (no language, sh, bash) that starts with a known word. Before it is run, "make"
becomes "make -f pipeline/Makefile BIN=..." because the test must not build, and the mesh becomes coarse through the
environment. What is too dear to run stands in DEAR with the reason. Standard library alone.
"""

import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

STARTS = re.compile(r"^(?:[A-Z_]+=\S+ )*\(?(make|cp|cd|git|cmake|ctest|apt-get|ccx|python3|paraview|pvpython|xvfb-run|sed|"
                    r"supine-[a-z]+|build/bin/\S+|bench/\S+|tests/\S+)(?= |$)")
DEAR = {
    "make demo": "installs and builds; what it runs is run below as make CASE=...",
    "make test": "this is part of it",
    "make build": "builds",
    "make bench": "hours",
    "make study": "an hour or more",
    "make hidden": "half an hour or more",
    "make package": "builds; its result is tried by tests/package/package_test.sh",
    "make COHORT=": "names for the reader to replace; tests/cohort runs a cohort",
    "make CASE=path/to/case": "a name for the reader to replace; the same targets are run on a sample",
    "CASE_OUT=": "ParaView cannot be installed beside libvtk9-dev; tests/docs/paraview_arrays.py checks what the script opens",
    "git clone": "fetches the source",
    "apt-get install": "changes the machine",
    "ctest ": "this is part of it",
    "build/bin/bench_": "a measurement, part of make bench",
    "bench/": "a measurement, part of make bench or make study",
    "xvfb-run": "draws a picture of the docs from a finished run",
}
COARSE = {"ORDER": "1", "TRIANGLES": "600", "MAX_DISTANCE_MM": "4", "OMP_NUM_THREADS": "1", "CALIBRATE": "", "THREADS": "1"}
# Words that a synopsis uses for the reader's own names.
PLACEHOLDER = re.compile(r"[\[\]…|]|\.\.\.|\b(CASE|OUT|FILE|FOLDER|NAME|MM|EFFECT|DATA|WORK|POSE)\b(?!=)|=dir\b|\bdir/")


def pages(source):
    return [*sorted(source.glob("*.md")), *sorted((source / "docs").glob("*.md")), *sorted((source / "samples").glob("**/*.md"))]


def folder_pages(source):
    """What every folder's README names is checked too; its commands are those of the pages above."""
    return [page for page in sorted(source.glob("*/README.md")) if page not in pages(source)]


def commands(page):
    """(line number, command) of a page; lines that end in a backslash are joined."""
    found, fence, language, held = [], False, "", None
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if line.lstrip().startswith("```"):
            fence = not fence
            language = line.strip()[3:] if fence else ""
            continue
        indented = not fence and line.startswith("    ")
        if not ((fence and language in ("", "sh", "bash")) or indented):
            held = None
            continue
        text = line.strip()
        if held is not None:
            text = held + " " + text
        if text.endswith("\\"):
            held = text[:-1].strip()
            continue
        held = None
        if STARTS.match(text):
            found.append((number, text))
    return found


def without_comment(command):
    return re.sub(r"\s+#.*$", "", command)


def help_text(bin_folder, tool, known={}):
    if tool not in known:
        done = subprocess.run([bin_folder / tool, "--help"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              universal_newlines=True)
        known[tool] = done.stdout if done.returncode == 0 else None
    return known[tool]


def check_tool(command, bin_folder):
    for tool, rest in re.findall(r"(?:^|[ /(])(supine-[a-z]+)((?: (?!&&|\|\|)[^;]*?)?)(?= && | \|\| |;|$)", command):
        if not (bin_folder / tool).exists():
            return f"there is no {tool}"
        text = help_text(bin_folder, tool)
        if text is None:
            return f"{tool} --help fails"
        for option in re.findall(r"(?<![\w-])(--[a-z][a-z0-9-]*|-o)\b", rest):
            if not re.search(rf"(?<![\w-]){re.escape(option)}(?![\w-])", text):
                return f"{tool} has no option {option}"
    return None


def check_make(command, source):
    if not re.search(r"(?:^|&& )make\b", command):
        return None
    texts = (source / "Makefile").read_text() + (source / "pipeline" / "Makefile").read_text() + (source / "cohort" / "Makefile").read_text()
    words = shlex.split(re.search(r"(?:^|&& )make\b([^&]*)", without_comment(command)).group(1).replace("[", "").replace("]", ""))
    skip = False
    for word in words:
        if skip or word.startswith("-"):
            skip = word == "-f"
            continue
        name = word.split("=")[0]
        if "=" in word and not re.search(rf"\b{name}\b", texts):
            return f"make has no variable {name}"
        if "=" not in word and not re.search(rf"(?m)(^|[ \t]){re.escape(name)}(?=[ \t:\n])", texts):
            return f"make has no target {name}"
    return None


def check_files(command, source):
    for word in shlex.split(without_comment(command).replace("(", " ").replace(")", " ")):
        if re.match(r"^(bench|pipeline|tests|docs|samples)/[\w./-]+$", word) and "*" not in word and "/out" not in word:
            if not (source / word).exists():
                return f"there is no {word}"
        program = re.match(r"^build/bin/(bench_\w+)$", word)
        if program and program.group(1).removeprefix("bench_") not in (source / "bench" / "CMakeLists.txt").read_text():
            return f"bench/CMakeLists.txt makes no {program.group(1)}"
    return None


def anchors(page):
    """Names that a link to a heading of the page may have."""
    headings = re.findall(r"(?m)^#+ (.*)$", page.read_text())
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def check_links(page):
    wrong = []
    for number, line in enumerate(page.read_text().splitlines(), 1):
        for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)]*))?\)", line):
            if target.startswith("http"):
                continue
            goal = page.parent / target if target else page
            if not goal.exists() or (anchor and anchor not in anchors(goal)):
                wrong.append(f"{page.name}:{number}: the link to {target}{'#' + anchor if anchor else ''} leads nowhere")
    return wrong


# A path names a file of a room by its end, as in `voxels.h`, or from the top of the source or from the page's folder.
PATH = re.compile(r"(?:[\w.-]+/)*[\w.-]+\.(?:h|cpp|py|sh|awk|cmake|mjs|md)|(?:[\w.-]+/)+[\w.-]*|Makefile")
ROOMS = ("bench", "calibration", "common", "diagnosis", "docs", "meshing", "phantom", "pipeline", "python", "reconstruction", "registration",
         "samples",
         "segmentation", "simulation", "tests", "warp")
# Made by a run or by the reader, or the reader's own names.
MADE = re.compile(r"(^|/)(out|build|answers)(/|$)|^(ladder|calibrated|overlays|dir|own|\d+)/|(^|[/_-])[A-Z]{2,}(?=[/_.-]|$)(?<!README)"
                  r"|(^|/)my\w*\.")


def names_of(source):
    """Ends of all paths of the repository: file names, and names with the folders above them; folders end in a slash."""
    ends = set()
    for room in (source, *(source / name for name in ROOMS)):
        for path in room.glob("*") if room == source else room.rglob("*"):
            name = path.relative_to(source).as_posix() + ("/" if path.is_dir() else "")
            parts = name.rstrip("/").split("/")
            ends.update("/".join(parts[i:]) + ("/" if path.is_dir() else "") for i in range(len(parts)))
    return ends


def check_paths(page, source, ends):
    wrong, fence = [], False
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if line.lstrip().startswith("```"):
            fence = not fence
        for quoted in [] if fence or line.startswith("    ") else re.findall(r"`([^`]+)`", line):
            path = quoted.split(" ")[0]
            if not PATH.fullmatch(path) or MADE.search(path):
                continue
            ours = path.split("/")[0] in ROOMS or not path.endswith("/")
            if ours and not {path, path + "/"} & ends and not (source / path).exists():
                wrong.append(f"{page.relative_to(source)}:{number}: there is no {path}")
    return wrong


def check(source, bin_folder):
    wrong, count, ends = [], 0, names_of(source)
    for page in folder_pages(source):
        wrong += check_links(page) + check_paths(page, source, ends)
    for page in pages(source):
        wrong += check_links(page) + check_paths(page, source, ends)
        for number, command in commands(page):
            count += 1
            for reason in (check_tool(command, bin_folder), check_make(command, source), check_files(command, source)):
                if reason:
                    wrong.append(f"{page.relative_to(source)}:{number}: {command}\n    {reason}")
    print("\n".join(wrong))
    print(f"{count} commands on {len(pages(source))} pages checked, {len(wrong)} wrong")
    return 1 if wrong or count < 40 else 0


def why_not(command):
    if PLACEHOLDER.search(re.sub(r"'[^']*'", "", without_comment(command))):
        return "a synopsis"
    for start, reason in DEAR.items():
        if command.startswith(start):
            return reason
    if "ccx" in command and shutil.which("ccx") is None:
        return "CalculiX is not installed"
    if "calculix.dat" in command and shutil.which("ccx") is None:
        return "CalculiX is not installed"
    return None


def run_page(source, bin_folder, page, folder):
    shutil.copytree(source / "samples", folder / "samples", ignore=shutil.ignore_patterns("out"))
    (folder / "build").mkdir()
    for link, target in (("pipeline", source / "pipeline"), ("docs", source / "docs"), ("bench", source / "bench"),
                         ("build/bin", bin_folder)):
        (folder / link).symlink_to(target)
    ran = 0
    for number, command in commands(source / page):
        reason = why_not(command)
        if reason:
            print(f"{page}:{number}: not run ({reason}): {command}")
            continue
        line = re.sub(r"(^|&& )make\b", rf"\1make -f pipeline/Makefile BIN={bin_folder}", without_comment(command))
        done = subprocess.run(["bash", "-c", line], cwd=folder, env={**os.environ, **COARSE}, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, universal_newlines=True)
        print(f"{page}:{number}: exit {done.returncode}: {command}", flush=True)
        if done.returncode not in (0, 1) or (done.returncode == 1 and not line.startswith("build/bin/supine-")):
            print(done.stdout[-3000:])
            return 1
        ran += 1
    print(f"{page}: {ran} commands run")
    return 0 if ran else 1


def main():
    if len(sys.argv) < 4 or sys.argv[1] not in ("check", "run"):
        print(__doc__, file=sys.stderr)
        return 2
    source, bin_folder = pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3]).resolve()
    if sys.argv[1] == "check":
        return check(source, bin_folder)
    for page in sys.argv[4:]:
        with tempfile.TemporaryDirectory() as folder:
            if run_page(source, bin_folder, page, pathlib.Path(folder)) != 0:
                return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
