#!/bin/bash
# report.sh PROGRAM [FOLDER]: captures a few synthetic frames and uses their report in a real
# browser. Screenshots go to FOLDER. Exit code 77 (skipped) without a browser, its driver, or the
# page in PROGRAM.
set -euo pipefail
clients=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
program=$1 shots=${2:-}
skip() {
  echo "SKIPPED: $1"
  exit 77
}
command -v node > /dev/null || skip "node is missing; install nodejs and npm, then run scripts/install-clients"
[[ -d $clients/node_modules/playwright-core ]] || skip "playwright-core is missing; run scripts/install-clients"
[[ -n ${CHROMIUM:-} ]] || command -v chromium-headless-shell chromium google-chrome > /dev/null ||
  skip "no browser; on Debian: apt-get install --no-install-recommends chromium-headless-shell"
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cd "$folder"

cat > scene.json << 'END'
{"time": {"frames": 4},
 "body": {"motion": "walk_in_place"},
 "garments": [{"name": "lower", "wear": {"cut": "trousers", "edge_length": 0.05}},
              {"name": "upper", "wear": {"cut": "tshirt", "edge_length": 0.05}, "cloth": {"material": "soft"}}],
 "camera": {"position": [0, 1.1, 2.4], "look_at": [0, 0.93, 0], "width": 160, "height": 120, "fx": 131.25},
 "sensor": {"model": "kinect_v1"},
 "truth": {"settle_seconds": 0.2}}
END
"$program" synth scene.json -o seq --quiet
"$program" capture seq --avatar seq/avatar.glb -o captured --quiet > metrics.txt
if [[ ! -f captured/report.html ]]; then
  ! "$program" report captured --quiet 2>&1 | grep "without the page" || skip "the program was built without the page"
  echo "FAILED: capture left no report.html"
  exit 1
fi
ls -l captured/report.html
node "$clients/report.mjs" captured/report.html $shots
