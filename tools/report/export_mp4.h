#pragma once

#include <filesystem>

/// A film of a replay, for slides and talks: pictures of the report's page by Chromium, put
/// together by ffmpeg (H.264 in MP4).

namespace mantle::tools {

struct FilmOptions {
  int width{1280}, height{720};  ///< even
  double frames_per_second{25};
  double speed{1};  ///< of the replay, times real time
};

/// What a film has come to.
struct Film {
  int frames{0};
  double duration_s{0};  ///< of the film
};

/// Throws BadInput where Chromium or ffmpeg is not in PATH.
void DemandFilmTools();

/// The film of a folder of results, into the file `out`, whole or not at all. Throws BadInput as
/// WriteReport and DemandFilmTools, and where nothing moves; CannotGoOn where one of the programs
/// fails, or the film is interrupted.
Film WriteFilm(const std::filesystem::path& folder, const std::filesystem::path& out,
               const FilmOptions& options);

}  // namespace mantle::tools
