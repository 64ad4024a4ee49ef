#!/usr/bin/env python3
"""Writes THIRD-PARTY.md: the crates that the program is linked with, and the texts of their licences. Needs cargo."""
import collections
import json
import pathlib
import subprocess

root = pathlib.Path(__file__).resolve().parent.parent
metadata = json.loads(
    subprocess.run(
        ["cargo", "metadata", "--format-version", "1", "--locked", "--manifest-path", root / "Cargo.toml"],
        check=True, capture_output=True,
    ).stdout
)
packages = {package["id"]: package for package in metadata["packages"]}
edges = {node["id"]: node["deps"] for node in metadata["resolve"]["nodes"]}

# Everything that is linked or runs at build time; not what only tests and benches need.
wanted, waiting = set(), list(metadata["workspace_members"])
while waiting:
    at = waiting.pop()
    if at in wanted:
        continue
    wanted.add(at)
    waiting += [d["pkg"] for d in edges[at] if any(kind["kind"] != "dev" for kind in d["dep_kinds"])]
crates = sorted((packages[at] for at in wanted if packages[at]["source"]), key=lambda p: (p["name"], p["version"]))

texts = collections.defaultdict(list)
for package in crates:
    folder = pathlib.Path(package["manifest_path"]).parent
    files = sorted(f for f in folder.iterdir() if f.is_file() and f.name.upper().startswith(("LICEN", "COPYING", "NOTICE", "UNLICENSE")))
    # Of a choice of licences the MIT text is taken, which is the shortest to keep.
    mit = [f for f in files if "MIT" in f.name.upper()]
    for file in (mit or files) + [f for f in files if "NOTICE" in f.name.upper() and f not in mit]:
        text = "\n".join(line.rstrip() for line in file.read_text(encoding="utf-8", errors="replace").strip().splitlines())
        # Of a text of the Apache licence alone the name is enough: it stands in LICENSE-APACHE.
        if "Apache License" in text[:200] and len(text) > 8000:
            continue
        if package["name"] not in texts[text]:
            texts[text].append(package["name"])

with open(root / "THIRD-PARTY.md", "w", encoding="utf-8") as out:
    out.write("# Third-party notices\n\nWritten by `verification/third_party.py`. The program is linked with these crates, or built with them; ")
    out.write("of a choice of licences MIT is taken\nwhere it is one. The text of the Apache licence is in [LICENSE-APACHE](LICENSE-APACHE).\n\n")
    out.write("Pictures embed the DejaVu font ([its licence](crates/plot/LICENSE-DejaVu.txt)); the colour map is viridis (CC0).\n\n")
    out.write("| crate | version | licence |\n|---|---|---|\n")
    for package in crates:
        out.write(f"| {package['name']} | {package['version']} | {package['license']} |\n")
    out.write("\n## Texts\n")
    for text, names in sorted(texts.items(), key=lambda item: item[1]):
        out.write(f"\n### {', '.join(names)}\n\n```text\n{text}\n```\n")
