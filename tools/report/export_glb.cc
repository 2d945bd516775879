#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/report/export_formats.h"
#include "tools/report/packed_array.h"
#include "tools/report/surface.h"

namespace mantle::tools {
namespace {

constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A,
                        kBinaryChunk = 0x004E4942;
constexpr int kFloat = 5126, kUnsigned = 5125;

void Put(std::uint32_t value, std::string* to) {
  for (int i = 0; i < 4; ++i) to->push_back(static_cast<char>(value >> (8 * i)));
}
void Put(double value, std::string* to) {
  Put(std::bit_cast<std::uint32_t>(static_cast<float>(value)), to);
}

/// The file's arrays, one behind the other, each with its view and accessor.
class Arrays {
 public:
  /// Index of the accessor of what was put since the last one.
  std::size_t Close(int component, const char* type, std::size_t count, Json limits = {}) {
    views_.push_back(
        {{"buffer", 0}, {"byteOffset", begin_}, {"byteLength", bytes.size() - begin_}});
    Json accessor = {{"bufferView", views_.size() - 1},
                     {"componentType", component},
                     {"count", count},
                     {"type", type}};
    if (!limits.is_null()) accessor.update(limits);
    accessors_.push_back(accessor);
    begin_ = bytes.size();
    return accessors_.size() - 1;
  }

  /// Points minus `from`, with their limits, which glTF asks for.
  std::size_t Points(const std::vector<Triple>& points, const std::vector<Triple>* from) {
    Triple low{}, high{};
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double x = points[i][k] - (from == nullptr ? 0.0 : (*from)[i][k]);
        const double single = double{static_cast<float>(x)};
        low[k] = i == 0 ? single : std::min(low[k], single);
        high[k] = i == 0 ? single : std::max(high[k], single);
        Put(x, &bytes);
      }
    }
    return Close(kFloat, "VEC3", points.size(), {{"min", low}, {"max", high}});
  }

  std::string bytes;
  const Json& views() const { return views_; }
  const Json& accessors() const { return accessors_; }

 private:
  std::size_t begin_{0};
  Json views_ = Json::array(), accessors_ = Json::array();
};

Json Material(const char* name, const std::array<double, 4>& colour) {
  Json m = {{"name", name},
            {"doubleSided", true},
            {"pbrMetallicRoughness",
             {{"baseColorFactor", colour}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.7}}}};
  if (colour[3] < 1.0) m["alphaMode"] = "BLEND";
  return m;
}

std::string Chunk(std::uint32_t kind, std::string data, char fill) {
  while (data.size() % 4 != 0) data += fill;
  std::string chunk;
  Put(static_cast<std::uint32_t>(data.size()), &chunk);
  Put(kind, &chunk);
  return chunk + data;
}

}  // namespace

std::string ExportGlb(const RunRecord& run, std::size_t most_shapes) {
  const std::vector<std::size_t> kept =
      EveryKth(run.shapes.size(), ThinningFor(run.shapes.size(), most_shapes));
  const Surface first = SurfaceOf(run.shapes.front());
  Arrays arrays;
  const std::size_t position = arrays.Points(first.position, nullptr);
  Json targets = Json::array(), primitives = Json::array();
  for (std::size_t i = 1; i < kept.size(); ++i) {
    const Surface s = SurfaceOf(run.shapes[kept[i]]);
    targets.push_back({{"POSITION", arrays.Points(s.position, &first.position)}});
  }
  constexpr SurfaceBody kBodies[] = {SurfaceBody::kMantle, SurfaceBody::kArm, SurfaceBody::kRigid};
  for (const SurfaceBody body : kBodies) {
    std::size_t count = 0;
    for (const auto& t : first.triangles) {
      if (first.body[t[0]] != body) continue;
      for (const std::uint32_t p : t) Put(p, &arrays.bytes);
      count += 3;
    }
    if (count == 0) continue;
    Json primitive = {{"attributes", {{"POSITION", position}}},
                      {"indices", arrays.Close(kUnsigned, "SCALAR", count)},
                      {"material", static_cast<int>(body)}};
    if (!targets.empty()) primitive["targets"] = targets;
    primitives.push_back(primitive);
  }
  Json mesh = {{"name", run.label}, {"primitives", primitives}};
  // Glued to z up as the earth is; glTF's y is up.
  const double half = std::sqrt(0.5);
  Json gltf = {
      {"asset", {{"version", "2.0"}, {"generator", "Mantle"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"name", "earth"}, {"rotation", {-half, 0.0, 0.0, half}}, {"mesh", 0}}}}};
  if (!targets.empty()) {
    mesh["weights"] = std::vector<double>(targets.size(), 0.0);
    const auto time = [&](std::size_t i) {
      return static_cast<double>(run.shapes[kept[i]].utime) / 1e6;
    };
    for (std::size_t i = 0; i < kept.size(); ++i) Put(time(i), &arrays.bytes);
    const auto single = [](double t) { return double{static_cast<float>(t)}; };
    const std::size_t times =
        arrays.Close(kFloat, "SCALAR", kept.size(),
                     {{"min", {single(time(0))}}, {"max", {single(time(kept.size() - 1))}}});
    // At shape i its target alone; between shapes, linearly from one to the next.
    for (std::size_t i = 0; i < kept.size(); ++i) {
      for (std::size_t k = 1; k < kept.size(); ++k) Put(i == k ? 1.0 : 0.0, &arrays.bytes);
    }
    const std::size_t weights = arrays.Close(kFloat, "SCALAR", kept.size() * (kept.size() - 1));
    gltf["animations"] = {
        {{"name", "run"},
         {"samplers", {{{"input", times}, {"output", weights}, {"interpolation", "LINEAR"}}}},
         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}}}};
  }
  gltf["meshes"] = Json::array({mesh});
  gltf["materials"] = {Material("mantle", {0.34, 0.71, 0.91, 0.5}),
                       Material("arm", {0.84, 0.37, 0.0, 1.0}),
                       Material("rigid body", {0.5, 0.5, 0.5, 1.0})};
  gltf["accessors"] = arrays.accessors();
  gltf["bufferViews"] = arrays.views();
  gltf["buffers"] = {{{"byteLength", arrays.bytes.size()}}};
  const std::string body =
      Chunk(kJsonChunk, gltf.dump(-1, ' ', false, Json::error_handler_t::replace), ' ') +
      Chunk(kBinaryChunk, std::move(arrays.bytes), '\0');
  std::string file;
  Put(kMagic, &file);
  Put(kVersion, &file);
  Put(static_cast<std::uint32_t>(12 + body.size()), &file);
  return file + body;
}

}  // namespace mantle::tools
