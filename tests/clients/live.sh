#!/bin/bash
# live.sh PROGRAM [PICTURE]: replays a few synthetic frames in the live view, with an avatar and without,
# on a display that nobody sees. Exit code 77 (skipped) without Xvfb.
set -euo pipefail
program=$1 picture=${2:-}
if ! command -v xvfb-run > /dev/null; then
  echo "SKIPPED: xvfb-run is missing; apt-get install --no-install-recommends xvfb xauth libgl1-mesa-dri"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cd "$folder"

cat > scene.json << 'END'
{"time": {"frames": 30},
 "body": {"motion": "walk_in_place"},
 "garments": [{"name": "upper", "wear": {"cut": "tshirt", "edge_length": 0.05}, "cloth": {"material": "soft"}}],
 "camera": {"position": [0, 1.1, 2.4], "look_at": [0, 0.93, 0], "width": 160, "height": 120, "fx": 131.25},
 "sensor": {"model": "kinect_v1"},
 "truth": {"settle_seconds": 0.2}}
END
"$program" synth scene.json -o seq --quiet
# Slowly, so that a busy machine shows more than the first and the last frame, too.
xvfb-run -a -s "-screen 0 1000x800x24" "$program" live seq --avatar seq/avatar.glb --speed 0.1 \
  --picture live.png --quiet > figures.json
cat figures.json
[[ -z $picture ]] || cp live.png "$picture"
# Without an avatar: nobody turns in these frames, so built-in garments are worn.
xvfb-run -a -s "-screen 0 1000x800x24" "$program" live seq --body default --turn 5 --speed 0.1 \
  -o out --quiet > dressed.json
python3 - << 'END'
import json, os
figures = json.load(open('figures.json'))
assert figures['frames_captured'] + figures['frames_dropped'] == 30, 'a frame is neither captured nor dropped'
assert 2 <= figures['frames_shown'] <= figures['frames_captured'], figures
assert figures['frames_lost'] == 0, 'the body was lost'
assert figures['latency_ms']['median'] > 0, figures
dressed = json.load(open('dressed.json'))
assert dressed['frames_captured'] + dressed['frames_dropped'] == 30, 'played again from the beginning'
metrics = json.load(open('out/metrics.json'))
assert metrics['frames'] == dressed['frames_captured'] and metrics['live'] == dressed, metrics
assert metrics['digitization']['built_in_garments'], 'nobody turned'
for name in ('avatar.glb', 'performance.npz', 'performance.glb', 'camera.json', 'contact_sheet.png'):
    assert os.path.exists('out/' + name), name
# The picture shows something: bare background compresses to almost nothing.
assert len(open('live.png', 'rb').read()) > 10000, 'the picture is empty'
END
