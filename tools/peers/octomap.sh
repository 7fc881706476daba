# OctoMap's side of the benchmark `peers`, compiled; tools/bench.sh sources this file.

# Sets `version` and `contenders`, the arguments that name the programs.
octomap_contenders() {
    local missing=()
    command -v g++ >/dev/null || missing+=(g++)
    [[ -e /usr/include/octomap/octomap.h || -e /usr/local/include/octomap/octomap.h ]] || missing+=(liboctomap-dev)
    if [[ ${#missing[@]} -gt 0 ]]; then
        echo "peers: missing; install with: apt-get install ${missing[*]}" >&2
        exit 2
    fi
    version=$(dpkg-query -W -f '${Version}' liboctomap-dev 2>/dev/null) || version="of unknown version"
    mkdir -p "$target/peers"
    contenders=(--voxtile "$target/release/voxtile_contender" --octomap "$target/peers/octomap")
    compile octomap -O2
    if [[ " $* " != *" --short "* ]]; then
        compile octomap_native -O3 -march=native
        contenders+=(--octomap-native "$target/peers/octomap_native")
    fi
}

# Without contracted operations, like Debian's library: fused multiply-add visits slightly other voxels. OctoMap's
# headers hold the ray walk and the insertion, so both are compiled here, not only in the library.
compile() { # program, options
    local program=$target/peers/$1
    shift
    g++ -std=c++17 "$@" -DNDEBUG -ffp-contract=off -Wall -o "$program" tools/peers/octomap_contender.cpp \
        -loctomap -loctomath
}
