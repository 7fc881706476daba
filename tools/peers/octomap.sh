# Compiles OctoMap's side of the benchmark `peers`; tools/bench.sh sources this file.

# Sets `version`, and `contenders` to the arguments that name the programs.
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

# Compiled without fused multiply-add, like Debian's library: with it, rays would visit slightly different voxels. The
# ray walk and the insertion are in OctoMap's headers, so both are compiled here.
compile() { # program, options
    local program=$target/peers/$1
    shift
    g++ -std=c++17 "$@" -DNDEBUG -ffp-contract=off -Wall -o "$program" tools/peers/octomap_contender.cpp \
        -loctomap -loctomath
}
