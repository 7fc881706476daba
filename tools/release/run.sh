#!/usr/bin/env bash
# Builds everything for a release, in one folder:
#
#   voxtile-VERSION-ARCH-unknown-linux-gnu.tar.gz   voxtile, voxtile-share and voxtile-ros2 for glibc 2.17 or newer, the
#                                                   tutorial's workload, man pages, completions, licenses
#   voxtile-VERSION-ARCH-unknown-linux-musl.tar.gz  the same, static: for systems without glibc, and a quarter slower
#   voxtile{,-share,-ros2}_VERSION-1_ARCH.deb       the first archive as Debian packages
#   voxtile-VERSION-*.whl                           the Python package with the command, for glibc 2.17 or newer
#   voxtile-VERSION-oci.tar                         container image of all architectures, with the static binaries
#   voxtile-*-VERSION-ARCH.cdx.json                 the crates in each program (CycloneDX SBOM)
#   voxtile*-VERSION.crate                          sources of the engine, the command and the crates between
#   SHA256SUMS
#
#   tools/release/run.sh [--out FOLDER] [--arch ARCH]... [--dirty]
#
# --out: the folder, new or written by an earlier run (default: target/release-VERSION). --arch: x86_64 or aarch64
# (default: both). --dirty: allow uncommitted changes. Needs an x86-64 or aarch64 Linux with cargo, rustup, python3,
# dpkg-deb and a network: zig (the C compiler and linker for every target) comes from PyPI, the standard libraries from
# rustup, cargo-cyclonedx from crates.io. DEBFULLNAME and DEBEMAIL name the maintainer of the Debian packages. The same
# commit and tools give the same bytes.
set -euo pipefail
cd "$(dirname "$0")/../.."

fail() { echo "release: $*" >&2 && exit 2; }

out="" dirty=() arches=()
while [[ $# -gt 0 ]]; do
    case $1 in
    --out) out=${2:?--out needs a folder} && shift ;;
    --arch) arches+=("${2:?--arch needs x86_64 or aarch64}") && shift ;;
    --dirty) dirty=(--allow-dirty) ;;
    *) fail "unknown argument $1; see the head of $0" ;;
    esac
    shift
done
if [[ ${#arches[@]} -eq 0 ]]; then arches=(x86_64 aarch64); fi

# Prints Debian's name of an architecture, which is also the name in container images.
debian_arch() {
    case $1 in
    x86_64) echo amd64 ;;
    aarch64) echo arm64 ;;
    *) fail "unknown architecture $1; known: x86_64, aarch64" ;;
    esac
}
for arch in "${arches[@]}"; do debian_arch "$arch" >/dev/null; done
command -v dpkg-deb >/dev/null || fail "missing; install with: apt-get install dpkg"
built=$(realpath -m "${CARGO_TARGET_DIR:-target}")
version=$(cargo metadata --no-deps --locked --format-version 1 | python3 -c \
    'import json, sys; print(next(p["version"] for p in json.load(sys.stdin)["packages"] if p["name"] == "voxtile"))')
out=${out:-$built/release-$version}
[[ ! -e $out || -e $out/SHA256SUMS ]] || fail "$out: already exists; choose another folder with --out"
# Time stamp of the files in the archives.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH

