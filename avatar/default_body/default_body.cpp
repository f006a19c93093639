#include "avatar/default_body/default_body.h"

#include "avatar/default_body/anatomy.h"
#include "avatar/default_body/joint_regressor.h"
#include "avatar/default_body/pose_correctives.h"
#include "avatar/default_body/shape_space.h"
#include "avatar/default_body/skinning_weights.h"
#include "avatar/default_body/template_mesh.h"

namespace avatar {

BodyModel makeDefaultBody() {
  const BodyField field = makeAnatomy();
  const SymmetricMesh body = makeTemplateMesh(field);
  const SparseRowMatrix weights = makeSkinningWeights(body, field);
  const ShapeSpace shapes(body, weights, field.joints());

  BodyModel model;
  model.name = "default";
  model.templateVertices = body.mesh.vertices;
  model.faces = body.mesh.faces;
  model.shapeDirections = shapes.directions();
  model.poseDirections = makePoseCorrectives(body, weights, field);
  model.jointRegressor = makeJointRegressor(body, shapes, field.joints());
  model.skinningWeights = weights;
  model.parents.assign(kSmplParents.begin(), kSmplParents.end());
  return model;
}

}  // namespace avatar
