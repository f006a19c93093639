#!/bin/bash
# validate.sh PROGRAM: lets PROGRAM write its files into a new folder and validates each of them.
# Exit code 77 (skipped) where the validator isn't installed.
set -euo pipefail
clients=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
if ! command -v node > /dev/null; then
  echo "SKIPPED: node is missing; install nodejs and npm, then run scripts/install-clients"
  exit 77
fi
if [[ ! -d $clients/node_modules/gltf-validator ]]; then
  echo "SKIPPED: the glTF validator is missing; run scripts/install-clients"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
"$1" "$folder"
node "$clients/validate.mjs" "$folder"/*.glb
