#!/usr/bin/env bash
# Tries the files of tools/release/run.sh on systems without Rust: the archives, the Debian packages and the wheel.
#
#   tools/release/try_on.sh RELEASE [SYSTEM]...     prints a table; exits with 1 if something failed
#
# RELEASE: the folder that run.sh wrote. SYSTEM: a Debian release, installed by debootstrap into a temporary folder
# (default: bullseye bookworm trixie), or a folder with the root of another system, for example an unpacked container
# image of Alpine, Fedora or Ubuntu. Such a folder gets files in /release, /opt and /tmp; with qemu-user-static and
# binfmt_misc it may be of another architecture, such as one of `debootstrap --arch=arm64`. Needs root, debootstrap, and a
# network for the wheel of numpy.
set -euo pipefail

fail() { echo "try_on: $*" >&2 && exit 2; }

[[ $# -ge 1 ]] || fail "which release? see the head of $0"
release=$(realpath "$1") && shift
[[ -e $release/SHA256SUMS ]] || fail "$release: not written by tools/release/run.sh"
[[ $(id -u) -eq 0 ]] || fail "must be run by root"
data=$(realpath "$(dirname "$0")/../../crates/formats/tests/data/ros/folder")
systems=("$@")
if [[ $# -eq 0 ]]; then systems=(bullseye bookworm trixie); fi
work=$(mktemp -d)
mounted=()
# Unmount first, so that no file of this machine is removed.
trap 'for place in "${mounted[@]}"; do umount "$place"; done; rm -rf --one-file-system "$work"' EXIT
failed=""

# Runs a command in the root $root.
inside() {
    env --ignore-environment HOME=/root LANG=C.UTF-8 PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
        chroot "$root" "$@"
}

# Maps a synthetic city, and a recording in a SQLite file, with the command $1.
maps_and_exports() {
    inside "$1" demo --out /tmp/demo --length 20
    inside "$1" verify /tmp/demo/map_tiles
    inside "$1" export /tmp/demo/map_tiles -o /tmp/demo/map.laz
    inside "$1" scans /release/recording --topic /points
    inside rm -r /tmp/demo
}

archive() {
    local folder
    inside mkdir -p /opt
    tar --extract --gzip --directory "$root/opt" --file "$release/voxtile-$version-$cpu-unknown-linux-$1.tar.gz"
    folder=/opt/voxtile-$version-$cpu-unknown-linux-$1
    maps_and_exports "$folder/bin/voxtile"
    inside "$folder/bin/voxtile" share --help
    inside "$folder/bin/voxtile-ros2" --help
    inside rm -r "$folder"
}

archive_gnu() { archive gnu; }
archive_musl() { archive musl; }

packages() {
    inside sh -c "dpkg --install /release/voxtile_*_$deb_arch.deb /release/voxtile-*_$deb_arch.deb"
    maps_and_exports voxtile
    inside voxtile-share --help
    inside voxtile-ros2 --help
    inside test -e /usr/lib/systemd/system/voxtile-ros2.service
    inside dpkg --remove voxtile voxtile-share voxtile-ros2
}

wheel() {
    inside python3 -m venv /tmp/venv
    inside /tmp/venv/bin/pip install --quiet --no-index --find-links /release voxtile
    maps_and_exports /tmp/venv/bin/voxtile
    inside /tmp/venv/bin/python -c '
import numpy, voxtile
with voxtile.Map.create("/tmp/map", resolution=0.1) as city:
    city.insert(numpy.array([[4.0, 0.0, 1.0]]), origin=[0.0, 0.0, 1.0])
    assert city.occupancy([[4.0, 0.0, 1.0]])[0] > 0.5'
    inside rm -r /tmp/venv /tmp/map
}

# Prints the result of a trial: ran, failed, or why it was skipped.
result() {
    local log=$work/$1.log
    if ("$1") >"$log" 2>&1; then
        echo ran
    else
        tail -n 20 "$log" | sed "s|^|$name, $1: |" >&2
        echo "**failed**"
    fi
}

archives=("$release"/voxtile-*-unknown-linux-musl.tar.gz)
version=$(basename "${archives[0]}")
version=${version#voxtile-} version=${version%%-[a-z]*}

printf '| system | C library | archive | static archive | packages | wheel |\n|---|---|---|---|---|---|\n'
for system in "${systems[@]}"; do
    root=$system
    if [[ ! -d $system ]]; then
        root=$work/$system
        debootstrap --variant=minbase --include=python3-venv "$system" "$root" http://deb.debian.org/debian \
            >"$work/debootstrap.log" 2>&1 || { tail "$work/debootstrap.log" >&2 && exit 1; }
    fi
    root=$(realpath "$root")
    name=$(. "$root/etc/os-release" && echo "$PRETTY_NAME")
    for place in proc dev; do
        mount --bind "/$place" "$root/$place"
        mounted+=("$root/$place")
    done
    mkdir -p "$root/release"
    cp "$release"/* "$root/release/"
    cp -r "$data" "$root/release/recording"
    cpu=$(inside uname -m)
    case $cpu in
    x86_64) deb_arch=amd64 ;;
    *) deb_arch=arm64 ;;
    esac
    libc=$(inside sh -c 'ldd --version 2>&1 | head -n 1' || true)

    ran_gnu="no glibc"
    if [[ ! $libc =~ musl ]]; then ran_gnu=$(result archive_gnu); fi
    ran_musl=$(result archive_musl)
    ran_packages="no dpkg"
    if inside sh -c 'command -v dpkg' >/dev/null; then ran_packages=$(result packages); fi
    ran_wheel="no Python"
    if python=$(inside python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null); then
        ran_wheel="Python $python is too old"
        if ((${python#3.} >= 10)); then
            pip download --quiet --only-binary :all: --no-deps --python-version "$python" \
                --platform "manylinux_2_27_$cpu" --platform "manylinux2014_$cpu" --dest "$root/release" numpy
            ran_wheel="$(result wheel) (Python $python)"
        fi
    fi
    rm -r "$root/release"
    row="| $name, $cpu | ${libc:-unknown} | $ran_gnu | $ran_musl | $ran_packages | $ran_wheel |"
    echo "$row"
    if [[ $row == *failed* ]]; then failed=1; fi
    for place in "${mounted[@]}"; do umount "$place"; done
    mounted=()
done
[[ ! $failed ]]
