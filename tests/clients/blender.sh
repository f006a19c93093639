#!/bin/bash
# blender.sh SAMPLES SIMULCAP: an avatar of SAMPLES, exported by SIMULCAP, imported and simulated by
# Blender. Exit code 77 (skipped) where Blender isn't installed.
set -euo pipefail
clients=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
if ! command -v blender > /dev/null; then
  echo "SKIPPED: blender is missing; scripts/install-packages scripts/packages-clients"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
export HOME=$folder
"$1" "$folder"
"$2" export "$folder/avatar.glb" --to glb -o "$folder/exported.glb"
"$2" export "$folder/stiffness.glb" --to glb -o "$folder/stiffness_exported.glb" > /dev/null
"$2" simulate "$folder/stiffness.json" -o "$folder/ours" --quiet > "$folder/simulate.log"
blender --background --factory-startup --python-exit-code 1 --python "$clients/blender_check.py" \
  -- "$folder/exported.glb" "$folder/stiffness_exported.glb" "$folder/ours/performance.npz" \
  > "$folder/run.log" 2>&1 || true
grep -E 'CLOTH|Error' "$folder/run.log" || tail -20 "$folder/run.log"
grep -q '^PASSED' "$folder/run.log"
