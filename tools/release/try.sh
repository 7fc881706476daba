#!/usr/bin/env bash
# Unpacks an archive of tools/release/run.sh into a temporary folder and runs its binaries there: try.sh ARCHIVE
#
# Binaries for another architecture run under qemu-user-static (Debian package), if it is installed. Those for glibc also
# need the libraries of that architecture below QEMU_LD_PREFIX (default: those of libc6-ARCH-cross).
set -euo pipefail
fail() { echo "release: $*" >&2 && exit 1; }
archive=$(realpath "$1")
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
cd "$place"
tar --extract --gzip --strip-components 1 --file "$archive"

cpu=$(sed 's/.*-\([a-z0-9_]*\)-unknown-linux-[a-z]*.tar.gz$/\1/' <<<"$archive")
emulator=()
if [[ $cpu != $(uname -m) ]]; then
    emulator=("$(command -v "qemu-$cpu-static")") || {
        echo "release: $archive: not tried; qemu-$cpu-static is not installed"
        exit 0
    }
    export QEMU_LD_PREFIX=${QEMU_LD_PREFIX:-/usr/$cpu-linux-gnu}
    # Without it the programs start themselves again to set it, which the emulator alone cannot do.
    export MALLOC_ARENA_MAX=1
    if [[ $archive != *-musl.tar.gz ]] && ! compgen -G "$QEMU_LD_PREFIX/lib/ld-linux-*" >/dev/null; then
        echo "release: $archive: not tried; QEMU_LD_PREFIX names no folder with glibc for $cpu"
        exit 0
    fi
fi

for program in voxtile voxtile-share voxtile-ros2; do
    # Either static, or for a glibc that is old enough for every system in use.
    case $archive in
    *-musl.tar.gz) if readelf --program-headers "bin/$program" | grep -q INTERP; then fail "$program is not static"; fi ;;
    *) if readelf --version-info "bin/$program" | grep -qE 'GLIBC_2\.(1[89]|[2-9][0-9])'; then
        fail "$program needs a glibc newer than 2.17"
    fi ;;
    esac
    echo "$program: $(stat --format=%s "bin/$program") bytes, $("${emulator[@]}" "bin/$program" --version)"
done

# Runs without the repository, cargo and the libraries of this machine: in a chroot if permitted.
run() { env --ignore-environment PATH="$place/bin" MALLOC_ARENA_MAX="${MALLOC_ARENA_MAX:-1}" QEMU_LD_PREFIX="${QEMU_LD_PREFIX:-}" "${emulator[@]}" "bin/$1" "${@:2}"; }
if [[ ${#emulator[@]} -eq 0 && $archive == *-musl.tar.gz ]] && unshare --map-root-user true 2>/dev/null; then
    mkdir --parents tmp
    programs=("$(command -v unshare)" --map-root-user "$(command -v chroot)" "$place")
    run() { env --ignore-environment "${programs[@]}" "/bin/$1" "${@:2}"; }
fi
run voxtile demo --out demo --length 20 >/dev/null
run voxtile verify demo/map_tiles
run voxtile export demo/map_tiles -o map.bt >/dev/null
run voxtile export demo/map_tiles -o map.ply >/dev/null
if [[ ${#emulator[@]} -eq 0 ]]; then run voxtile share --help >/dev/null; fi
run voxtile-ros2 --help >/dev/null
test -s demo/map.png && test -s map.bt && test -s map.ply
for scan in 0 1 2; do
    printf 'VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n' \
        >"$scan.pcd"
    printf '4 %d 0\n4 %d.5 0\n5 %d 1\n' $scan $scan $scan >>"$scan.pcd"
done
run voxtile build . -o map --poses identity >/dev/null
run voxtile digest map
man --warnings --local-file share/man/man1/voxtile-build.1 >/dev/null 2>&1 || ! command -v man >/dev/null
bash -n share/bash-completion/completions/voxtile
echo "release: the binaries build, verify and export maps"
