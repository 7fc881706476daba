# Builds Debian packages from the tree of run.sh, which sources this file.

maintainer="${DEBFULLNAME:-The voxtile developers} <${DEBEMAIL:-voxtile@localhost.localdomain}>"

# deb NAME SUMMARY DESCRIPTION FILE...: packages the files for $arch, with the documents that Debian policy requires.
deb() {
    local name=$1 summary=$2 description=$3 root=$work/deb-$1-$arch documents file
    shift 3
    documents=$root/usr/share/doc/$name
    mkdir -p "$root/DEBIAN" "$documents"
    for file in "$@"; do
        # shellcheck disable=SC2086
        (cd "$tree" && cp --parents --recursive $file "$root/usr/")
    done
    if [[ $name == voxtile-ros2 ]]; then
        install -D -m 644 crates/ros2/systemd/node.yaml "$root/etc/voxtile/node.yaml"
        echo /etc/voxtile/node.yaml >"$root/DEBIAN/conffiles"
    fi
    # Each manual page belongs to one package.
    [[ $name == voxtile-share ]] || rm -f "$root/usr/share/man/man1/voxtile-share.1"
    if [[ -d $root/usr/share/man ]]; then find "$root/usr/share/man" -type f -exec gzip --best --no-name {} +; fi
    gzip --best --no-name <CHANGELOG.md >"$documents/changelog.gz"
    debian_changelog "$name" | gzip --best --no-name >"$documents/changelog.Debian.gz"
    gzip --best --no-name <"$tree/share/doc/voxtile/THIRD-PARTY-LICENSES" >"$documents/THIRD-PARTY-LICENSES.gz"
    debian_copyright >"$documents/copyright"
    control "$name" "$summary" "$description" "$(du --summarize --block-size=1K "$root/usr" | cut -f1)" \
        >"$root/DEBIAN/control"
    (cd "$root" && find usr -type f -print0 | sort --zero-terminated | xargs --null md5sum >DEBIAN/md5sums)
    find "$root" -type d -exec chmod 755 {} + -o -type f -exec chmod 644 {} +
    chmod 755 "$root"/usr/bin/*
    dpkg-deb --root-owner-group --build "$root" "$work/out/${name}_${version}-1_$arch.deb" >/dev/null
}

# control NAME SUMMARY DESCRIPTION KIB
control() {
    cat <<CONTROL
Package: $1
Version: $version-1
Architecture: $arch
Maintainer: $maintainer
Installed-Size: $4
Depends: libc6 (>= 2.17)
Section: science
Priority: optional
CONTROL
    case $1 in
    voxtile) echo "Suggests: voxtile-share, voxtile-ros2" ;;
    *) echo "Enhances: voxtile" ;;
    esac
    echo "Description: $2"
    # Debian requires a blank before each line of a description.
    fold --spaces --width 78 <<<"${3//$'\n'/ }" | sed 's/^/ /; s/ *$//'
}

debian_changelog() {
    cat <<CHANGELOG
$1 ($version-1) unstable; urgency=medium

  * Version $version; changelog.gz has its changes.

 -- $maintainer  $(date --utc --rfc-email --date="@$SOURCE_DATE_EPOCH")
CHANGELOG
}

debian_copyright() {
    cat <<COPYRIGHT
voxtile: $(sed -n 's/^Copyright/copyright/p' LICENSE-MIT).

It is licensed, at your option, under the Apache License 2.0 (on Debian systems in
/usr/share/common-licenses/Apache-2.0) or under the MIT license:

$(cat LICENSE-MIT)

The binary contains third-party crates, whose licenses are in THIRD-PARTY-LICENSES.gz.
COPYRIGHT
}
