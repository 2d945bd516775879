#!/usr/bin/env bash
# book_test.sh BUILD: builds the book, and opens every page from the disk where there is a Chromium.
set -euo pipefail
build=$(realpath "$1")
cd "$(dirname "$0")/../.."
tools/book "$build/book"
playwright=$build/report/page/node_modules/playwright-core
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$chromium" ] || [ ! -d "$playwright" ]; then
  echo "the book was built and not opened: no Chromium (apt install chromium), or no page of the report"
  exit 0
fi
node tests/docs/book_browser.mjs "$build/book" "$playwright" "$chromium"
