#!/usr/bin/env bash
# Installs the provider (OpenID Connect) that tests of single sign-on talk to. Where there is no node, or its packages
# cannot be fetched, that is said, and these tests are skipped with their reason.
set -euo pipefail
cd "$(dirname "$0")/../tests/equipment/oidc"
if ! command -v node >/dev/null || ! command -v npm >/dev/null; then
  echo "there is no node here: tests of single sign-on are skipped"
elif npm ci --silent --no-audit --no-fund >/dev/null 2>&1; then
  echo "it is installed"
else
  echo "npm cannot fetch its packages: tests of single sign-on are skipped"
fi
