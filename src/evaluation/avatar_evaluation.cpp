#include "src/evaluation/avatar_evaluation.h"

#include "avatar/avatar_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "src/evaluation/posed_avatar.h"
#include "src/evaluation/truth_comparison.h"

#include <nlohmann/json.hpp>

#include <memory>

namespace simulcap {

nlohmann::json avatarFigures(
    const avatar::LayeredAvatar& avatar,
    const EvaluationOptions& options,
    const AvatarSighting& sighting) {
  GroundTruth truth(
      options.truthFolder,
      isTrueBodyModel(options.truthFolder, options.bodyModel) ? options.bodyModel : "");
  const PosedAvatarBody body(
      avatar.body, std::make_shared<avatar::BodyModel>(avatar::loadBody(options.bodyModel)));
  CapturedLayers layers{avatar.body.mesh.faces, {}};
  CapturedFrame frame;
  frame.number = sighting.number;
  frame.body = sighting.cameraFromWorld * body.vertices(sighting.pose);
  frame.joints = sighting.cameraFromWorld * body.joints(sighting.pose);
  for (const avatar::Garment& garment : avatar.garments) {
    layers.garments.push_back({garment.name, garment.mesh.faces});
    frame.garments.push_back(
        sighting.cameraFromWorld * avatar::posedVertices(garment, avatar.body, sighting.pose));
  }
  frame.skinned = frame.garments;
  const CommonBody common{
      .joints = truth.bodyModel() != nullptr && definesJointsOf(*truth.bodyModel(), avatar.body),
      .vertices = truth.bodyFaces().cols() > 0 && truth.bodyFaces() == layers.bodyFaces};
  TruthComparison comparison(truth, std::move(layers), common, options.threads);
  comparison.add(frame);
  return comparison.figures();
}

}  // namespace simulcap
