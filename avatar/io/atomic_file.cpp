#include "avatar/io/atomic_file.h"

#include "avatar/io/file_error.h"

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace avatar {
namespace {

namespace fs = std::filesystem;

}  // namespace

void writeFileAtomically(const std::string& path, std::string_view bytes) {
  AtomicFileWriter file(path);
  file.append(bytes);
  file.commit();
}

void requireWritable(const std::string& path) {
  const AtomicFileWriter never(path);
}

AtomicFileWriter::AtomicFileWriter(std::string path)
    : path_(std::move(path)), temporary_(path_ + ".tmp" + std::to_string(getpid())) {
  const fs::path target(path_);
  std::error_code error;
  if (target.has_parent_path())
    fs::create_directories(target.parent_path(), error);
  if (error)
    fail(error.value());
  if (fs::is_directory(target, error))
    throw FileError(path_, "", "is a folder; give the name of a file to write");
  file_.reset(std::fopen(temporary_.c_str(), "wb"));
  if (!file_)
    fail(errno);
}

AtomicFileWriter::~AtomicFileWriter() {
  if (!file_)
    return;
  file_.reset();
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void AtomicFileWriter::append(std::string_view bytes) {
  write(bytes);
}

void AtomicFileWriter::overwrite(long offset, std::string_view bytes) {
  if (file_ && std::fseek(file_.get(), offset, SEEK_SET) != 0)
    fail(errno);
  write(bytes);
  if (std::fseek(file_.get(), 0, SEEK_END) != 0)
    fail(errno);
}

void AtomicFileWriter::commit() {
  if (!file_)
    throw std::invalid_argument("AtomicFileWriter: " + path_ + " has been written already");
  // Closing writes what is still in memory, so that a full disk may show only now.
  if (std::fclose(file_.release()) != 0)
    fail(errno);
  std::error_code error;
  fs::rename(temporary_, path_, error);
  if (error)
    fail(error.value());
}

void AtomicFileWriter::write(std::string_view bytes) {
  if (!file_)
    throw std::invalid_argument("AtomicFileWriter: " + path_ + " has been written already");
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
    fail(errno);
}

void AtomicFileWriter::fail(int reason) {
  file_.reset();
  std::error_code ignored;
  fs::remove(temporary_, ignored);
  throw FileError(
      path_,
      "",
      "cannot be written (" + std::generic_category().message(reason) +
          "); choose a folder with room that you may write to");
}

}  // namespace avatar
