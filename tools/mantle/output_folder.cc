#include "tools/mantle/output_folder.h"

#include <fmt/format.h>

#include <system_error>

namespace mantle::tools {

std::filesystem::path PartialPath(const std::filesystem::path& path) {
  return path.string() + ".partial";
}

BadInput CannotWrite(const std::filesystem::path& path) {
  return BadInput(fmt::format(
      "--out: {}: cannot be written: must be a folder with write permission", path.string()));
}

OutputFile::OutputFile(const std::filesystem::path& folder, const std::string& name,
                       std::string_view begin)
    : path_(folder / name),
      partial_(PartialPath(path_)),
      out_(partial_, std::ios::binary | std::ios::trunc) {
  if (!out_) throw CannotWrite(partial_);
  Write(begin);
}

void OutputFile::Write(std::string_view text) {
  out_.write(text.data(), static_cast<std::streamsize>(text.size()));
  size_bytes_ += static_cast<long>(text.size());
}

void OutputFile::Flush() {
  out_.flush();
  if (!out_) throw std::runtime_error(partial_.string() + ": cannot be written; is the disk full?");
}

void OutputFile::Publish() {
  Flush();
  out_.close();
  std::filesystem::rename(partial_, path_);
}

void PrepareFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder)) throw CannotWrite(folder);
  const std::filesystem::path probe = folder / ".mantle-write-test";
  if (!std::ofstream(probe)) throw CannotWrite(folder);
  std::filesystem::remove(probe, error);
}

void RemoveOldResults(const std::filesystem::path& folder,
                      std::initializer_list<const char*> names) {
  for (const char* name : names) {
    std::error_code ignored;  // absent is what we want
    std::filesystem::remove(folder / name, ignored);
    std::filesystem::remove(PartialPath(folder / name), ignored);
  }
}

void WriteWhole(const std::filesystem::path& folder, const std::string& name,
                std::string_view text) {
  OutputFile file(folder, name, text);
  file.Publish();
}

}  // namespace mantle::tools
