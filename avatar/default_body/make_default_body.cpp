// Writes the built-in body to the file named on the command line; run once by the build.
#include "avatar/default_body/default_body.h"
#include "avatar/io/body_file.h"

#include <cstdio>
#include <exception>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: make_default_body FILE.npz\n", stderr);
    return 2;
  }
  try {
    avatar::writeBodyModel(argv[1], avatar::makeDefaultBody());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
