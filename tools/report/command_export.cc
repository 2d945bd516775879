#include <algorithm>
#include <charconv>
#include <filesystem>

#include "tools/mantle/commands.h"
#include "tools/mantle/output_file.h"
#include "tools/mantle/standard_output.h"
#include "tools/report/export_formats.h"
#include "tools/report/export_mp4.h"
#include "tools/report/packed_array.h"

/// `mantle export`: results for other programs.

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHelp =
    "Export results to other programs (docs/report.md): the whole bodies over time, and the tables "
    "beside\nthem.\n\n"
    "  mantle export results/steer --format npz           # results/steer.npz: NumPy\n"
    "  mantle export results/steer --format vtk           # results/steer_vtk/shapes.pvd: "
    "ParaView\n"
    "  mantle export results/steer --format csv           # results/steer_csv/: tables\n"
    "  mantle export results/steer --format gltf          # results/steer.glb: Blender, slides\n"
    "  mantle export results/steer --format mcap          # results/steer.mcap: Foxglove\n"
    "  mantle export results/steer --format mp4           # results/steer.mp4: a film, by "
    "Chromium and ffmpeg\n"
    "  mantle export results/steer --format vtk --shapes 100 --out frames\n\n"
    "Of `mantle compare` the full and the reduced model are exported each by itself (_full, "
    "_reduced), but for a film, which shows both.\nA file is replaced whole; a folder must not be "
    "there yet. Exit status 0: done. 2: "
    "bad input,\nnothing changed. 3: could not go on; what was written is in FOLDER.partial.";

// Shapes that formats with one picture for each take without being asked.
constexpr std::size_t kFewShapes = 400, kAllShapes = 10'000'000;

struct ExportOptions {
  std::string folder, format, out;
  std::size_t shapes{0};
  FilmOptions film;
  std::string picture{"1280x720"};
  bool json{false};
};

bool IsFolder(const std::string& format) { return format == "csv" || format == "vtk"; }

fs::path WithoutSlash(const fs::path& path) {
  const fs::path plain = path.lexically_normal();
  return plain.has_filename() ? plain : plain.parent_path();
}

fs::path Destination(const ExportOptions& options, const std::string& part) {
  const std::string suffix = IsFolder(options.format)   ? "_" + options.format
                             : options.format == "gltf" ? std::string(".glb")
                                                        : "." + options.format;
  fs::path out = options.out;
  if (out.empty()) {
    const fs::path plain = WithoutSlash(options.folder);
    const fs::path named =
        plain.filename() == "." || plain.filename() == ".." ? fs::canonical(options.folder) : plain;
    out = named.string() + suffix;
  }
  if (part.empty()) return WithoutSlash(out);
  const fs::path plain = WithoutSlash(out);
  return plain.parent_path() / (plain.stem().string() + "_" + part + plain.extension().string());
}

// Every k-th shape and the last.
void Thin(std::size_t most, RunRecord* run) {
  std::vector<ShapeTelemetry> kept;
  for (const std::size_t i : EveryKth(run->shapes.size(), ThinningFor(run->shapes.size(), most))) {
    kept.push_back(std::move(run->shapes[i]));
  }
  run->shapes = std::move(kept);
}

void DemandShapes(const RunRecord& run, const std::string& format) {
  if (!run.shapes.empty() || format == "npz") return;
  throw BadInput(fmt::format(
      "{}: has no shapes to export as {}: must have a log with MANTLE_SHAPE (`mantle run` without "
      "--shape-every 0)",
      run.folder.string(), format));
}

void DemandPlace(const fs::path& out, bool folder) {
  const fs::path parent = out.has_parent_path() ? out.parent_path() : fs::path(".");
  if (!fs::is_directory(parent)) {
    throw BadInput(fmt::format("--out: {}: there is no such folder", parent.string()));
  }
  const bool taken = folder ? fs::exists(fs::symlink_status(out)) : fs::is_directory(out);
  if (taken) {
    throw BadInput(fmt::format(
        "--out: {}: {}", out.string(),
        folder ? "is there already: must be a folder to be made" : "is a folder: must be a file"));
  }
}

// The folder appears when it is whole.
void WriteFolder(const RunRecord& run, const std::string& format, const fs::path& out) {
  const fs::path partial = out.string() + ".partial";
  if (fs::exists(fs::symlink_status(partial))) {
    throw BadInput(fmt::format("--out: {} is in the way: must be absent", partial.string()));
  }
  std::error_code error;
  fs::create_directory(partial, error);
  if (error) throw CannotWrite(partial);
  const auto put = [&](const std::string& name, std::string_view text) {
    const fs::path file = partial / name;
    fs::create_directories(file.parent_path(), error);
    WriteWhole(file.parent_path(), file.filename().string(), text);
  };
  format == "csv" ? ExportCsv(run, put) : ExportVtk(run, put);
  fs::rename(partial, out, error);
  if (error) {
    throw CannotGoOn(fmt::format("--out: {}: cannot be put in place: {}; it is in {}", out.string(),
                                 error.message(), partial.string()));
  }
}

