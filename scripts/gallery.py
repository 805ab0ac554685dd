#!/usr/bin/env python3
"""Carries out the commands of docs/gallery.md and compares the figures with those in docs/gallery/.

    scripts/gallery.py PROGRAM           ends with 1 where a command fails or a figure differs
    scripts/gallery.py PROGRAM --write   writes the figures anew

A figure gallery/NAME-FILE.svg is FILE.svg below the folder that `--out NAME` names in the block before it.
"""
import os, pathlib, re, subprocess, sys, tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent


def figures():
    """The commands of each block, with the figure that follows it."""
    page = (ROOT / "docs/gallery.md").read_text()
    found = re.findall(r"```sh\n(.*?)```\n+!\[[^]]*\]\(gallery/([^-)]+)-([^)]+)\)", page, re.DOTALL)
    if len(found) != page.count("!["):
        sys.exit(f"gallery.py: docs/gallery.md: found {page.count('![')} figures, of them {len(found)} after a block of commands")
    return [(block.strip().splitlines(), name, file) for block, name, file in found]


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--write"]):
        sys.exit("usage: scripts/gallery.py PROGRAM [--write]")
    program, write = os.path.abspath(sys.argv[1]), len(sys.argv) == 3
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        os.symlink(ROOT / "examples", f"{folder}/examples")
        os.symlink(program, f"{folder}/standstill")
        for commands, name, file in figures():
            for command in commands:
                done = subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True,
                                      env={**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"})
                # Code 1 is a verdict: a limit that no value keeps, a requirement that failed.
                if done.returncode not in (0, 1):
                    sys.exit(f"gallery.py: {command}: code {done.returncode}\n{done.stderr}")
            made = list(pathlib.Path(folder, name).rglob(file))
            if len(made) != 1:
                sys.exit(f"gallery.py: {commands[-1]}: found {len(made)} files {file} below {name}, needed one")
            kept = ROOT / "docs/gallery" / f"{name}-{file}"
            if write:
                kept.parent.mkdir(exist_ok=True)
                kept.write_bytes(made[0].read_bytes())
            elif not kept.exists() or kept.read_bytes() != made[0].read_bytes():
                wrong.append(f"docs/gallery/{kept.name}")
    if wrong:
        sys.exit(f"gallery.py: not as made now: {', '.join(wrong)}; look at them, then scripts/gallery.py PROGRAM --write")
    print(f"gallery: {len(figures())} figures are as their commands make them")


main()
