#!/usr/bin/env bash
# Builds crates/view/page/dist, which is embedded in the command: the page with its dependencies, in four files.
#
#   crates/view/page/bundle.sh            with the packages of package-lock.json
#   crates/view/page/bundle.sh --check    checks that crates/view/page/dist is up to date and small enough
set -euo pipefail
cd "$(dirname "$0")"
most_gzip=240000

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp package.json package-lock.json "$work"
cp -r src "$work/src"
(cd "$work" && npm ci --silent --no-audit --no-fund --ignore-scripts >/dev/null)
out=$work/dist
mkdir "$out"
(cd "$work" && node node_modules/esbuild-wasm/bin/esbuild src/main.js --bundle --minify --format=iife --target=es2022 \
    --legal-comments=none --log-level=warning --outfile=dist/page.js)
(cd "$work" && node node_modules/esbuild-wasm/bin/esbuild src/page.css --minify --log-level=warning --outfile=dist/page.css)
cp src/index.html "$out/index.html"
for package in three 3d-tiles-renderer; do
    version=$(node -p "require('$work/node_modules/$package/package.json').version")
    printf '%s %s\n\n' "$package" "$version"
    cat "$work/node_modules/$package/LICENSE"
    printf '\n\n'
done >"$out/licences.txt"

bytes=$(cat "$out/page.js" | wc -c)
gzip=$(gzip -9 -c "$out/page.js" | wc -c)
printf 'page.js: %d bytes, %d as gzip (at most %d)\n' "$bytes" "$gzip" "$most_gzip"
if ((gzip > most_gzip)); then exit 1; fi
if [[ ${1:-} == --check ]]; then
    diff -r "$out" dist && echo 'crates/view/page/dist is up to date'
else
    rm -rf dist
    cp -r "$out" dist
fi
