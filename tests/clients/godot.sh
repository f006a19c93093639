#!/bin/bash
# godot.sh SAMPLES SIMULCAP: an avatar of SAMPLES, exported by SIMULCAP as a Godot 3 project, opened and
# simulated there. Exit code 77 (skipped) where Godot isn't installed.
set -euo pipefail
clients=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
for program in godot3 godot3-server xvfb-run; do
  if ! command -v $program > /dev/null; then
    echo "SKIPPED: $program is missing; scripts/install-packages scripts/packages-clients"
    exit 77
  fi
done
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
export HOME=$folder XDG_DATA_HOME=$folder/.local XDG_CACHE_HOME=$folder/.cache
"$1" "$folder"
"$2" export "$folder/avatar.glb" --to godot -o "$folder/project"
cp "$clients/godot_check.gd" "$folder/project"
# The editor imports the avatar, but doesn't end by itself.
godot3-server --path "$folder/project" -e -q > "$folder/import.log" 2>&1 &
editor=$!
for _ in $(seq 300); do
  ls "$folder"/project/.import/*.md5 > /dev/null 2>&1 && break
  kill -0 $editor 2> /dev/null || break
  sleep 0.1
done
sleep 1
kill $editor 2> /dev/null || true
wait $editor 2> /dev/null || true
# The server alone doesn't tell where cloth is: it draws nothing.
timeout 120 xvfb-run -a -s "-screen 0 320x240x24" godot3 --audio-driver Dummy --fixed-fps 60 \
  --path "$folder/project" --script godot_check.gd > "$folder/run.log" 2>&1 || true
grep -E 'SCRIPT ERROR|CLOTH|FAILED' "$folder/run.log" || tail -20 "$folder/run.log"
grep -q '^PASSED' "$folder/run.log" && ! grep -q 'SCRIPT ERROR' "$folder/run.log"
