#!/bin/bash
# The layer check must catch what it is there for: each forbidden include below, alone in a small
# tree, has to make it fail, and the allowed ones must pass.
set -euo pipefail
check=$1
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT

# verdict FILE INCLUDE: prints what the check says of it
verdict() {
  rm -rf "${tree:?}"/*
  mkdir -p "$tree/$(dirname "$1")"
  echo "#include $2" > "$tree/$1"
  "$check" "$tree" || true
}

failures=0
forbidden() {
  if [[ $(verdict "$1" "$2") != *"1 includes read, 1 forbidden" ]]; then
    echo "not caught: $1 includes $2"
    failures=$((failures + 1))
  fi
}
allowed() {
  if [[ $(verdict "$1" "$2") != "1 includes read, 0 forbidden" ]]; then
    echo "wrongly forbidden: $1 includes $2"
    failures=$((failures + 1))
  fi
}

forbidden bullet_ext/core/a.cpp '<btBulletDynamicsCommon.h>'
forbidden bullet_ext/core/a.cpp '"bullet_ext/cloth_body.h"'
forbidden bullet_ext/a.cpp '"avatar/body_model.h"'
forbidden bullet_ext/a.cpp '"src/output/image_file.h"'
forbidden bullet_ext/a.cpp '<opencv2/core.hpp>'
forbidden avatar/geometry/a.h '"avatar/body_model.h"'
forbidden avatar/geometry/a.h '<OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>'
forbidden avatar/a.cpp '"avatar/io/npz.h"'
forbidden avatar/a.cpp '"bullet_ext/core/cloth_mesh.h"'
forbidden avatar/a.cpp '<zip.h>'
forbidden avatar/a.cpp '<nlohmann/json.hpp>'
forbidden avatar/io/a.cpp '"src/output/image_file.h"'
forbidden avatar/new_folder/a.cpp '<opencv2/core.hpp>'
forbidden src/reference/a.cpp '"bullet_ext/core/spring_force.h"'
forbidden src/output/a.h '<opencv2/core.hpp>'
forbidden src/output/a.cpp '"image_file.h"'

allowed bullet_ext/core/a.cpp '<Eigen/Core>'
allowed bullet_ext/core/a.cpp '<immintrin.h>'
allowed bullet_ext/a.cpp '<BulletSoftBody/btSoftBody.h>'
allowed avatar/geometry/a.cpp '<OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>'
allowed avatar/a.cpp '"avatar/geometry/mesh.h"'
allowed avatar/io/a.cpp '"avatar/body_model.h"'
allowed src/output/a.cpp '<opencv2/imgcodecs.hpp>'
allowed src/capture_session.cpp '"bullet_ext/capture_world.h"'

((failures == 0)) && echo "the layer check catches every forbidden include"
