#pragma once

#include "src/digitization/human_parser.h"
#include "src/digitization/turn.h"

#include <string>

namespace simulcap {

/// FOLDER/%06d.png: the label picture of a frame, by its number within the recording.
std::string labelPicturePath(const std::string& folder, int number);

/// Gives the frames of a turn the labels of FOLDER/%06d.png, by their numbers within the recording
/// and as large as its pictures; a frame without such a file keeps what it has. One picture is
/// enough. Throws avatar::FileError when there is none for any frame, or one can't be used.
void readTurnLabels(Turn& turn, const std::string& folder);

/// What a network saw in the frames that it was shown.
struct NetworkLabels {
  int frames = 0;         ///< that have labels of it now
  bool onePiece = false;  ///< a dress or an overall with hardly anything of a lower garment
};

/// Gives up to `most` (≥ 1) evenly spread frames of a turn the labels that a network sees; frames
/// that have labels keep them. Throws std::runtime_error when it sees nobody where depth shows the
/// person, or there are no colours to show it.
NetworkLabels parseTurn(Turn& turn, HumanParser& parser, int most);

}  // namespace simulcap
