// fuzz_readers READER FOLDER [libFuzzer's options]: looks for files that a reader can't cope with,
// beginning with those in FOLDER and one that is fine.
#include "tests/fuzz/readers.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;
using simulcap::fuzz::Reader;

const Reader* chosen = nullptr;

const fs::path& ownFolder() {
  static const fs::path kFolder =
      fs::temp_directory_path() / ("simulcap_fuzz_" + std::to_string(getpid()));
  return kFolder;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  const auto& readers = simulcap::fuzz::readers();
  const std::string name = *count > 2 ? (*arguments)[1] : "";
  const auto found =
      std::find_if(readers.begin(), readers.end(), [&](const Reader& r) { return r.name == name; });
  if (found == readers.end()) {
    std::fputs("fuzz_readers READER FOLDER [OPTIONS]; readers:", stderr);
    for (const Reader& reader : readers)
      std::fprintf(stderr, " %s", reader.name);
    std::fputs("\n", stderr);
    std::exit(2);
  }
  chosen = &*found;
  fs::create_directories(ownFolder());
  std::atexit([] { fs::remove_all(ownFolder()); });
  chosen->writeSeed(ownFolder());
  fs::create_directories((*arguments)[2]);
  if (fs::is_directory((*arguments)[2]))
    fs::copy_file(
        ownFolder() / chosen->file,
        fs::path((*arguments)[2]) / "seed",
        fs::copy_options::overwrite_existing);
  std::copy(*arguments + 2, *arguments + *count, *arguments + 1);
  --*count;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  simulcap::fuzz::readBytes(*chosen, {reinterpret_cast<const char*>(data), size}, ownFolder());
  return 0;
}
