#!/bin/bash
# bullet.sh SAMPLES SIMULCAP PLAIN: an avatar of SAMPLES, exported by SIMULCAP as .bullet, loaded and
# simulated by PLAIN, which knows Bullet and nothing of ours. Exit code 77 (skipped) without PLAIN.
set -euo pipefail
if [[ ! -x ${3:-} ]]; then
  echo "SKIPPED: built without Bullet's file loader; scripts/install-packages scripts/packages-clients," \
    "then cmake again"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
"$1" "$folder"
"$2" export "$folder/avatar.glb" --to bullet -o "$folder/avatar.bullet" > /dev/null
"$3" "$folder/avatar.bullet"
