#pragma once

#include "avatar/body_model.h"
#include "avatar/io/npz.h"

#include <string>

namespace avatar {

/// Reads a body of the SMPL family (Loper 2015; also SMPL+H, SMPL-X and others in their layout)
/// from an .npz with the keys
///
///   v_template     V × 3 [m], Y up        weights        V × J, rows sum to 1 within 1e-3
///   shapedirs      V × 3 × B [m]          kintree_table  2 × J, parents in row 0, root −1 or 2³²−1
///   posedirs       V × 3 × 9(J−1) [m]     f              F × 3
///   J_regressor    J × V, or scipy's CSC parts J_regressor_data, _indices, _indptr, _shape
///
/// posedirs may be missing (no pose blend shapes); other keys are ignored, whatever they hold.
/// Throws FileError naming file and key, with what was expected and found: a missing key, a wrong
/// shape, values that are not finite, negative weights or ones that don't sum to 1, faces out of
/// range, a kinematic tree that is none, a body not in metres.
BodyModel readBodyModel(const std::string& path);

/// The same from arrays that are in memory already. `nameForErrors` also becomes the model's name.
BodyModel bodyModelFromNpz(const NpzArrays& arrays, const std::string& nameForErrors);

NpzArrays bodyModelToNpz(const BodyModel& model);

/// Writes what readBodyModel() reads; a model read back is equal. Throws as writeNpz().
void writeBodyModel(const std::string& path, const BodyModel& model);

}  // namespace avatar
