# Debian packages from the tree of run.sh, which sources this file.

# deb NAME SUMMARY DESCRIPTION FILE...: the files, with those that policy asks for.
deb() {
    local name=$1 summary=$2 description=$3 root=$work/deb-$1 documents file
    shift 3
    documents=$root/usr/share/doc/$name
    mkdir -p "$root/DEBIAN" "$documents" "$root/usr/share/lintian/overrides"
    for file in "$@"; do
        # shellcheck disable=SC2086
        (cd "$tree" && cp --parents --recursive $file "$root/usr/")
    done
    # A page belongs to one package.
    [[ $name == voxtile-share ]] || rm -f "$root/usr/share/man/man1/voxtile-share.1"
    find "$root/usr/share/man" -type f -exec gzip --best --no-name {} +
    gzip --best --no-name <CHANGELOG.md >"$documents/changelog.gz"
    { debian_copyright && cat "$tree/share/doc/voxtile/THIRD-PARTY-LICENSES"; } >"$documents/copyright"
    echo "$name: statically-linked-binary usr/bin/$name" >"$root/usr/share/lintian/overrides/$name"
    control "$name" "$summary" "$description" "$(du --summarize --kilobytes "$root/usr" | cut -f1)" \
        >"$root/DEBIAN/control"
    (cd "$root" && find usr -type f -print0 | sort --zero-terminated | xargs --null md5sum >DEBIAN/md5sums)
    find "$root" -type d -exec chmod 755 {} + -o -type f -exec chmod 644 {} +
    chmod 755 "$root"/usr/bin/*
    dpkg-deb --root-owner-group --build "$root" "$work/out/${name}_${version}_$arch.deb" >/dev/null
}

# control NAME SUMMARY DESCRIPTION KIB
control() {
    cat <<CONTROL
Package: $1
Version: $version
Architecture: $arch
Maintainer: ${DEBFULLNAME:-The voxtile developers} <${DEBEMAIL:-voxtile@localhost.localdomain}>
Installed-Size: $4
Section: science
Priority: optional
CONTROL
    case $1 in
    voxtile) echo "Suggests: voxtile-share" ;;
    *) echo "Enhances: voxtile" ;;
    esac
    echo "Description: $2"
    # One blank before each line.
    fold --spaces --width 78 <<<"${3//$'\n'/ }" | sed 's/^/ /; s/ *$//'
}

debian_copyright() {
    cat <<COPYRIGHT
voxtile: $(sed -n 's/^Copyright/copyright/p' LICENSE-MIT).

It is licensed, at your option, under the Apache License 2.0 (on Debian systems in
/usr/share/common-licenses/Apache-2.0) or under the MIT license:

$(cat LICENSE-MIT)

The binary holds these crates of others, and parts of the C library musl (MIT license, copyright 2005-2020 Rich Felker
and others).

COPYRIGHT
}
