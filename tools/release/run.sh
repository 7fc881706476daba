#!/usr/bin/env bash
# Builds everything for a release, in one folder:
#
#   voxtile-VERSION-TARGET.tar.gz     static binaries of voxtile and voxtile-share, man pages, completions, licenses
#   voxtile_VERSION-1_ARCH.deb        the same as Debian packages
#   voxtile-share_VERSION-1_ARCH.deb
#   voxtile*-VERSION.crate            sources of the engine, the command and the crates between, build-tested
#   SHA256SUMS
#
#   tools/release/run.sh [--out FOLDER] [--dirty]
#
# --out: the folder, new or written by an earlier run (default: target/release-VERSION). --dirty: allow uncommitted
# changes. The binaries are for the CPU architecture of this machine. Needs cargo, python3, dpkg-deb, and for static
# binaries `rustup target add $(uname -m)-unknown-linux-musl` and Debian's musl-tools. DEBFULLNAME and DEBEMAIL name the
# maintainer of the Debian packages. The same commit and toolchain give the same bytes.
set -euo pipefail
cd "$(dirname "$0")/../.."

fail() { echo "release: $*" >&2 && exit 2; }

out="" dirty=()
while [[ $# -gt 0 ]]; do
    case $1 in
    --out) out=${2:?--out needs a folder} && shift ;;
    --dirty) dirty=(--allow-dirty) ;;
    *) fail "unknown argument $1; see the head of $0" ;;
    esac
    shift
done

target=$(uname -m)-unknown-linux-musl
[[ -d $(rustc --print sysroot)/lib/rustlib/$target ]] || fail "missing; install with: rustup target add $target"
command -v musl-gcc >/dev/null || fail "missing; install with: apt-get install musl-tools"
command -v dpkg-deb >/dev/null || fail "missing; install with: apt-get install dpkg"
built=${CARGO_TARGET_DIR:-target}
version=$(cargo metadata --no-deps --locked --format-version 1 | python3 -c \
    'import json, sys; print(next(p["version"] for p in json.load(sys.stdin)["packages"] if p["name"] == "voxtile"))')
arch=$(dpkg --print-architecture)
out=${out:-$built/release-$version}
[[ ! -e $out || -e $out/SHA256SUMS ]] || fail "$out: already exists; choose another folder with --out"
# Time stamp of the files in the archives.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Removes paths of this machine from the binaries.
export RUSTFLAGS="--remap-path-prefix=$PWD=voxtile --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo"
cargo build --profile dist --locked --target "$target" --package voxtile-cli --package voxtile-share-node --bins
unset RUSTFLAGS
# shellcheck disable=SC2046
cargo package --locked $(tools/release/published.sh) "${dirty[@]}"

# The installed files, relative to /usr.
tree=$work/voxtile-$version-$target
voxtile=$tree/bin/voxtile
install -D -t "$tree/bin" "$built/$target/dist/voxtile" "$built/$target/dist/voxtile-share"
"$voxtile" man -o "$tree/share/man/man1"
"$tree/bin/voxtile-share" --man >"$tree/share/man/man1/voxtile-share.1"
complete() { # shell, file
    mkdir -p "$(dirname "$tree/share/$2")"
    "$voxtile" completions "$1" >"$tree/share/$2"
}
complete bash bash-completion/completions/voxtile
complete zsh zsh/vendor-completions/_voxtile
complete fish fish/vendor_completions.d/voxtile.fish
install -D -m 644 -t "$tree/share/doc/voxtile" README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE docs/*.md
python3 tools/release/licenses.py "$target" voxtile-cli voxtile-share-node >"$tree/share/doc/voxtile/THIRD-PARTY-LICENSES"

. tools/release/deb.sh
mkdir "$work/out"
deb voxtile "out-of-core probabilistic 3D occupancy mapping" \
    "Maps scans of a lidar, depth camera or sonar into voxels that are occupied, free or unknown. The disk bounds the map,
memory does not: space is divided into tiles, an LRU cache keeps the active ones in memory." \
    bin/voxtile "share/man/man1/voxtile*" share/bash-completion share/zsh share/fish
deb voxtile-share "occupancy map sharing between robots over Zenoh" \
    "Runs as 'voxtile share': sends the occupied voxels of a robot to other robots; lost packets are sent again." \
    bin/voxtile-share share/man/man1/voxtile-share.1

tar --create --gzip --directory "$work" --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$SOURCE_DATE_EPOCH" \
    --file "$work/out/voxtile-$version-$target.tar.gz" "$(basename "$tree")"
for package in $(tools/release/published.sh); do
    if [[ $package != --package ]]; then cp "$built/package/$package-$version.crate" "$work/out/"; fi
done
(cd "$work/out" && sha256sum ./* | sed 's| \./| |' >SHA256SUMS)

tools/release/try.sh "$work/out/voxtile-$version-$target.tar.gz"

rm -rf "$out"
mkdir -p "$(dirname "$out")"
mv "$work/out" "$out"
echo "release: $out"
(cd "$out" && ls -l --block-size=1 && sha256sum --check --quiet SHA256SUMS)
