#pragma once

#include "avatar/garment.h"

#include <map>
#include <string>

namespace simulcap {

/// Suggested values for engines whose stiffness has units of its own: engine → parameter → value.
/// They follow from the garment's parameters and how each engine uses its numbers, stated at each
/// one's formula; Godot's iterations are those with which a garment hangs about as in our
/// simulation.
using EngineHints = std::map<std::string, std::map<std::string, double>>;

EngineHints engineHints(const avatar::Garment& garment);

/// The garment with suggestions where it has none of its own.
avatar::Garment withEngineHints(avatar::Garment garment);

}  // namespace simulcap
