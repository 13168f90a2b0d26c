#!/bin/sh
# Makes src/report/page.html, the page that rayrep puts its reports into, of what lies here, three.js and esbuild. Needs node and
# npm; building rayrep does not. Versions are those of package.json, exactly.
#
#   tools/report/bundle.sh           makes it
#   tools/report/bundle.sh --check   tells whether it is what would be made
set -eu
here=$(cd "$(dirname "$0")" && pwd)
page="$here/../../src/report/page.html"
work="${TMPDIR:-/tmp}/rayrep-report-page-$(id -u)"
mkdir -p "$work"
cp "$here/package.json" "$work/"
cd "$work"
npm install --silent --no-audit --no-fund --no-package-lock
cp "$here/bundle.mjs" "$work/"
if [ "${1-}" = "--check" ]; then
  node bundle.mjs "$here" "$work/page.html"
  cmp "$work/page.html" "$page"
else
  node bundle.mjs "$here" "$page"
fi
