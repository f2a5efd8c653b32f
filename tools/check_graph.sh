#!/usr/bin/env bash
# The knowledge graphs in the tree are what their engineering tables make: builds them again and compares byte for byte.
set -euo pipefail
cd "$(dirname "$0")/.."

fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT
bash tools/make_graph.sh "$fresh"
for settings in src/homeostat/plants/*/case.toml; do
  folder=$(dirname "$settings")
  if ! cmp --silent "$fresh/$(basename "$folder").ttl" "$folder/plant.ttl"; then
    echo "check_graph: $folder/plant.ttl is not what its tables make; run 'make graph' and commit the result." >&2
    exit 1
  fi
done
