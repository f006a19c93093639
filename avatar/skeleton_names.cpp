#include "avatar/skeleton_names.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <string_view>

namespace avatar {
namespace {

using Names = std::vector<std::string>;

/// Names in lower case without separators, alternatives divided by '|'; '@' stands for left/right
/// or l/r. Limbs in the order of LimbJoint.
struct Convention {
  const char* name;
  const char* hips;
  std::array<const char*, kNumLimbJoints> limbs;
};

// CMU's ASF "wrist" is the turning half of the forearm; the wrist itself is where lhand starts.
constexpr std::array<Convention, 6> kConventions = {
    {{"CMU",
      "hips|root",
      {"@femur", "@tibia", "@foot", "@toes", "@clavicle", "@humerus", "@radius", "@hand|@wrist"}},
     {"Mixamo, MotionBuilder",
      "hips|hip|pelvis",
      {"@upleg|@upperleg",
       "@leg|@lowleg|@lowerleg",
       "@foot",
       "@toebase|@toe",
       "@shoulder|@collar",
       "@arm|@uparm|@upperarm",
       "@forearm|@lowarm|@lowerarm",
       "@hand"}},
     {"cgspeed",
      "hips|hip",
      {"@hip",
       "@knee",
       "@ankle",
       "@toe|@toes|@toebase",
       "@collar|@clavicle",
       "@shoulder",
       "@elbow",
       "@wrist"}},
     {"Poser, DAZ",
      "hip|hips|pelvis",
      {"@thigh|@thighbend",
       "@shin",
       "@foot",
       "@toe|@toes",
       "@collar",
       "@shldr|@shldrbend",
       "@forearm|@forearmbend",
       "@hand"}},
     {"Biped, Unreal",
      "pelvis|hips|bip01|bip001",
      {"@thigh|thigh@",
       "@calf|calf@",
       "@foot|foot@",
       "@toe0|@toe|ball@",
       "@clavicle|clavicle@",
       "@upperarm|upperarm@",
       "@forearm|lowerarm@",
       "@hand|hand@"}},
     {"SMPL",
      "pelvis|hips",
      {"@hip", "@knee", "@ankle", "@foot", "@collar", "@shoulder", "@elbow", "@wrist"}}}};

/// The alternatives of a table entry.
Names alternatives(std::string_view entry) {
  Names names;
  std::size_t start = 0;
  while (start <= entry.size()) {
    const std::size_t end = std::min(entry.find('|', start), entry.size());
    names.emplace_back(entry.substr(start, end - start));
    start = end + 1;
  }
  return names;
}

/// Lower case, without name space ("mixamorig:", "bip01 ") and separators.
std::string normalised(const std::string& name) {
  const std::size_t colon = name.find_last_of(":|");
  std::string result;
  for (const char c : name.substr(colon == std::string::npos ? 0 : colon + 1)) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  for (const std::string_view prefix : {"mixamorig", "bip001", "bip01", "bip1", "bip"}) {
    if (result.starts_with(prefix)) {
      return result.substr(prefix.size());
    }
  }
  return result;
}

int findName(const Names& names, const std::string& wanted) {
  const auto found = std::find(names.begin(), names.end(), wanted);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

int findAny(const Names& names, const Names& wanted) {
  for (const std::string& name : wanted) {
    const int joint = findName(names, name);
    if (joint >= 0) {
      return joint;
    }
  }
  return -1;
}

int findSided(const Names& names, std::string_view entry, int side) {
  Names wanted;
  for (const std::string& pattern : alternatives(entry)) {
    const std::size_t at = pattern.find('@');
    for (const char* word : {side == 0 ? "left" : "right", side == 0 ? "l" : "r"}) {
      std::string name = pattern;
      wanted.push_back(name.replace(at, 1, word));
    }
  }
  return findAny(names, wanted);
}

/// From the joint up to the root, both included.
std::vector<int> ancestors(const std::vector<RecordedJoint>& joints, int joint) {
  std::vector<int> path;
  for (int j = joint; j >= 0; j = joints[j].parent) {
    path.push_back(j);
  }
  return path;
}

int commonAncestor(const std::vector<RecordedJoint>& joints, int a, int b) {
  const std::vector<int> other = ancestors(joints, b);
  for (const int joint : ancestors(joints, a)) {
    if (std::find(other.begin(), other.end(), joint) != other.end()) {
      return joint;
    }
  }
  return -1;
}

/// Joints strictly below `top` down to and including `bottom`; empty unless bottom descends from
/// top.
std::vector<int> chain(const std::vector<RecordedJoint>& joints, int top, int bottom) {
  std::vector<int> path = ancestors(joints, bottom);
  const auto end = std::find(path.begin(), path.end(), top);
  if (end == path.end()) {
    return {};
  }
  path.erase(end, path.end());
  std::reverse(path.begin(), path.end());
  return path;
}

constexpr std::array<const char*, kNumLimbJoints> kPartNames = {
    "thigh", "shin", "foot", "toe", "clavicle", "upper arm", "forearm", "hand"};

bool isRequired(int part) {
  return part != kToe && part != kClavicle;
}

std::string sidedName(int side, int part) {
  return (side == 0 ? "left " : "right ") + std::string(kPartNames.at(part));
}

SkeletonMatch matchNames(const Names& names, const Convention& convention) {
  SkeletonMatch match;
  match.convention = convention.name;
  match.hips = findAny(names, alternatives(convention.hips));
  match.head = findName(names, "head");
  if (match.hips < 0) {
    match.missing.emplace_back("hips");
  }
  for (int i = 0; i < 2 * kNumLimbJoints; ++i) {
    const int side = i / kNumLimbJoints;
    const int part = i % kNumLimbJoints;
    const int joint = findSided(names, convention.limbs.at(part), side);
    match.limbs.at(side).at(part) = joint;
    if (joint < 0 && isRequired(part)) {
      match.missing.push_back(sidedName(side, part));
    }
  }
  return match;
}

int countFound(const SkeletonMatch& match) {
  int count = (match.hips >= 0 ? 1 : 0) + (match.head >= 0 ? 1 : 0);
  for (const auto& side : match.limbs) {
    count +=
        static_cast<int>(std::count_if(side.begin(), side.end(), [](int j) { return j >= 0; }));
  }
  return count;
}

void requireChain(
    SkeletonMatch& match,
    const std::vector<RecordedJoint>& joints,
    int side,
    std::initializer_list<LimbJoint> parts) {
  int top = match.hips;
  for (const LimbJoint part : parts) {
    const int joint = match.limbs.at(side).at(part);
    if (joint >= 0 && chain(joints, top, joint).empty()) {
      match.missing.push_back(sidedName(side, part) + " below its parent");
    }
    top = joint >= 0 ? joint : top;
  }
}

void findTorso(SkeletonMatch& match, const std::vector<RecordedJoint>& joints) {
  const int chest =
      commonAncestor(joints, match.limbs.at(0).at(kUpperArm), match.limbs.at(1).at(kUpperArm));
  match.spine = chain(joints, match.hips, chest);
  if (match.head >= 0) {
    match.neck = chain(joints, chest, match.head);
    if (match.neck.empty()) {
      match.head = -1;
    } else {
      match.neck.pop_back();
    }
  }
}

}  // namespace

SkeletonMatch matchSkeleton(const std::vector<RecordedJoint>& joints) {
  Names names;
  names.reserve(joints.size());
  for (const RecordedJoint& joint : joints) {
    names.push_back(joint.name.empty() ? "#end" : normalised(joint.name));
  }
  SkeletonMatch best;
  int bestCount = -1;
  for (const Convention& convention : kConventions) {
    SkeletonMatch match = matchNames(names, convention);
    // A convention that lacks a required part loses against any that has them all.
    const int count = countFound(match) - 100 * static_cast<int>(match.missing.size());
    if (bestCount == -1 || count > bestCount) {
      best = std::move(match);
      bestCount = count;
    }
  }
  if (best.isComplete()) {
    for (int side = 0; side < 2; ++side) {
      requireChain(best, joints, side, {kThigh, kShin, kAnkle, kToe});
      requireChain(best, joints, side, {kClavicle, kUpperArm, kForearm, kWrist});
    }
  }
  if (best.isComplete()) {
    findTorso(best, joints);
  }
  return best;
}

}  // namespace avatar
