#!/bin/bash
# workflow.sh SAMPLES SIMULCAP: an avatar of SAMPLES on its own body by the workflow, a job each time that
# its result is missing and none otherwise. Exit code 77 (skipped) without Snakemake.
set -euo pipefail
repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
if ! command -v snakemake > /dev/null; then
  echo "SKIPPED: snakemake is missing; scripts/install-packages scripts/packages-clients"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
export HOME=$folder
mkdir "$folder/wardrobe"
"$1" "$folder"
mv "$folder/avatar.glb" "$folder/wardrobe"
batch() {
  snakemake --profile "$repository/workflow/profiles/local" --snakefile "$repository/workflow/Snakefile" \
    --directory "$folder" --cores 1 --config "bodies=$folder/wardrobe" "wardrobe=$folder/wardrobe" \
    "output=$folder/out" "simulcap=$2" "options=--seconds 0.1" > "$folder/log" 2>&1 ||
    { cat "$folder/log"; exit 1; }
  echo "$1 run: $(grep -c '^rule retarget' "$folder/log" || true) jobs"
  [[ $(grep -c '^rule retarget' "$folder/log" || true) == "$3" ]]
}
batch first "$2" 1
grep avatar "$folder/out/retargeted.csv"
batch second "$2" 0
rm "$folder/out/avatar/avatar/own/metrics.json" "$folder/out/retargeted.csv"  # as if interrupted
batch third "$2" 1
