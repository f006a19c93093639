#include "avatar/io/atomic_file.h"

#include "avatar/io/file_error.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <unistd.h>

namespace avatar {

void writeFileAtomically(const std::string& path, std::string_view bytes) {
  namespace fs = std::filesystem;
  const fs::path target(path);
  std::error_code error;
  if (target.has_parent_path())
    fs::create_directories(target.parent_path(), error);
  if (fs::is_directory(target))
    throw FileError(path, "", "is a folder; give the name of a file to write");

  const std::string temporary = path + ".tmp" + std::to_string(getpid());
  std::ofstream file(temporary, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  const int reason = errno;
  if (file)
    fs::rename(temporary, target, error);
  if (!file || error) {
    fs::remove(temporary, error);
    throw FileError(
        path,
        "",
        "cannot be written (" + std::generic_category().message(reason) +
            "); choose a folder you may write to");
  }
}

}  // namespace avatar
