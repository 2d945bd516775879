#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "tools/mantle/bad_input.h"

/// A result file that grows. An error of the disk is noticed when it happens.

namespace mantle::tools {

/// What is thrown where a result cannot be written at all.
BadInput CannotWrite(const std::filesystem::path& path);

class OutputFile {
 public:
  /// Makes folder/name anew with `begin` in it; replaces what has that name by a rename, so that
  /// no link is followed. Throws BadInput where the file cannot be made, CannotGoOn where `begin`
  /// cannot be written.
  OutputFile(const std::filesystem::path& folder, const std::string& name,
             std::string_view begin = {});
  /// Hands over what is buffered; an error is no longer heard of: Close first.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends a row or record; on disk from time to time. Throws CannotGoOn where the disk takes no
  /// more; the file then ends with a whole record. Does not allocate.
  void Write(std::string_view text);
  /// The system has all that was written. Throws as Write.
  void Flush();
  /// The disk has it. Throws as Write.
  void Close();
  long size_bytes() const { return size_bytes_; }

 private:
  void HandOver(std::string_view text);
  [[noreturn]] void Fail(int error);

  std::filesystem::path path_;
  int fd_{-1};
  std::string buffer_;
  long size_bytes_{0};  ///< buffered ones included
  long on_disk_bytes_{0};
  long whole_bytes_{0};  ///< on disk, up to the end of a text that was given to Write
};

/// Writes a whole file at once: it has its name only when it is whole. Throws as OutputFile.
void WriteWhole(const std::filesystem::path& folder, const std::string& name,
                std::string_view text);

}  // namespace mantle::tools
