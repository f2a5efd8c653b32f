#!/usr/bin/env bash
# Measure what docs/results/cstr.md states and write that page. Takes about half an hour on 2 cores.
set -euo pipefail
cd "$(dirname "$0")/.."
.venv/bin/python benchmarks/cstr_results.py "$@"
