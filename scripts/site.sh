#!/usr/bin/env bash
# The site as a static folder: manual with search, lab without a server, Python's reference, rustdoc.
#
#     scripts/site.sh FOLDER [--without-rustdoc] [--version NAME]      into FOLDER/NAME; the version of Cargo.toml unless named
#     scripts/site.sh FOLDER --versions                                lists the versions that are in FOLDER anew, and builds none
#
# Versions stand beside each other, with a switch on each page. FOLDER/latest is a link to the newest release (where there is none, to
# what there is), and FOLDER/index.html goes there. With STANDSTILL_HOME, the address of the repository, pages link to its files;
# without it they name them. Needs python3, mdbook (`cargo install mdbook --locked`) and the target wasm32-unknown-unknown
# (`rustup target add wasm32-unknown-unknown`). Look at it through a server, such as `python3 -m http.server --directory FOLDER`.
set -euo pipefail
usage() { echo "usage: scripts/site.sh FOLDER [--without-rustdoc] [--version NAME], or scripts/site.sh FOLDER --versions" >&2; exit 2; }
[ $# -ge 1 ] || usage
case $1 in -*) usage ;; esac
out=$1
shift
rustdoc=
only=
cargo_toml=$(dirname "$0")/../Cargo.toml
version=$(sed -n '/^\[workspace.package\]/,/^version/s/^version = "\(.*\)"$/\1/p' "$cargo_toml")
while [ $# -gt 0 ]; do
    case $1 in
        --without-rustdoc) rustdoc=$1 ;;
        --versions) only=$1 ;;
        --version) [ $# -ge 2 ] || usage; version=$2; shift ;;
        *) usage ;;
    esac
    shift
done
if ! [[ $version =~ ^[A-Za-z0-9][A-Za-z0-9._-]*$ ]] || [ "$version" = latest ]; then
    echo "site.sh: found the version \"$version\", needed a name of letters, digits, points and dashes, and not \"latest\"" >&2
    exit 2
fi
# What a host keeps beside the pages stays.
if [ -e "$out" ] && ls -A "$out" | grep -qvxE '\.git|CNAME' && [ ! -e "$out/.standstill-site" ]; then
    echo "site.sh: $out is not empty and not a site of before; name another folder" >&2
    exit 2
fi
mkdir -p "$out"
out=$(cd "$out" && pwd)
touch "$out/.standstill-site"

# The list of versions for the switch, releases first and the newest of them before the others; where the site begins.
list() {
    python3 - "$out" <<'PY'
import json, os, pathlib, re, sys
out = pathlib.Path(sys.argv[1])
there = [path.name for path in out.iterdir() if path.is_dir() and not path.is_symlink() and (path / "index.html").is_file()]
number = lambda name: [int(part) for part in re.fullmatch(r"v?(\d+)\.(\d+)\.(\d+)", name).groups()]
is_release = lambda name: re.fullmatch(r"v?\d+\.\d+\.\d+", name) is not None
versions = sorted(filter(is_release, there), key=number, reverse=True) + sorted(name for name in there if not is_release(name))
if not versions:
    sys.exit(f"site.sh: {out}: found no version, needed a folder with index.html")
(out / "versions.json").write_text(json.dumps({"latest": versions[0], "versions": versions}) + "\n")
link = out / "latest"
if link.is_symlink():
    link.unlink()
os.symlink(versions[0], link)
(out / "index.html").write_text('<!doctype html><html lang="en"><meta charset="utf-8"><title>Standstill</title>'
    '<meta http-equiv="refresh" content="0; url=latest/"><a href="latest/">Standstill</a></html>\n')
print(f"versions: {', '.join(versions)}; latest is {versions[0]}")
PY
}
if [ -n "$only" ]; then
    list
    exit
fi
command -v mdbook >/dev/null || { echo "mdbook is missing: cargo install mdbook --locked" >&2; exit 2; }
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The pages of the root stand among those of docs/, so links lose one step; what lies elsewhere is linked where the code is.
cp -r docs "$work/docs"
cp book.toml "$work/"
cp packaging/site/versions.js "$work/"
sed -i 's/^\[output\.html\]$/&\nadditional-js = ["versions.js"]/' "$work/book.toml"
# Pages for developers are not searched, as those of book.toml.
for page in CHANGELOG CONTRIBUTING ARCHITECTURE; do
    sed -i "s/^\"mistakes.md\" = .*/&\n\"$page.md\" = { enable = false }/" "$work/book.toml"
