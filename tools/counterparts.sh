#!/usr/bin/env bash
# Installs what tests of the link talk to that is not ours: node-opcua, as server and as client, and a process module by
# MTPPy, in an environment of its own: it needs python-opcua, which nobody keeps any more and which an advisory names
# (CVE-2022-25304), so that nothing else may import it. What cannot be fetched is said, and its tests are skipped with
# their reason.
set -euo pipefail
cd "$(dirname "$0")/.."
python=$PWD/.venv/bin/python mtp=$PWD/.mtp-venv
cd tests/equipment/opcua
if ! command -v node >/dev/null || ! command -v npm >/dev/null; then
  echo "node-opcua: there is no node here"
elif npm ci --silent --no-audit --no-fund >/dev/null 2>&1; then
  echo "node-opcua: it is installed"
else
  echo "node-opcua: npm cannot fetch its packages"
fi
if [[ -e $mtp/.ready && ! mtp_module.txt -nt $mtp/.ready ]]; then
  echo "MTPPy: it is installed"
elif "$python" -m venv --clear "$mtp" >/dev/null 2>&1 &&
  "$mtp/bin/pip" --disable-pip-version-check --quiet install --require-hashes -r mtp_module.txt >/dev/null 2>&1; then
  touch "$mtp/.ready"
  echo "MTPPy: it is installed"
else
  echo "MTPPy: pip cannot fetch its packages"
fi
