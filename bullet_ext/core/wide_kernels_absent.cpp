#include "bullet_ext/core/contact_kernels.h"
#include "bullet_ext/core/wide_kernels.h"

#include <stdexcept>

// For processors that the wide kernels aren't written for; wideKernelsSupported() is false there.
#if !BULLET_EXT_WIDE_KERNELS
namespace bullet_ext {

void computeWideForces(const WideDomain& /*domain*/, const float* /*positions*/, bool /*limit*/) {
  throw std::logic_error("computeWideForces: not for this processor");
}

double wideElasticEnergy(const WideDomain& /*domain*/, const float* /*positions*/, bool /*limit*/) {
  throw std::logic_error("wideElasticEnergy: not for this processor");
}

void integrateWide(const WideDomain& /*domain*/, const WideSubstep& /*substep*/) {
  throw std::logic_error("integrateWide: not for this processor");
}

const ContactKernels& wideContactKernels() {
  return portableContactKernels();
}

}  // namespace bullet_ext
#endif