done
home=${STANDSTILL_HOME:-}
for page in README CHANGELOG CONTRIBUTING ARCHITECTURE; do
    sed -e 's#](docs/#](#g' "$page.md" >"$work/docs/$page.md"
done
cat >>"$work/docs/SUMMARY.md" <<PAGES

# For developers

- [Contributing](CONTRIBUTING.md)
- [Architecture](ARCHITECTURE.md)
- [Changes](CHANGELOG.md)

---

[The lab](lab-here.md)
[Python's functions](python-here.md)
PAGES
here() { printf '# %s\n\n<meta http-equiv="refresh" content="0; url=%s">\n\n[%s](%s)\n' "$2" "$3" "$2" "$3" >"$work/docs/$1-here.md"; }
here lab "The lab" lab/index.html
python3 crates/python/scripts/write_reference.py >"$work/docs/python-here.md"
if [ -z "$rustdoc" ]; then
    echo "[The crates](rust-here.md)" >>"$work/docs/SUMMARY.md"
    here rust "The crates" rust/index.html
fi
code='(crates|examples|benches|tests|scripts|LICENSE|THIRD-PARTY|CITATION|Cargo)'
if [ -n "$home" ]; then named="[\\1](${home%/}/blob/main/\\3)"; else named='\1 (`\3`)'; fi
find "$work/docs" -name '*.md' -exec sed -i -E \
    -e "s#\[([^][]*)\]\((\.\./)*(${code}[^)]*)\)#${named}#g" \
    -e 's#\]\((\.\./)+((README|CHANGELOG|CONTRIBUTING|ARCHITECTURE)\.md)#](\1\2#g' \
    -e 's#(\]\([^)]*)\bREADME\.md#\1index.md#g' {} +
# README.md becomes index.html, and links to it must say so; the contents keep its name.
sed -i 's#(\(.*/\)\?index\.md)#(\1README.md)#' "$work/docs/SUMMARY.md"

scripts/lab-static.sh "$work/lab"

# Fonts of the reader's own system: those of mdbook have half a megabyte.
mkdir -p "$work/theme/fonts"
: >"$work/theme/fonts/fonts.css"
mdbook build --dest-dir "$work/site" "$work"
# An empty one is linked and not copied.
mkdir -p "$work/site/fonts"
: >"$work/site/fonts/fonts.css"
# Half of the index repeats the text under the name of the path to a heading, and weights have sixteen digits.
python3 - "$work"/site/searchindex-*.js <<'PY'
import json, re, sys
path = sys.argv[1]
text = open(path, encoding="utf-8").read()
begin, end = text.index("JSON.parse('") + len("JSON.parse('"), text.rindex("')")
index = json.loads(re.sub(r"\\(.)", lambda found: found[1] if found[1] in "'\\" else found[0], text[begin:end]))
fields = index["index"]["index"]
assert {"body", "title", "breadcrumbs"} <= set(fields), fields.keys()
fields["breadcrumbs"] = {"root": {"docs": {}, "df": 0}}
short = json.dumps(index, ensure_ascii=False, separators=(",", ":"))
short = re.sub(r'("tf":\d+\.\d\d)\d+', r"\1", short)
text = text[:begin] + short.replace("\\", "\\\\").replace("'", "\\'") + text[end:]
open(path, "w", encoding="utf-8").write(text)
PY
mv "$work/lab" "$work/site/lab"
size=$(du -sk --apparent-size "$work/site" | cut -f1)
if [ -z "$rustdoc" ]; then
    cargo doc --workspace --no-deps --quiet
    cp -r "$target/doc" "$work/site/rust"
    printf '<meta http-equiv="refresh" content="0; url=standstill_sim/index.html">\n' >"$work/site/rust/index.html"
fi
if [ "$size" -gt 8192 ]; then
    echo "site.sh: the site has $size kB without rustdoc, needed at most 8192; its largest files:" >&2
    (cd "$work/site" && find . -type f -not -path './rust/*' -printf '%k kB %p\n' | sort -rn | head -20) >&2
    exit 1
fi
rm -rf "${out:?}/$version"
mv "$work/site" "$out/$version"
list
echo "the site is in $out/$version: $size kB without rustdoc"
