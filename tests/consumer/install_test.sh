#!/bin/bash
# install_test.sh SOURCE BUILD: installs BUILD into a folder of its own, builds the consumer project
# with what is there and runs it; and configures it with our sources as a part of it.
set -euo pipefail
source=$1
build=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

cmake --install "$build" --prefix "$folder/installed" > /dev/null
"$folder/installed/bin/simulcap" --version
grep -q "simulcap capture" "$folder/installed/share/man/man1/simulcap.1"
bash -n "$folder/installed/share/bash-completion/completions/simulcap"

cmake -G Ninja -S "$source/tests/consumer" -B "$folder/build" -D CMAKE_BUILD_TYPE=Release \
  -D CMAKE_PREFIX_PATH="$folder/installed" > /dev/null
cmake --build "$folder/build" > /dev/null
"$folder/build/game"
"$folder/build/dress_default_body"

cmake -G Ninja -S "$source/tests/consumer" -B "$folder/part" -D SIMULCAP_SOURCE="$source" > /dev/null
ninja -C "$folder/part" -t query game > /dev/null
