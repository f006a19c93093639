#pragma once

#include "avatar/digitization/posed_frame.h"

#include <array>
#include <string>
#include <vector>

namespace simulcap {

/// What a class of a human-parsing network is to us. kOnePieceClass: a dress or an overall, in
/// label images kUpperLabel.
enum ParsingClass : std::uint8_t {
  kNoClass = avatar::kNoLabel,
  kSkinClass = avatar::kSkinLabel,
  kUpperClass = avatar::kUpperLabel,
  kLowerClass = avatar::kLowerLabel,
  kOnePieceClass = 4
};

/// How a human-parsing network wants its pictures and what its channels tell. The defaults are
/// those of LIP_JPPNet (Gong et al. 2018): 384 × 384, BGR from 0 to 255 less ImageNet's mean, the
/// 20 classes of the data set LIP.
struct ParsingDescription {
  int width = 384, height = 384;  ///< of the input [px], 8 to 4096
  std::array<double, 3> mean = {104.00698793, 116.66876762, 122.67891434};  ///< input order, 0…255
  std::array<double, 3> scale = {1.0, 1.0, 1.0};  ///< of what is left then, per channel
  bool rgb = false;         ///< the input's channels are R, G, B, else B, G, R
  bool keepAspect = false;  ///< the person is centred and padded with the mean, not stretched
  std::vector<ParsingClass> classes;  ///< per output channel
};

/// Of the network in a file: as MODEL.json beside it says (MODEL with its extension replaced),
/// LIP's where that is missing or says nothing. Throws avatar::FileError.
ParsingDescription parsingDescription(const std::string& model);

}  // namespace simulcap
