#include "bullet_ext/core/contact_kernels.inl"

namespace bullet_ext {

const ContactKernels& wideContactKernels() {
  return kKernels;
}

}  // namespace bullet_ext
