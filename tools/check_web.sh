#!/usr/bin/env bash
# Is the console's page, which is committed, what its sources make? Needs node and npm; where there are none, or their
# packages cannot be fetched, that is said, and nothing else stops.
set -euo pipefail
cd "$(dirname "$0")/../web"
if ! command -v node >/dev/null || ! command -v npm >/dev/null; then
  echo "not compared: there is no node here"
  exit 0
fi
if ! npm ci --silent --no-audit --no-fund >/dev/null 2>&1; then
  echo "not compared: npm cannot fetch the packages of web/package-lock.json"
  exit 0
fi
npm run --silent check
npm run --silent compare
echo "the page is what its sources make"
