#include "tools/report/export_mp4.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "loop/scene/regular_file.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/progress.h"
#include "tools/report/child_process.h"
#include "tools/report/page_camera.h"
#include "tools/report/page_file.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

/// A folder of its own for pages and logs, gone with it.
class Scratch {
 public:
  Scratch() {
    std::string name = (fs::temp_directory_path() / "mantle-film-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw CannotGoOn(fmt::format("{}: cannot be made: {}", name, std::strerror(errno)));
    }
    folder_ = name;
  }
  ~Scratch() {
    std::error_code error;
    fs::remove_all(folder_, error);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const fs::path& folder() const { return folder_; }

 private:
  fs::path folder_;
};

/// ffmpeg, which takes pictures and makes the film.
class Encoder {
 public:
  Encoder(const fs::path& out, double frames_per_second, const fs::path& log) : log_(log) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) {
      throw CannotGoOn(fmt::format("no pipe: {}", std::strerror(errno)));
    }
    to_ = ends[1];
    const std::string rate = fmt::format("{}", frames_per_second);
    child_.emplace(FindProgram({"ffmpeg"}),
                   std::vector<std::string>{"-y",
                                            "-loglevel",
                                            "error",
                                            "-nostdin",
                                            "-f",
                                            "image2pipe",
                                            "-c:v",
                                            "mjpeg",
                                            "-framerate",
                                            rate,
                                            "-i",
                                            "pipe:0",
                                            "-c:v",
                                            "libx264",
                                            "-pix_fmt",
                                            "yuv420p",
                                            "-crf",
                                            "20",
                                            "-movflags",
                                            "+faststart",
                                            "-f",
                                            "mp4",
                                            "file:" + out.string()},
                   std::vector<int>{ends[0]}, std::vector<int>{STDIN_FILENO}, log);
    close(ends[0]);
  }
  ~Encoder() {
    if (to_ >= 0) close(to_);
  }
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  void Add(const std::string& picture) {
    for (std::size_t at = 0; at < picture.size();) {
      const auto n = write(to_, picture.data() + at, picture.size() - at);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) Fail();
      at += static_cast<std::size_t>(n);
    }
  }

  void Finish() {
    close(to_);
    to_ = -1;
    if (child_->Wait() != 0) Fail();
  }

 private:
  [[noreturn]] void Fail() const {
    std::string why;
    try {
      why = scene::ReadRegularFile(log_, 1 << 20);
    } catch (const scene::UnreadableFile&) {
    }
    throw CannotGoOn("ffmpeg: " + (why.empty() ? "has ended" : why.substr(0, why.find('\n'))));
  }

  int to_{-1};
  fs::path log_;
  std::optional<ChildProcess> child_;
};

}  // namespace

void DemandFilmTools() {
  if (FindChromium().empty()) {
    throw BadInput(
        "--format mp4: chromium is not in PATH: must be installed (Debian: apt install chromium)");
  }
  if (FindProgram({"ffmpeg"}).empty()) {
    throw BadInput(
        "--format mp4: ffmpeg is not in PATH: must be installed (Debian: apt install ffmpeg)");
  }
}

Film WriteFilm(const fs::path& folder, const fs::path& out, const FilmOptions& options) {
  DemandFilmTools();
  const Scratch scratch;
  const fs::path page = scratch.folder() / kReportName;
  WriteReport({folder}, page);
  PageCamera camera(page, options.width, options.height, scratch.folder());
  if (!(camera.duration_s() > 0)) {
    throw BadInput(
        fmt::format("{}: nothing moves: must be results of a run in time", folder.string()));
  }
  const fs::path partial = out.string() + ".partial";
  const double step_s = options.speed / options.frames_per_second;
  Film film;
  film.frames = static_cast<int>(std::floor(camera.duration_s() / step_s + 1e-9)) + 1;
  film.duration_s = film.frames / options.frames_per_second;
  CatchInterrupts();
  try {
    Encoder encoder(partial, options.frames_per_second, scratch.folder() / "ffmpeg.log");
    Progress progress(0, film.frames, "pictures", false);
    for (int i = 0; i < film.frames; ++i) {
      if (Interrupted()) throw CannotGoOn("interrupted");
      encoder.Add(camera.Picture(std::min(i * step_s, camera.duration_s())));
      progress.Update(i);
    }
    encoder.Finish();
  } catch (...) {
    std::error_code error;
    fs::remove(partial, error);
    throw;
  }
  std::error_code error;
  fs::rename(partial, out, error);
  if (error) {
    throw CannotGoOn(
        fmt::format("--out: {}: cannot be put in place: {}", out.string(), error.message()));
  }
  return film;
}

}  // namespace mantle::tools
