#include "bullet_ext/core/contact_kernels.inl"

namespace bullet_ext {

const ContactKernels& portableContactKernels() {
  return kKernels;
}

}  // namespace bullet_ext
