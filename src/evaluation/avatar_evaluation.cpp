#include "src/evaluation/avatar_evaluation.h"

#include "avatar/avatar_pose.h"
#include "src/evaluation/posed_avatar.h"
#include "src/evaluation/truth_comparison.h"

namespace simulcap {

AvatarEvaluation evaluatedAvatar(
    const avatar::LayeredAvatar& avatar,
    const EvaluationOptions& options,
    const AvatarSighting& sighting) {
  const TrueBodyModel model =
      trueBodyModel(options.truthFolder, options.bodyModel, avatar.body.model);
  GroundTruth truth(options.truthFolder, model.name);
  const PosedAvatarBody body(avatar.body, options.captureModel);
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
  AvatarEvaluation result{comparison.figures(), comparison.notes()};
  if (!model.problem.empty())
    result.notes.push_back(model.problem);
  return result;
}

}  // namespace simulcap
