#include <fmt/format.h>

#include <iterator>

#include "tools/report/export_formats.h"
#include "tools/report/packed_array.h"
#include "tools/report/surface.h"

// MCAP: magic, records of an opcode (1 byte), a length (8) and content, magic again; numbers
// little- endian, texts with their length (4) before them. Messages stand in the data section in
// the order of their time, without chunks; the summary repeats schemas and channels.

namespace mantle::tools {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
enum Opcode : std::uint8_t {
  kHeader = 1,
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kStatistics = 0x0B,
  kDataEnd = 0x0F
};
constexpr std::uint16_t kScene = 1, kTrajectory = 2;

template <typename Integer>
void Put(Integer value, std::string* to) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    to->push_back(static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i)));
  }
}
void PutText(std::string_view text, std::string* to) {
  Put(static_cast<std::uint32_t>(text.size()), to);
  *to += text;
}

std::string Record(Opcode opcode, const std::string& content) {
  std::string record(1, static_cast<char>(opcode));
  Put(static_cast<std::uint64_t>(content.size()), &record);
  return record + content;
}

std::string Schema(std::uint16_t id, std::string_view name, std::string_view schema) {
  std::string content;
  Put(id, &content);
  PutText(name, &content);
  PutText("jsonschema", &content);
  PutText(schema, &content);
  return Record(kSchema, content);
}

std::string Channel(std::uint16_t id, std::string_view topic) {
  std::string content;
  Put(id, &content);
  Put(id, &content);  // its schema
  PutText(topic, &content);
  PutText("json", &content);
  Put(std::uint32_t{0}, &content);  // no metadata
  return Record(kChannel, content);
}

Json Point(const Triple& p) { return {{"x", p[0]}, {"y", p[1]}, {"z", p[2]}}; }
Json Colour(double r, double g, double b, double a) {
  return {{"r", r}, {"g", g}, {"b", b}, {"a", a}};
}

const Json& Origin() {
  static const Json pose = {{"position", {{"x", 0}, {"y", 0}, {"z", 0}}},
                            {"orientation", {{"x", 0}, {"y", 0}, {"z", 0}, {"w", 1}}}};
  return pose;
}

Json Entity(const char* id, const Json& time) {
  Json e = {{"timestamp", time},
            {"frame_id", "earth"},
            {"id", id},
            {"lifetime", {{"sec", 0}, {"nsec", 0}}},
            {"frame_locked", false},
            {"metadata", Json::array()}};
  for (const char* list :
       {"arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models"}) {
    e[list] = Json::array();
  }
  return e;
}

std::string SceneUpdate(const ShapeTelemetry& m) {
  const Json time = {{"sec", m.utime / 1'000'000}, {"nsec", m.utime % 1'000'000 * 1000}};
  const Surface s = SurfaceOf(m);
  const std::pair<const char*, Json> bodies[] = {{"mantle", Colour(0.34, 0.71, 0.91, 0.5)},
                                                 {"arms", Colour(0.84, 0.37, 0.0, 1.0)},
                                                 {"rigid body", Colour(0.5, 0.5, 0.5, 1.0)}};
  Json entities = Json::array();
  for (std::size_t b = 0; b < std::size(bodies); ++b) {
    Json points = Json::array(), indices = Json::array();
    std::vector<std::int64_t> index(s.position.size(), -1);
    for (std::size_t i = 0; i < s.position.size(); ++i) {
      if (static_cast<std::size_t>(s.body[i]) != b) continue;
      index[i] = std::ssize(points);
      points.push_back(Point(s.position[i]));
    }
    if (points.empty()) continue;
    for (const auto& t : s.triangles) {
      if (static_cast<std::size_t>(s.body[t[0]]) != b) continue;
      for (const std::uint32_t p : t) indices.push_back(index[p]);
    }
    Json entity = Entity(bodies[b].first, time);
    entity["triangles"].push_back({{"pose", Origin()},
                                   {"points", points},
                                   {"color", bodies[b].second},
                                   {"colors", Json::array()},
                                   {"indices", indices}});
    entities.push_back(entity);
  }
  Json cables = Entity("cables", time);
  std::size_t at = 0;
  for (std::size_t c = 0; c < m.cable_points.size(); ++c) {
    Json points = Json::array();
    for (std::int32_t i = 0; i < m.cable_points[c]; ++i, ++at) {
      const auto& p = m.cable_position[at];
      points.push_back(Point({double{p[0]}, double{p[1]}, double{p[2]}}));
    }
    cables["lines"].push_back({{"type", 0},
                               {"pose", Origin()},
                               {"thickness", 2},
                               {"scale_invariant", true},
                               {"points", points},
                               {"color", Colour(0.1, 0.1, 0.1, 1.0)},
                               {"colors", Json::array()},
                               {"indices", Json::array()}});
  }
  if (!cables["lines"].empty()) entities.push_back(cables);
  return Json{{"deletions", Json::array()}, {"entities", entities}}.dump();
}

