#!/usr/bin/env bash
# Is there a Chromium for the tests of the console's page? Where there is none, Debian's is installed if that can be done;
# else it is said why not, and these tests are skipped with their reason.
set -euo pipefail
if command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null; then
  echo "there is one"
  exit 0
fi
if [[ $(id -u) -ne 0 ]] || ! command -v apt-get >/dev/null; then
  echo "there is none, and it cannot be installed here (that needs root and apt-get): tests of the page are skipped"
  exit 0
fi
export DEBIAN_FRONTEND=noninteractive
if apt-get -qq update >/dev/null 2>&1 && apt-get -qq install --no-install-recommends chromium >/dev/null 2>&1; then
  echo "Debian's was installed"
else
  echo "there is none, and apt-get cannot install it: tests of the page are skipped"
fi
