#!/usr/bin/env bash
# A day of an attached reactor at twenty times real time, a fault every two hours: 72 minutes. It goes on where it was
# stopped, in runs/attached/day; give another folder with --dir, and a shorter day with --hours.
set -euo pipefail
cd "$(dirname "$0")/.."
exec .venv/bin/python -m benchmarks.attached.day "$@"
