#!/usr/bin/env bash
# Measure what the pages of docs/results state and write them. Takes more than an hour on 2 cores, and the last page
# several; what was measured before is read back from runs/ and build/unknown/. docs/results/replay.md needs recorded
# answers, which are not part of the project: `python -m benchmarks.replay_results --records FILE`.
set -euo pipefail
cd "$(dirname "$0")/.."
.venv/bin/python -m benchmarks.cstr_results "$@"
.venv/bin/python -m benchmarks.language_results
.venv/bin/python -m benchmarks.mixing_results
.venv/bin/python -m benchmarks.campaign_results
.venv/bin/python -m benchmarks.scale_results
.venv/bin/python -m benchmarks.unknown --jobs 2
# Recordings of others, beside the project: see docs/results/monitor.md.
if [[ -d ../shared/data/skab && -d ../shared/data/tep ]]; then .venv/bin/python -m benchmarks.monitor; fi