void WriteFile(const RunRecord& run, const std::string& format, std::size_t shapes,
               const fs::path& out) {
  const std::string text = format == "npz"    ? ExportNpz(run)
                           : format == "gltf" ? ExportGlb(run, shapes)
                                              : ExportMcap(run);
  WriteWhole(out.has_parent_path() ? out.parent_path() : fs::path("."), out.filename().string(),
             text);
}

// "1280x720".
void ReadPictureSize(const std::string& text, FilmOptions* film) {
  const std::size_t cross = text.find('x');
  const char *begin = text.data(), *end = begin + text.size();
  int width = 0, height = 0;
  const bool read = cross != text.npos &&
                    std::from_chars(begin, begin + cross, width).ptr == begin + cross &&
                    std::from_chars(begin + cross + 1, end, height).ptr == end;
  const auto fits = [](int pixels) { return pixels >= 160 && pixels <= 4096 && pixels % 2 == 0; };
  if (!read || !fits(width) || !fits(height)) {
    throw BadInput(fmt::format(
        "--picture: {}: must be WIDTHxHEIGHT, both even, from 160 to 4096 pixels", text));
  }
  film->width = width;
  film->height = height;
}

int ExportFilm(const ExportOptions& options) {
  FilmOptions film = options.film;
  ReadPictureSize(options.picture, &film);
  if (options.shapes > 0) throw BadInput("--shapes: is for other formats than mp4");
  DemandFilmTools();
  const fs::path out = Destination(options, "");
  DemandPlace(out, false);
  const Film made = WriteFilm(options.folder, out, film);
  if (options.json) {
    PrintText(Dump(Json{
        {"exports",
         {{{"out", out.string()}, {"frames", made.frames}, {"duration_s", made.duration_s}}}}}));
  } else {
    Print("{}: {} pictures, {:.1f} s\n", out.string(), made.frames, made.duration_s);
  }
  return 0;
}

int Export(const ExportOptions& options) {
  if (options.format == "mp4") return ExportFilm(options);
  std::vector<RunRecord> runs = ReadRunFolder(options.folder);
  const bool few = options.format == "gltf" || options.format == "mcap";
  const std::size_t most = options.shapes > 0 ? options.shapes : few ? kFewShapes : kAllShapes;
  std::vector<fs::path> places;
  for (const RunRecord& run : runs) {
    DemandShapes(run, options.format);
    places.push_back(
        Destination(options, runs.size() < 2 ? "" : run.label.substr(run.label.rfind(' ') + 1)));
    DemandPlace(places.back(), IsFolder(options.format));
  }
  Json made = Json::array();
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::size_t all = runs[i].shapes.size();
    Thin(std::max<std::size_t>(most, 2), &runs[i]);
    if (IsFolder(options.format)) {
      WriteFolder(runs[i], options.format, places[i]);
    } else {
      WriteFile(runs[i], options.format, most, places[i]);
    }
    made.push_back({{"out", places[i].string()},
                    {"shapes", runs[i].shapes.size()},
                    {"of_shapes", all},
                    {"notes", runs[i].notes}});
    if (options.json) continue;
    Print("{}: {} of {} shapes\n", places[i].string(), runs[i].shapes.size(), all);
    for (const std::string& note : runs[i].notes) Print("  {}\n", note);
  }
  if (options.json) PrintText(Dump(Json{{"exports", made}}));
  return 0;
}

}  // namespace

void AddExportCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("export", kHelp);
  static ExportOptions options;  // lives as long as the parser that points to it
  command->add_option("DIR", options.folder, "Folder of results")->required();
  command->add_option("--format", options.format, "For which program")
      ->required()
      ->check(CLI::IsMember({"csv", "vtk", "npz", "gltf", "mcap", "mp4"}));
  command
      ->add_option("--out", options.out,
                   "File or folder to make (default: DIR.npz, DIR_vtk ... beside DIR)")
      ->type_name("PATH");
  command
      ->add_option("--shapes", options.shapes,
                   "At most so many shapes, thinned evenly (default: all; gltf and mcap 400)")
      ->type_name("N")
      ->check(CLI::Range(2, 10'000'000));
  const char* film = "Film";
  command->add_option("--picture", options.picture, "Size of the pictures")
      ->type_name("WIDTHxHEIGHT")
      ->capture_default_str()
      ->group(film);
  command->add_option("--fps", options.film.frames_per_second, "Pictures a second")
      ->check(CLI::Range(1.0, 120.0))
      ->capture_default_str()
      ->group(film);
  command->add_option("--speed", options.film.speed, "Of the replay, times real time")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str()
      ->group(film);
  command->add_flag("--json", options.json, "One JSON object on standard output");
  command->callback([&exit_status] { exit_status = Export(options); });
}

}  // namespace mantle::tools
