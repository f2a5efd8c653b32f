#!/usr/bin/env bash
# The quick tests with every other Python from 3.11 on that is on this machine, each with the locked packages it needs.
# A Python without wheels for one of them is named and left out. `newest` stops at the newest that could be tested.
set -euo pipefail
cd "$(dirname "$0")/.."
own=$(.venv/bin/python -c 'import sys; print("%d.%d" % sys.version_info[:2])')
tests=$(sed -n 's/^QUICK := //p' Makefile)

# Where python$1 is; a shim of pyenv answers for versions that are installed and not chosen, too.
interpreter() {
  local found
  for found in $(type -aP "python$1") "$HOME"/.pyenv/versions/"$1".*/bin/python; do
    if "$found" -c "import sys, venv; sys.exit('%d.%d' % sys.version_info[:2] != '$1')" 2>/dev/null; then
      echo "$found"
      return
    fi
  done
}

for version in 3.14 3.13 3.12 3.11; do
  if [[ $version == "$own" ]]; then continue; fi
  python=$(interpreter "$version")
  if [[ -z $python ]]; then
    echo "Python $version is not here"
    continue
  fi
  environment=build/python$version
  .venv/bin/uv venv --quiet --clear --python "$python" "$environment"
  if ! .venv/bin/uv pip install --quiet --python "$environment" --only-binary :all: -r requirements/base.txt \
    -c requirements/dev.txt hypothesis psutil pytest pytest-timeout pytest-xdist; then
    if [[ $version == 3.14 ]]; then
      echo "Python $version: not every package has a wheel"
      continue
    fi
    exit 1
  fi
  echo "Python $version"
  # shellcheck disable=SC2086  # several folders
  PYTHONPATH=src "$environment/bin/pytest" -q -n 2 --dist worksteal -m quick $tests
  if [[ ${1:-} == newest ]]; then break; fi
done
