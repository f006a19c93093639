#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

namespace avatar {

/// Writes a file whole or not at all: under a temporary name beside it, then renamed. Missing
/// folders on the way are made. Throws FileError.
void writeFileAtomically(const std::string& path, std::string_view bytes);

/// Throws FileError when no file could be written there: before long work that ends with it.
void requireWritable(const std::string& path);

/// The same piece by piece, for files that are made while the program runs. Destroyed before
/// commit() it leaves nothing behind.
class AtomicFileWriter {
 public:
  /// Throws FileError when the file can't be written.
  explicit AtomicFileWriter(std::string path);
  ~AtomicFileWriter();
  AtomicFileWriter(const AtomicFileWriter&) = delete;
  AtomicFileWriter& operator=(const AtomicFileWriter&) = delete;
  AtomicFileWriter(AtomicFileWriter&&) = delete;
  AtomicFileWriter& operator=(AtomicFileWriter&&) = delete;

  /// At the end of what is written. Throws FileError.
  void append(std::string_view bytes);

  /// Over what has been written at this offset; appending goes on at the end.
  void overwrite(long offset, std::string_view bytes);

  /// Gives the file its name. Throws FileError; nothing can be written any more.
  void commit();

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void write(std::string_view bytes);
  [[noreturn]] void fail(int reason);

  std::string path_;
  std::string temporary_;
  std::unique_ptr<std::FILE, CloseFile> file_;
};

}  // namespace avatar
