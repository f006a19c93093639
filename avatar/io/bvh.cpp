#include "avatar/io/bvh.h"

#include "avatar/io/file_error.h"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string_view>

namespace avatar {
namespace {

enum class Channel { kXPosition, kYPosition, kZPosition, kXRotation, kYRotation, kZRotation };

struct Token {
  std::string_view text;
  int line = 0;
};

/// Words of the file with their line numbers.
class Tokens {
 public:
  Tokens(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  Token next() {
    skipSpace();
    const std::size_t start = at_;
    while (at_ < text_.size() && !isSpace(text_[at_])) {
      ++at_;
      const bool isBrace = text_[start] == '{' || text_[start] == '}';
      if (isBrace || (at_ < text_.size() && (text_[at_] == '{' || text_[at_] == '}'))) {
        break;
      }
    }
    return {text_.substr(start, at_ - start), line_};
  }

  /// The rest of the current line, or the next line with something on it.
  Token nextLine() {
    skipSpace();
    const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
    const Token result{text_.substr(at_, end - at_), line_};
    at_ = end;
    return result;
  }

  Token expect(std::string_view keyword) {
    const Token token = next();
    if (!sameWord(token.text, keyword)) {
      fail(token, "expected " + std::string(keyword) + ", found " + quoted(token));
    }
    return token;
  }

  double number(const char* what) {
    const Token token = next();
    return parseNumber(token, what);
  }

  double parseNumber(const Token& token, const char* what) const {
    std::string_view digits = token.text;
    if (!digits.empty() && digits.front() == '+') {
      digits.remove_prefix(1);
    }
    double value = 0.0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const bool isWhole = error == std::errc() && end == digits.data() + digits.size();
    if (!isWhole || !std::isfinite(value)) {
      fail(token, std::string(what) + " must be a finite number, found " + quoted(token));
    }
    return value;
  }

  [[noreturn]] void fail(const Token& token, const std::string& problem) const {
    throw FileError(file_, "line " + std::to_string(token.line), problem);
  }

  static std::string quoted(const Token& token) {
    constexpr std::size_t kLongest = 40;
    if (token.text.empty()) {
      return "the end of the file";
    }
    std::string result = "'";
    result.append(token.text.substr(0, kLongest));
    result.push_back('\'');
    return result;
  }

  static bool sameWord(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
      return std::tolower(static_cast<unsigned char>(x)) ==
             std::tolower(static_cast<unsigned char>(y));
    });
  }

 private:
  static bool isSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

  void skipSpace() {
    while (at_ < text_.size() && isSpace(text_[at_])) {
      line_ += text_[at_] == '\n' ? 1 : 0;
      ++at_;
    }
  }

  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
  int line_ = 1;
};

struct ChannelOfJoint {
  int joint = 0;
  Channel channel = Channel::kXPosition;
};

struct Hierarchy {
  std::vector<RecordedJoint> joints;
  std::vector<ChannelOfJoint> channels;  ///< in the order of the numbers on a frame line
};

Channel parseChannel(const Tokens& tokens, const Token& token) {
  constexpr std::array<std::string_view, 6> kNames = {
      "Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (Tokens::sameWord(token.text, kNames.at(i))) {
      return static_cast<Channel>(i);
    }
  }
  tokens.fail(
      token, "expected a channel such as Xposition or Zrotation, found " + Tokens::quoted(token));
}

void parseChannels(Tokens& tokens, Hierarchy& hierarchy) {
  const Token countToken = tokens.next();
  const double count = tokens.parseNumber(countToken, "the channel count");
  if (!(count >= 0.0 && count <= 6.0) || count != std::floor(count)) {
    tokens.fail(countToken, "the channel count must be 0 … 6, found " + Tokens::quoted(countToken));
  }
  const int joint = static_cast<int>(hierarchy.joints.size()) - 1;
  for (int i = 0; i < static_cast<int>(count); ++i) {
    hierarchy.channels.push_back({joint, parseChannel(tokens, tokens.next())});
  }
}

Eigen::Vector3d parseOffset(Tokens& tokens) {
  Eigen::Vector3d offset;
  for (int axis = 0; axis < 3; ++axis) {
    offset[axis] = tokens.number("OFFSET");
  }
  return offset;
}

/// Name, which may hold spaces ("Bip01 L Thigh"), up to the end of the line or the brace.
std::string parseName(Tokens& tokens) {
  std::string name;
  Token token = tokens.next();
  const int line = token.line;
  while (token.text != "{") {
    if (token.text.empty() || token.text == "}" || (token.line != line && !name.empty())) {
      tokens.fail(token, "expected {, found " + Tokens::quoted(token));
    }
    if (!name.empty()) {
      name.push_back(' ');
    }
    name.append(token.text);
    token = tokens.next();
  }
  return name;
}

void addJoint(Tokens& tokens, Hierarchy& hierarchy, int parent, const Token& keyword) {
  constexpr std::size_t kMostJoints = 4096;
  if (hierarchy.joints.size() >= kMostJoints) {
    tokens.fail(keyword, "more than 4096 joints");
  }
  std::string name = parseName(tokens);
  if (Tokens::sameWord(keyword.text, "End")) {
    name.clear();
  } else if (name.empty()) {
    tokens.fail(keyword, "the joint has no name");
  }
  hierarchy.joints.push_back({name, parent, Eigen::Vector3d::Zero()});
}

