#!/bin/bash
# usd.sh PROGRAM: an avatar and its short simulation, exported as USD, are in three.js where our OBJ has
# them. Exit code 77 (skipped) where three.js isn't installed.
set -euo pipefail
clients=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
program=$1
if ! command -v node > /dev/null || [[ ! -d $clients/node_modules/three ]]; then
  echo "SKIPPED: three.js is missing; install nodejs and npm, then run scripts/install-clients"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cat > "$folder/scene.json" << 'END'
{"time": {"frames": 3, "frames_per_second": 10},
 "body": {"motion": "jumping_jack"},
 "garments": [{"name": "skirt", "wear": {"cut": "skirt", "edge_length": 0.05}}]}
END
"$program" simulate "$folder/scene.json" -o "$folder/run" --quiet > /dev/null
export_as() { "$program" export "$folder/$1" --to "$2" -o "$folder/$3" --quiet > /dev/null; }
export_as run/avatar.glb usd avatar.usda
export_as run/avatar.glb obj avatar.obj
export_as run usd run.usda
export_as run obj run.obj
node "$clients/usd.mjs" "$folder/avatar.usda" "$folder/avatar.obj"
node "$clients/usd.mjs" "$folder/run.usda" "$folder/run_frames/000000.obj" 0
node "$clients/usd.mjs" "$folder/run.usda" "$folder/run_frames/000002.obj" 0.2
