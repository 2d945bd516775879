#!/usr/bin/env bash
# report_page_test.sh BUILD page | browser | live | exports [SCENES]: the report's page, type-checked and tested in node, or
# opened in a browser; the live page in one; exports read by the packages of other programs. Exit status 77 (skipped) where the page could not be built, or there is no Chromium.
set -euo pipefail
build=$1 what=$2
if [ -f "$build/report/report.missing" ]; then cat "$build/report/report.missing"; exit 77; fi
cd "$build/report/page"
if [ "$what" = page ]; then
  npx --no-install tsc --noEmit
  node test/run.mjs
  # What opens without a network names none.
  ! grep -oE '(src|href)="https?://[^"]*"' "$build/report/report.html"
  exit 0
fi
if [ "$what" = exports ]; then
  exec node test/exports.mjs "$build/mantle" "$3" "$build/tests/work/report_exports"
fi
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$chromium" ]; then echo "no Chromium (apt install chromium)"; exit 77; fi
if [ "$what" = live ]; then
  exec node test/live.mjs "$build/mantle" "$3" "$build/tests/work/live_browser" "$chromium"
fi
node test/browser.mjs "$build/mantle" "$3" "$build/tests/work/report_browser" "$chromium"
