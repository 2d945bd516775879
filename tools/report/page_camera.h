#pragma once

#include <filesystem>
#include <memory>
#include <string>

/// Pictures of a page in a browser without a window: Chromium, spoken to by its DevTools protocol
/// through a pipe, so that there is no port that others could speak to.
///
///   descriptor 3 <- {"id", "method", "params", "sessionId"} and a zero byte
///   descriptor 4 -> {"id", "result" or "error"}, or events without "id", alike

namespace mantle::tools {

class PageCamera {
 public:
  /// Opens the file, which is a page of `mantle report`, and waits until it is drawn. `scratch` is
  /// a folder for the browser's own files. Throws BadInput where there is no Chromium, CannotGoOn
  /// where it does not answer.
  PageCamera(const std::filesystem::path& page, int width, int height,
             const std::filesystem::path& scratch);
  ~PageCamera();
  PageCamera(const PageCamera&) = delete;
  PageCamera& operator=(const PageCamera&) = delete;

  /// Length of the page's replay [s].
  double duration_s() const;
  /// The 3-D view alone at this time, as a JPEG. Throws CannotGoOn.
  std::string Picture(double time_s);

 private:
  class Browser;
  std::unique_ptr<Browser> browser_;
};

/// Where Chromium is; empty: nowhere in PATH.
std::filesystem::path FindChromium();

}  // namespace mantle::tools