work=$(mktemp -d)
# cargo-cyclonedx writes a list beside each manifest of the workspace.
remove_boms() { rm -f sbom.tmp.json {crates/*,tools/*,python}/sbom.tmp.json; }
trap 'rm -rf "$work" python/*LICENSE*; remove_boms' EXIT
mkdir "$work/out"

tools=$built/release_tools
if [[ ! -x $tools/bin/python ]]; then python3 -m venv "$tools"; fi
"$tools/bin/pip" install --quiet cargo-zigbuild==0.24.1 ziglang==0.16.0 'maturin>=1.9,<2' certifi
if [[ ! -x $tools/bin/cargo-cyclonedx ]]; then
    CARGO_TARGET_DIR=$tools/build cargo install --quiet --locked --root "$tools" cargo-cyclonedx@0.5.9
    rm -rf "$tools/build"
fi
export PATH=$tools/bin:$PATH

# A folder of its own: cargo takes a crate of the same version from an earlier run for the same crate.
# shellcheck disable=SC2046
CARGO_TARGET_DIR=$work/packages cargo package --locked $(tools/release/published.sh) "${dirty[@]}"
for package in $(tools/release/published.sh); do
    if [[ $package != --package ]]; then cp "$work/packages/package/$package-$version.crate" "$work/out/"; fi
done
rm -rf "$work/packages"

. tools/release/deb.sh

# Paths of this machine do not belong into binaries.
remapped="--remap-path-prefix=$PWD=voxtile --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo"
# Releases have every feature.
binaries=(--package voxtile-cli --package voxtile-share-node --package voxtile-ros2 --package workload)
features=voxtile-cli/bucket,voxtile-cli/parquet,voxtile-ros2/zenoh

# Writes man pages and completions, which are equal for all architectures, to $1. $2 has binaries for this machine.
documents() {
    local voxtile=$2/voxtile share=$1/share
    "$voxtile" man -o "$share/man/man1"
    "$2/voxtile-share" --man >"$share/man/man1/voxtile-share.1"
    mkdir -p "$share/bash-completion/completions" "$share/zsh/vendor-completions" "$share/fish/vendor_completions.d"
    "$voxtile" completions bash >"$share/bash-completion/completions/voxtile"
    "$voxtile" completions zsh >"$share/zsh/vendor-completions/_voxtile"
    "$voxtile" completions fish >"$share/fish/vendor_completions.d/voxtile.fish"
    install -D -m 644 -t "$share/doc/voxtile" README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE docs/*.md
}

# Builds the archive of a target. $2 is its name for zig, which has the version of glibc.
archive() {
    local target=$1 tree=$work/voxtile-$version-$1
    rustup --quiet target add "$target"
    RUSTFLAGS="$remapped" cargo zigbuild --profile dist --locked --target "$2" "${binaries[@]}" --bins \
        --features "$features"
    # The installed files, relative to /usr.
    install -D -t "$tree/bin" "$built/$target/dist/"{voxtile,voxtile-share,voxtile-ros2,workload}
    if [[ ! -d $work/documents ]]; then
        local runnable=$tree/bin
        if [[ $target != $(uname -m)-* ]]; then
            cargo build --locked --package voxtile-cli --package voxtile-share-node --bins --features voxtile-cli/bucket
            runnable=$built/debug
        fi
        documents "$work/documents" "$runnable"
    fi
    cp -r "$work/documents/." "$tree/"
    python3 tools/release/licenses.py "$target" "$features" voxtile-cli voxtile-share-node voxtile-ros2 \
        >"$tree/share/doc/voxtile/THIRD-PARTY-LICENSES"
    # A package needs no account of its own.
    mkdir -p "$tree/lib/systemd/system"
    sed 's|/usr/local/bin|/usr/bin|; s|^User=voxtile$|DynamicUser=yes|; /^# *useradd/d' \
        crates/ros2/systemd/voxtile-ros2.service >"$tree/lib/systemd/system/voxtile-ros2.service"
    tar --create --gzip --directory "$work" --sort=name --owner=0 --group=0 --numeric-owner \
        --mtime="@$SOURCE_DATE_EPOCH" --file "$work/out/voxtile-$version-$target.tar.gz" "$(basename "$tree")"
}

# Builds the Debian packages of an architecture from its archive.
packages() {
    local arch tree=$work/voxtile-$version-$1-unknown-linux-gnu
    arch=$(debian_arch "$1")
    deb voxtile "out-of-core probabilistic 3D occupancy mapping" \
        "Maps scans of a lidar, depth camera or sonar into voxels that are occupied, free or unknown. The disk bounds the
map, memory does not: space is divided into tiles, an LRU cache keeps the active ones in memory." \
        bin/voxtile "share/man/man1/voxtile*" share/bash-completion share/zsh share/fish
    deb voxtile-share "occupancy map sharing between robots over Zenoh" \
        "Runs as 'voxtile share': sends the occupied voxels of a robot to other robots; lost packets are sent again." \
        bin/voxtile-share share/man/man1/voxtile-share.1
    deb voxtile-ros2 "ROS 2 node for out-of-core 3D occupancy mapping" \
        "Maps point clouds of ROS 2 topics, over DDS or Zenoh, and publishes the map. It needs no ROS installation." \
        bin/voxtile-ros2 lib/systemd
}

# Lists the crates in each program of an architecture.
boms() {
    local package selected
    for package in cli share-node ros2; do
        selected=()
        case $package in
        cli) selected=(--features bucket,parquet) ;;
        ros2) selected=(--features zenoh) ;;
        esac
        cargo cyclonedx --quiet --format json --spec-version 1.5 --target "$1-unknown-linux-gnu" "${selected[@]}" \
            --manifest-path "crates/$package/Cargo.toml" --override-filename sbom.tmp
        mv "crates/$package/sbom.tmp.json" "$work/out/voxtile-$package-$version-$1.cdx.json"
        remove_boms
    done
}

# Builds the wheel of an architecture.
wheel() {
    # Licenses belong into the wheel, and must be below the folder of pyproject.toml.
    cp LICENSE-MIT LICENSE-APACHE "$work/voxtile-$version-$1-unknown-linux-gnu/share/doc/voxtile/THIRD-PARTY-LICENSES" \
        python/
    RUSTFLAGS="$remapped" maturin build --quiet --profile dist --locked --zig --target "$1-unknown-linux-gnu" \
        --compatibility manylinux2014 --manifest-path python/Cargo.toml \
        --features voxtile-cli/bucket,voxtile-cli/parquet --out "$work/out"
    rm python/*LICENSE*
}

for arch in "${arches[@]}"; do
    archive "$arch-unknown-linux-gnu" "$arch-unknown-linux-gnu.2.17"
    archive "$arch-unknown-linux-musl" "$arch-unknown-linux-musl"
    packages "$arch"
    boms "$arch"
    wheel "$arch"
done
"$tools/bin/python" tools/release/image.py "$work/out/voxtile-$version-oci.tar" "$version" "$work"/voxtile-"$version"-*-linux-musl
(cd "$work/out" && sha256sum ./* | sed 's| \./| |' >SHA256SUMS)

for archive in "$work/out/"voxtile-*.tar.gz; do tools/release/try.sh "$archive"; done

rm -rf "$out"
mkdir -p "$(dirname "$out")"
mv "$work/out" "$out"
echo "release: $out"
(cd "$out" && ls -l --block-size=1 && sha256sum --check --quiet SHA256SUMS)
