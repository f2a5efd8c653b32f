#!/usr/bin/env bash
# Makes every plant's knowledge graph from its engineering tables: src/homeostat/plants/*/plant.ttl, or, where a folder is
# given, FOLDER/<plant>.ttl. morph-kgc carries out the RML mapping in an environment of its own, because it pins other versions
# of the graph libraries; homeostat.knowledge.build states the same by itself, refuses any difference, and completes the graph.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD out=${1:-}
python=$root/.venv/bin/python
rml=$root/.rml-venv

if [[ ! -x $python ]]; then
  echo "make_graph: there is no .venv; run 'make graph' instead, which makes it." >&2
  exit 1
fi
if [[ ! -e $rml/.ready || requirements/rml.txt -nt $rml/.ready ]]; then
  "$python" -m venv --clear "$rml"
  "$rml/bin/python" -m pip --disable-pip-version-check --quiet install --only-binary :all: --require-hashes \
    -r requirements/rml.txt
  touch "$rml/.ready"
fi

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
for settings in src/homeostat/plants/*/case.toml; do
  folder=$(dirname "$settings") plant=$(basename "$(dirname "$settings")")
  # An empty cell makes no statement; no other text counts as empty.
  printf '[CONFIGURATION]\nna_values: ,\noutput_file: %s\noutput_format: N-TRIPLES\nlogging_level: WARNING\n' \
    "$scratch/$plant.nt" >"$scratch/$plant.ini"
  printf 'number_of_processes: 1\n[plant]\nmappings: %s\n' "$root/src/homeostat/knowledge/build/mapping.rml.ttl" \
    >>"$scratch/$plant.ini"
  PYTHONPATH=src "$python" -m homeostat.knowledge.build "$folder" --whole "$scratch/$plant"  # every row, in files
  (cd "$scratch/$plant" && "$rml/bin/python" -m morph_kgc "$scratch/$plant.ini")
  target=$folder/plant.ttl
  if [[ -n $out ]]; then target=$out/$plant.ttl; fi
  PYTHONPATH=src "$python" -m homeostat.knowledge.build "$folder" --triples "$scratch/$plant.nt" --out "$target"
done