constexpr std::string_view kSceneSchema =
    R"({"title":"foxglove.SceneUpdate","type":"object","properties":{"deletions":{"type":"array","items":{"type":"object"}},"entities":{"type":"array","items":{"type":"object","properties":{"timestamp":{"type":"object","title":"time","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},"frame_id":{"type":"string"},"id":{"type":"string"},"lines":{"type":"array","items":{"type":"object"}},"triangles":{"type":"array","items":{"type":"object"}}}}}}})";

}  // namespace

std::string ExportMcap(const RunRecord& run) {
  Json columns = Json::object();
  if (run.trajectory) {
    for (const std::string& title : run.trajectory->titles) columns[title] = {{"type", "number"}};
  }
  const Json trajectory = {
      {"title", "mantle.Trajectory"}, {"type", "object"}, {"properties", columns}};
  const std::string definitions = Schema(kScene, "foxglove.SceneUpdate", kSceneSchema) +
                                  Channel(kScene, "/mantle/shape") +
                                  Schema(kTrajectory, "mantle.Trajectory", trajectory.dump()) +
                                  Channel(kTrajectory, "/mantle/trajectory");
  std::string file(kMagic), header;
  PutText("", &header);
  PutText("Mantle", &header);
  file += Record(kHeader, header) + definitions;
  std::uint64_t count[3] = {0, 0, 0}, first_ns = ~std::uint64_t{0}, last_ns = 0;
  const auto write = [&](std::uint16_t channel, std::uint64_t time_ns, const std::string& data) {
    std::string content;
    Put(channel, &content);
    Put(static_cast<std::uint32_t>(count[channel]++), &content);
    Put(time_ns, &content);
    Put(time_ns, &content);
    file += Record(kMessage, content + data);
    first_ns = std::min(first_ns, time_ns);
    last_ns = std::max(last_ns, time_ns);
  };
  const auto row_ns = [&](std::size_t row) {
    return static_cast<std::uint64_t>(1e9 * run.trajectory->columns.front()[row] + 0.5);
  };
  const std::size_t rows = run.trajectory ? run.trajectory->rows() : 0;
  std::size_t row = 0;
  const auto write_rows = [&](std::uint64_t until_ns) {
    for (; row < rows && row_ns(row) <= until_ns; ++row) {
      Json message = Json::object();
      for (std::size_t c = 0; c < run.trajectory->titles.size(); ++c) {
        message[run.trajectory->titles[c]] = run.trajectory->columns[c][row];
      }
      write(kTrajectory, row_ns(row), message.dump());
    }
  };
  for (const ShapeTelemetry& m : run.shapes) {
    const auto time_ns = static_cast<std::uint64_t>(m.utime) * 1000;
    write_rows(time_ns);
    write(kScene, time_ns, SceneUpdate(m));
  }
  write_rows(~std::uint64_t{0});
  file += Record(kDataEnd, std::string(4, '\0'));  // no checksum
  const std::uint64_t summary = file.size();
  std::string statistics;
  Put(count[kScene] + count[kTrajectory], &statistics);
  Put(std::uint16_t{2}, &statistics);
  Put(std::uint32_t{2}, &statistics);
  for (int i = 0; i < 3; ++i) Put(std::uint32_t{0}, &statistics);  // attachments, metadata, chunks
  Put(last_ns >= first_ns ? first_ns : 0, &statistics);
  Put(last_ns, &statistics);
  Put(std::uint32_t{20}, &statistics);  // bytes of the map: channel, messages
  for (const std::uint16_t channel : {kScene, kTrajectory}) {
    Put(channel, &statistics);
    Put(count[channel], &statistics);
  }
  file += definitions + Record(kStatistics, statistics);
  std::string footer;
  Put(summary, &footer);
  Put(std::uint64_t{0}, &footer);
  Put(std::uint32_t{0}, &footer);
  file += Record(kFooter, footer);
  file += kMagic;
  return file;
}

}  // namespace mantle::tools