/// One statement inside the innermost open joint; `open` holds the joints whose braces are open.
void parseStatement(Tokens& tokens, Hierarchy& hierarchy, std::vector<int>& open) {
  const Token token = tokens.next();
  const int last = static_cast<int>(hierarchy.joints.size()) - 1;
  if (token.text == "}") {
    open.pop_back();
    return;
  }
  if (Tokens::sameWord(token.text, "OFFSET")) {
    hierarchy.joints[open.back()].offset = parseOffset(tokens);
    return;
  }
  if (Tokens::sameWord(token.text, "CHANNELS") && open.back() == last) {
    parseChannels(tokens, hierarchy);
    return;
  }
  if (Tokens::sameWord(token.text, "JOINT") || Tokens::sameWord(token.text, "End")) {
    addJoint(tokens, hierarchy, open.back(), token);
    open.push_back(last + 1);
    return;
  }
  tokens.fail(
      token,
      "expected OFFSET, CHANNELS (before the joint's children), JOINT, End Site or }, found " +
          Tokens::quoted(token));
}

Hierarchy parseHierarchy(Tokens& tokens) {
  Hierarchy hierarchy;
  tokens.expect("HIERARCHY");
  const Token root = tokens.expect("ROOT");
  addJoint(tokens, hierarchy, -1, root);
  std::vector<int> open = {0};
  while (!open.empty()) {
    parseStatement(tokens, hierarchy, open);
  }
  return hierarchy;
}

struct FrameHeader {
  int count = 0;
  double framesPerSecond = 30.0;
};

FrameHeader parseFrameHeader(Tokens& tokens) {
  tokens.expect("MOTION");
  tokens.expect("Frames:");
  const Token countToken = tokens.next();
  const double count = tokens.parseNumber(countToken, "Frames");
  constexpr double kMostFrames = 1e7;
  if (!(count >= 1.0 && count <= kMostFrames) || count != std::floor(count)) {
    tokens.fail(
        countToken, "Frames must be a whole number from 1, found " + Tokens::quoted(countToken));
  }
  tokens.expect("Frame");
  tokens.expect("Time:");
  const Token timeToken = tokens.next();
  const double seconds = tokens.parseNumber(timeToken, "Frame Time");
  if (!(seconds >= 1e-4 && seconds <= 10.0)) {
    tokens.fail(
        timeToken, "Frame Time must be within 0.0001 … 10 s, found " + Tokens::quoted(timeToken));
  }
  return {static_cast<int>(count), 1.0 / seconds};
}

void applyChannel(RecordedFrame& frame, const ChannelOfJoint& target, double value) {
  const int kind = static_cast<int>(target.channel);
  const int axis = kind % 3;
  if (kind < 3) {
    frame.positions(axis, target.joint) = value;
    return;
  }
  // Channels apply in file order, each in the frame the former left: Zrotation Yrotation Xrotation
  // is R = Rz·Ry·Rx. Degrees in the file.
  const double angle = value * std::numbers::pi / 180.0;
  Eigen::Quaterniond& rotation = frame.rotations[target.joint];
  rotation = rotation * Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)));
}

RecordedFrame restFrame(const std::vector<RecordedJoint>& joints) {
  RecordedFrame frame;
  frame.rotations.assign(joints.size(), Eigen::Quaterniond::Identity());
  frame.positions.resize(3, static_cast<Eigen::Index>(joints.size()));
  for (std::size_t j = 0; j < joints.size(); ++j) {
    frame.positions.col(static_cast<Eigen::Index>(j)) = joints[j].offset;
  }
  return frame;
}

RecordedFrame parseFrame(const Tokens& tokens, const Token& line, const Hierarchy& hierarchy) {
  RecordedFrame frame = restFrame(hierarchy.joints);
  Tokens words(line.text, "");
  std::size_t count = 0;
  for (Token word = words.next(); !word.text.empty(); word = words.next()) {
    const double value = tokens.parseNumber({word.text, line.line}, "a channel value");
    if (count < hierarchy.channels.size()) {
      applyChannel(frame, hierarchy.channels[count], value);
    }
    ++count;
  }
  if (count != hierarchy.channels.size()) {
    tokens.fail(
        line,
        "a frame needs " + std::to_string(hierarchy.channels.size()) + " values, found " +
            std::to_string(count));
  }
  return frame;
}

}  // namespace

RecordedMotion parseBvh(const std::string& text, const std::string& nameForErrors) {
  Tokens tokens(text, nameForErrors);
  Hierarchy hierarchy = parseHierarchy(tokens);
  const FrameHeader header = parseFrameHeader(tokens);
  RecordedMotion motion;
  motion.name = nameForErrors;
  motion.framesPerSecond = header.framesPerSecond;
  for (int i = 0; i < header.count; ++i) {
    const Token line = tokens.nextLine();
    if (line.text.empty()) {
      tokens.fail(
          line,
          "the file ends after " + std::to_string(i) + " of " + std::to_string(header.count) +
              " frames; correct Frames or copy the file again");
    }
    motion.frames.push_back(parseFrame(tokens, line, hierarchy));
  }
  const Token rest = tokens.nextLine();
  if (!rest.text.empty()) {
    tokens.fail(rest, "more lines than the " + std::to_string(header.count) + " declared frames");
  }
  motion.joints = std::move(hierarchy.joints);
  return motion;
}

RecordedMotion readBvh(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw FileError(path, "", "cannot be opened; check the path and the permissions");
  }
  std::ostringstream text;
  text << file.rdbuf();
  return parseBvh(text.str(), path);
}

}  // namespace avatar
