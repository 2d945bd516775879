#include "tools/studies/study_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

constexpr double kSameTime_s = 1e-9;
// A volume that changes by less than this share, and an energy below this, are round-off.
constexpr double kNegligibleVolume = 1e-12, kNegligibleEnergy_j = 1e-18;
constexpr const char* kTitle = "mantle path 1";

void Add(double error, ErrorPair* pair) {
  pair->largest = std::max(pair->largest, error);
  pair->final = error;
}

double Angle(const model::Vector3& a, const model::Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

void AddFrame(const model::Sample& s, StudyPath* path) {
  StudyFrame f;
  f.time_s = s.time_s;
  f.root_m = s.root.position;
  f.heading = s.root.rotation * model::Vector3::UnitZ();
  for (const model::Pose& tip : s.tips) f.tips_m.push_back(tip.position);
  f.volume_m3 = s.volume_m3;
  f.energy_j = s.energies.total();
  path->frames.push_back(std::move(f));
}

std::string StudyPathText(const StudyPath& path) {
  const std::size_t arms = path.frames.empty() ? 0 : path.frames.front().tips_m.size();
  std::string text = fmt::format("{}\n{} {:d} {} {}\n", kTitle, path.body_length_m, path.held, arms,
                                 path.frames.size());
  const auto to = std::back_inserter(text);
  const auto vector = [&](const model::Vector3& v) {
    fmt::format_to(to, " {} {} {}", v.x(), v.y(), v.z());
  };
  for (const StudyFrame& f : path.frames) {
    fmt::format_to(to, "{} {} {}", f.time_s, f.volume_m3, f.energy_j);
    vector(f.root_m);
    vector(f.heading);
    for (const model::Vector3& tip : f.tips_m) vector(tip);
    text += '\n';
  }
  return text;
}

StudyPath ReadStudyPath(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string title;
  std::getline(in, title);
  StudyPath path;
  std::size_t arms = 0, frames = 0;
  in >> path.body_length_m >> path.held >> arms >> frames;
  if (!in || title != kTitle || arms > 100000 || frames > 100'000'000) {
    throw BadInput(
        fmt::format("{}: no path of a run: must begin with \"{}\"", file.string(), kTitle));
  }
  const auto vector = [&](model::Vector3* v) { in >> v->x() >> v->y() >> v->z(); };
  for (std::size_t i = 0; i < frames; ++i) {
    StudyFrame f;
    in >> f.time_s >> f.volume_m3 >> f.energy_j;
    vector(&f.root_m);
    vector(&f.heading);
    f.tips_m.resize(arms);
    for (model::Vector3& tip : f.tips_m) vector(&tip);
    if (!in) {
      throw BadInput(
          fmt::format("{}: ends after {} frames, must hold {}", file.string(), i, frames));
    }
    path.frames.push_back(std::move(f));
  }
  return path;
}

PathErrors ComparePaths(const StudyPath& path, const StudyPath& reference) {
  PathErrors e;
  if (path.frames.empty() || reference.frames.empty()) {
    throw std::invalid_argument("no frames to compare");
  }
  if (path.frames[0].tips_m.size() != reference.frames[0].tips_m.size()) {
    throw std::invalid_argument(fmt::format("{} arms, the reference has {}",
                                            path.frames[0].tips_m.size(),
                                            reference.frames[0].tips_m.size()));
  }
  double change = 0, peak = 0;
  const double rest = reference.frames.front().volume_m3;
  for (const StudyFrame& f : reference.frames) {
    change = std::max(change, std::abs(f.volume_m3 - rest));
    peak = std::max(peak, std::abs(f.energy_j));
  }
  const double length = reference.body_length_m;
  std::size_t next = 0;
  for (const StudyFrame& f : path.frames) {
    while (next < reference.frames.size() &&
           reference.frames[next].time_s < f.time_s - kSameTime_s) {
      ++next;
    }
    if (next == reference.frames.size()) break;
    const StudyFrame& r = reference.frames[next];
    if (r.time_s > f.time_s + kSameTime_s) continue;
    ++e.frames;
    Add((f.root_m - r.root_m).norm() / length, &e.root);
    double worst = 0;
    for (std::size_t k = 0; k < f.tips_m.size(); ++k) {
      worst = std::max(worst, (f.tips_m[k] - r.tips_m[k]).norm());
    }
    Add(worst / length, &e.tip);
    Add(Angle(f.heading, r.heading), &e.heading_rad);
    if (change > kNegligibleVolume * std::abs(rest)) {
      Add(std::abs(f.volume_m3 - r.volume_m3) / change, &e.volume);
    }
    if (peak > kNegligibleEnergy_j) Add(std::abs(f.energy_j - r.energy_j) / peak, &e.energy);
  }
  if (e.frames < 2) throw std::invalid_argument("no instant in common with the reference");
  return e;
}

double Headline(const PathErrors& errors, const StudyPath& reference) {
  const bool arms = !reference.frames.empty() && !reference.frames.front().tips_m.empty();
  if (reference.held && !arms) return errors.volume.largest;
  return std::max(errors.root.largest, errors.tip.largest);
}

}  // namespace mantle::tools
